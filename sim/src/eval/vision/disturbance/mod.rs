//! What disturbs a station, each with the time that it takes to recover.
//!
//! Hands reach and turn as in `hand.toml` before rolling shutters out of step, 30 images a second; from the third second
//! on something happens. A shell has recovered when it is measured again within 3 mm and 2 degrees; the time counts from the
//! end of the disturbance, or from when the shell can be seen again if that is later, to the last shell. What lasts counts
//! from its begin. Never may a wrong pose be called measured.

mod case;
mod fault;
mod recovery;

use locoman_vision::source::FrameSet;
use locoman_vision::track::TrackUpdate;

use super::film::{Coding, Film, Shot};
use super::stage::Stage;
use super::tally::Tally;
use crate::eval::{Figure, Must, Report};
use crate::operator::sensor::mix;
use case::{Case, Happening};
use recovery::Recovery;

/// Images a second of each camera.
const RATE_HZ: f64 = 30.0;
/// Scene time at which every film begins; nothing disturbs for a second.
const BEGIN_S: f64 = 1.0;
/// Three frames: within these what was lost is to be found again.
const THREE_FRAMES_S: f64 = 3.0 / RATE_HZ;

/// Films all cases whose names hold `only`; adds the figures.
pub fn run(
    stage: &Stage,
    only: &str,
    seed: u64,
    report: &mut Report,
    enter: &mut dyn FnMut(&str, &Tally) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let ids: Vec<String> = stage.rig.cameras.iter().map(|camera| camera.id.clone()).collect();
    for case in case::all(&ids).into_iter().filter(|case| case.name.contains(only)) {
        tracing::info!("{}: {} s", case.name, case.end_s - BEGIN_S);
        let outcome = play(stage, &case, seed)?;
        outcome.report(&case, report);
        enter(case.name, &outcome.tally)?;
    }
    Ok(())
}

/// What became of a case.
struct Outcome {
    tally: Tally,
    /// One for each happening.
    recoveries: Vec<Recovery>,
    bumped: Bumped,
}

fn play(stage: &Stage, case: &Case, seed: u64) -> anyhow::Result<Outcome> {
    let mut scene = stage.studio.scene().clone();
    scene.events = case.events.clone();
    let stage = stage.with_scene(scene)?;
    let film = Film {
        studio: &stage.studio,
        begin_s: BEGIN_S,
        seconds: case.end_s - BEGIN_S,
        rate_hz: RATE_HZ,
        coding: Coding::Jpeg,
    };
    let mut tracker = stage.tracker()?;
    let mut random = mix(seed);
    let mut held: Option<FrameSet> = None;
    let recovery = |of: &Happening| Recovery::new(of.from_s, of.end_s, stage.shells.shells.len());
    let mut outcome = Outcome {
        tally: Tally::new(&stage.shells),
        recoveries: case.happenings.iter().map(recovery).collect(),
        bumped: Bumped::default(),
    };
    film.show(|mut shot| {
        let frames = std::mem::take(&mut shot.frames);
        for set in fault::pass(case.fault_at(shot.time_s), frames, &mut held, &mut random) {
            let update = tracker.update(&set);
            outcome.tally.add(&stage.studio, &shot, &update);
            outcome.recoveries.iter_mut().for_each(|it| it.add(&stage.studio, &shot, &update));
            outcome.bumped.add(case, &shot, &update);
        }
        Ok(())
    })?;
    Ok(outcome)
}

impl Outcome {
    fn report(&self, case: &Case, report: &mut Report) {
        for (happening, recovery) in case.happenings.iter().zip(&self.recoveries) {
            let figure = |what: &str, value: f64, unit| {
                Figure::new(format!("disturbances.{}.{what}", happening.name), value, unit)
            };
            let recovered = figure("recovery", recovery.seconds(), "s");
            let bound = Must::AtMost(THREE_FRAMES_S);
            report.push(if happening.bound { recovered.must(bound) } else { recovered });
            report.push(figure("tracked_of_seen", recovery.tracked_share(), ""));
            report.push(figure("worst_position", 1e3 * recovery.worst_m, "mm"));
        }
        let wrong = Figure::new(
            format!("disturbances.{}.wrong_called_tracked", case.name),
            self.tally.wrong() as f64,
            "",
        );
        report.push(wrong.must(Must::AtMost(0.0)));
        self.bumped.report(case, report);
    }
}

/// What the tracker says of cameras that stand elsewhere than the rig file says, or not.
#[derive(Debug, Default)]
struct Bumped {
    images: usize,
    tags: usize,
    used: usize,
    /// How long after the bump the camera was named first.
    named_s: Option<f64>,
    /// Images of other cameras, or of none that was bumped, that were said to be of a camera that has moved.
    falsely: usize,
}

impl Bumped {
    fn add(&mut self, case: &Case, shot: &Shot, update: &TrackUpdate) {
        let bump = case.events.bump.first().filter(|bump| bump.during_s.holds(shot.time_s));
        for camera in &update.cameras {
            let Some(bump) = bump.filter(|_| camera.camera == case::BUMPED) else {
                self.falsely += usize::from(camera.moved_px.is_some());
                continue;
            };
            self.images += 1;
            self.tags += camera.tags.len();
            self.used += camera.tags.iter().filter(|seen| seen.is_used()).count();
            if camera.moved_px.is_some() {
                self.named_s.get_or_insert(shot.time_s - bump.during_s.begin_s);
            }
        }
    }

    fn report(&self, case: &Case, report: &mut Report) {
        let figure = |what: &str, value: f64, unit| {
            Figure::new(format!("disturbances.{}.{what}", case.name), value, unit)
        };
        report
            .push(figure("images_of_cameras_falsely_named", self.falsely as f64, "").must(Must::AtMost(0.0)));
        if case.events.bump.is_empty() {
            return;
        }
        let named_s = self.named_s.unwrap_or(f64::NAN);
        report.push(figure("noticed_and_named", named_s, "s").must(Must::AtMost(5.0)));
        report.push(figure("tags_an_image", self.tags as f64 / self.images as f64, ""));
        report.push(figure("used_of_its_tags", self.used as f64 / self.tags as f64, ""));
    }
}
