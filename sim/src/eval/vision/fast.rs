//! Fast hands before rolling shutters out of step: 1 m/s and 360 deg/s at full HD.
//!
//! Errors are those at the time that the tracker gives for its poses. A second tracker that takes the same images for
//! ones of a global shutter shows what the row times are worth.

use locoman_vision::rig::Rig;

use super::film::{Coding, Film};
use super::stage::Stage;
use super::tally::Tally;
use crate::eval::{Figure, Must, Report};
use crate::operator::motion::Body;

/// Images a second of each camera: what a ZED delivers at full HD.
const RATE_HZ: f64 = 30.0;
/// When the hands go at full speed.
const BEGIN_S: f64 = 2.0;
/// So much earlier the trackers begin: what they make of a first sight is not measured here.
const EARLIER_S: f64 = 0.5;
/// For how long, by default.
pub const SECONDS: f64 = 8.0;

/// What both trackers made of it.
#[derive(Debug)]
pub struct Outcome {
    /// The tracker that knows about rows.
    pub with_rows: Tally,
    /// The one that does not.
    pub without_rows: Tally,
}

/// Films and tracks.
pub fn run(stage: &Stage, seconds: f64) -> anyhow::Result<Outcome> {
    let (mut with_rows, mut without_rows) = (Tally::new(&stage.shells), Tally::new(&stage.shells));
    let film = Film {
        studio: &stage.studio,
        begin_s: BEGIN_S - EARLIER_S,
        seconds: seconds + EARLIER_S,
        rate_hz: RATE_HZ,
        coding: Coding::Jpeg,
    };
    let mut tracker = stage.tracker()?;
    let mut without = stage.tracker_with(without_row_times(&stage.rig))?;
    film.show(|shot| {
        let shot = shot.decoded()?;
        let (found, found_without) = (tracker.update(&shot.frames), without.update(&shot.frames));
        if shot.time_s >= BEGIN_S {
            with_rows.add(&stage.studio, &shot, &found);
            without_rows.add(&stage.studio, &shot, &found_without);
        }
        Ok(())
    })?;
    Ok(Outcome { with_rows, without_rows })
}

/// Adds the figures.
pub fn report(outcome: &Outcome, report: &mut Report) {
    for (shell, without) in outcome.with_rows.shells.iter().zip(&outcome.without_rows.shells) {
        let figure =
            |what: &str, value: f64, unit| Figure::new(format!("fast.{}.{what}", shell.name), value, unit);
        let (position, rotation) = (shell.position_rms_mm(), shell.rotation_rms_deg());
        report.push(
            figure("position_rms", position, "mm")
                .must(Must::AtMost(1.0))
                .reference(2.0, "Vicon, dynamic, at most: Merriaux 2017"),
        );
        report.push(figure("rotation_rms", rotation, "deg").must(Must::AtMost(0.4)));
        report.push(figure("position_worst", shell.position_worst_mm(), "mm"));
        report.push(figure("solved_of_seen", shell.solved_share(), "").must(Must::AtLeast(0.98)));
        if shell.body != Some(Body::Torso) {
            report.push(figure("position_rms_without_row_times", without.position_rms_mm(), "mm"));
            report.push(figure("rotation_rms_without_row_times", without.rotation_rms_deg(), "deg"));
            report.push(figure("solved_of_seen_without_row_times", without.solved_share(), ""));
        }
    }
}

fn without_row_times(rig: &Rig) -> Rig {
    let mut rig = rig.clone();
    rig.cameras.iter_mut().for_each(|camera| camera.line_time_s = 0.0);
    rig
}
