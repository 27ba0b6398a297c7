//! Hands that reach, turn, pause and tremble, before rolling shutters out of step: poses, and predictions of them.
//!
//! After every update the tracker is asked where each shell will be 40 ms later, and that is compared with where it then
//! truly is; beside it, what comes of holding the pose of the update.

use nalgebra::Isometry3;

use super::film::{Coding, Film, scene_s, truth_at};
use super::harm::Trial;
use super::stage::Stage;
use super::tally::Tally;
use crate::eval::statistics::rms;
use crate::eval::{Figure, Must, Report};
use crate::operator::motion::Body;

/// Images a second of each camera: what a ZED delivers at 720p.
pub const RATE_HZ: f64 = 60.0;
/// When the hands have begun.
const BEGIN_S: f64 = 1.0;
/// For how long, by default.
pub const SECONDS: f64 = 10.0;
/// How far ahead.
const AHEAD_NS: u64 = 40_000_000;

/// What the tracker made of it.
#[derive(Debug)]
pub struct Outcome {
    /// At the time of each update.
    pub now: Tally,
    /// In the order of the shells.
    predicted: Vec<Ahead>,
    held: Vec<Ahead>,
}

/// Errors of poses some time ahead.
#[derive(Debug, Clone, Default)]
struct Ahead {
    position_m: Vec<f64>,
    rotation_rad: Vec<f64>,
}

impl Ahead {
    fn add(&mut self, truth: &Isometry3<f64>, pose: &Isometry3<f64>) {
        self.position_m.push((truth.translation.vector - pose.translation.vector).norm());
        self.rotation_rad.push(truth.rotation.angle_to(&pose.rotation));
    }

    fn rms_mm_deg(&self) -> (f64, f64) {
        (1e3 * rms(&self.position_m), rms(&self.rotation_rad).to_degrees())
    }
}

/// Films and tracks; the trials see the same film.
pub fn run(stage: &Stage, seconds: f64, trials: &mut [Trial]) -> anyhow::Result<Outcome> {
    let none = vec![Ahead::default(); stage.shells.shells.len()];
    let mut outcome = Outcome { now: Tally::new(&stage.shells), predicted: none.clone(), held: none };
    let film =
        Film { studio: &stage.studio, begin_s: BEGIN_S, seconds, rate_hz: RATE_HZ, coding: Coding::Jpeg };
    let mut tracker = stage.tracker()?;
    film.show(|shot| {
        let shot = shot.decoded()?;
        trials.iter_mut().for_each(|trial| trial.see(stage, &shot));
        let update = tracker.update(&shot.frames);
        outcome.now.add(&stage.studio, &shot, &update);
        let then_ns = update.time_ns + AHEAD_NS;
        if scene_s(update.time_ns) < BEGIN_S + 0.5 {
            // Found only now: how it moves is not known yet.
            return Ok(());
        }
        let truth = truth_at(&stage.studio, then_ns);
        let ahead = tracker.predict(then_ns);
        for (shell, (now, then)) in update.shells.iter().zip(&ahead).enumerate() {
            let Some(body) = outcome.now.shells[shell].body else { continue };
            if let (Some(now), Some(then)) = (&now.world_from_shell, &then.world_from_shell) {
                outcome.predicted[shell].add(truth.of(body), then);
                outcome.held[shell].add(truth.of(body), now);
            }
        }
        Ok(())
    })?;
    Ok(outcome)
}

/// Adds the figures of the predictions.
pub fn report(outcome: &Outcome, report: &mut Report) {
    /// How much better than holding.
    const LEAST_GAIN: f64 = 3.0;
    for (shell, (predicted, held)) in
        outcome.now.shells.iter().zip(outcome.predicted.iter().zip(&outcome.held))
    {
        let figure = |what: &str, value: f64, unit| {
            Figure::new(format!("prediction.{}.{what}", shell.name), value, unit)
        };
        let ((mm, deg), (held_mm, held_deg)) = (predicted.rms_mm_deg(), held.rms_mm_deg());
        report.push(figure("position_rms", mm, "mm").must(Must::AtMost(4.0)));
        report.push(figure("position_rms_held", held_mm, "mm"));
        report.push(figure("rotation_rms", deg, "deg").must(Must::AtMost(1.5)));
        report.push(figure("rotation_rms_held", held_deg, "deg"));
        let gains = [
            ("position_held_over_predicted", held_mm / mm),
            ("rotation_held_over_predicted", held_deg / deg),
        ];
        for (what, gain) in gains {
            let figure = figure(what, gain, "");
            // A torso hardly moves: there is little to be gained.
            let bound = shell.body != Some(Body::Torso);
            report.push(if bound { figure.must(Must::AtLeast(LEAST_GAIN)) } else { figure });
        }
    }
}
