//! The standard scene: what the demo's operator does, seen by cameras that are exposed together.
//!
//! Two passages are rendered and JPEG-coded as for a recording, then tracked, each from a cold start. An instant counts
//! as seen if at least two cameras have a readable tag of the shell before them, by the renderer's own geometry.

use std::time::Instant as Clock;

use super::film::{Coding, Film};
use super::stage::Stage;
use super::tags::TagTally;
use super::tally::{ShellTally, Tally};
use crate::eval::{Figure, Must, Report};

/// Images a second of each camera.
const RATE_HZ: f64 = 30.0;
/// Begin and length in seconds of scene time: all six axes with an opening thumb; then the fastest steps.
const PASSAGES: [(f64, f64); 2] = [(2.5, 3.0), (11.0, 3.0)];

/// Tracks both passages; adds the figures.
pub fn run(stage: &Stage, report: &mut Report) -> anyhow::Result<Tally> {
    let (mut tally, mut tags) = (Tally::new(&stage.shells), TagTally::default());
    let (mut updates, mut busy_s) = (0, 0.0);
    for (begin_s, seconds) in PASSAGES {
        let film = Film { studio: &stage.studio, begin_s, seconds, rate_hz: RATE_HZ, coding: Coding::Jpeg };
        let mut tracker = stage.tracker()?;
        film.show(|shot| {
            let begun = Clock::now();
            let update = tracker.update(&shot.frames);
            busy_s += begun.elapsed().as_secs_f64();
            updates += 1;
            tally.add(&stage.studio, &shot, &update);
            tags.add(&stage.studio, &stage.rig, &stage.shells, &shot, &update);
            Ok(())
        })?;
    }
    for shell in &tally.shells {
        shell_figures(shell, report);
    }
    let figure = |what: &str, value: f64, unit| Figure::new(format!("standard.{what}"), value, unit);
    report.push(figure("tags.false_accepted", tags.false_accepted as f64, "").must(Must::AtMost(0.0)));
    report.push(figure("tags.read_of_readable", tags.read_share(), ""));
    let (large_px, small_px) = tags.corner_rms_px();
    report.push(
        figure("tags.corner_rms_30px_up", large_px, "px")
            .reference(0.055, "static tags of 40 to 60 px in a TagSLAM test recording, real cameras"),
    );
    report.push(figure("tags.corner_rms_16_to_30px", small_px, "px"));
    // Wall time of a machine that may be busy: a figure to compare within one run, hence without a bound.
    report.push(figure("tracker.updates_per_s", f64::from(updates) / busy_s, "Hz"));
    Ok(tally)
}

/// What is asked of each shell, beside the best published tracker of a tag-covered body.
fn shell_figures(shell: &ShellTally, report: &mut Report) {
    let figure = |what: &str, value: f64, unit: &'static str| {
        Figure::new(format!("standard.{}.{what}", shell.name), value, unit)
    };
    report.push(
        figure("position_rms", shell.position_rms_mm(), "mm")
            .must(Must::AtMost(1.0))
            .reference(0.4, "DodecaPen, UIST 2017: one camera, one pen"),
    );
    report.push(
        figure("rotation_rms", shell.rotation_rms_deg(), "deg")
            .must(Must::AtMost(0.5))
            .reference(0.35, "mono dodecahedron, Sensors 2026, 0.3 to 0.7 m, static"),
    );
    report.push(figure("position_worst", shell.position_worst_mm(), "mm"));
    report.push(figure("solved_of_seen", shell.solved_share(), "").must(Must::AtLeast(0.98)));
    report.push(figure("seen_of_all", shell.seen_share(), ""));
    report.push(figure("normalized_error", shell.normalized_error(), ""));
}
