//! `vision`: poses that the tracker finds in rendered images, against the truth of the renderer.
//!
//! Two passages of the standard scene are rendered and JPEG-coded as for a recording, then tracked offline,
//! each from a cold start. A pose counts if the tracker calls it measured (`Tracked`); an instant counts as
//! seen if at least two cameras have a readable tag of the shell before them, by the renderer's own geometry.

mod measure;
mod passage;
mod plot;

use std::path::Path;

use anyhow::Context;
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use locoman_vision::track::{Tracker, TrackerSettings};

use super::{Figure, Must, Report};
use crate::operator::Inputs;
use measure::{Outcome, ShellOutcome};
use passage::Passage;

/// Images a second of each camera.
const RATE_HZ: f64 = 30.0;
/// Begin and length in seconds of scene time: all six axes with an opening thumb; then the fastest steps.
const PASSAGES: [(f64, f64); 2] = [(2.5, 3.0), (11.0, 3.0)];

/// Runs the experiment; draws errors over time to `plot`.
pub fn run(configs: &Path, seed: u64, plot: Option<&Path>) -> anyhow::Result<Report> {
    let inputs = Inputs::standard(configs);
    let (rig, shells) = (Rig::load(&inputs.rig)?, ShellSet::load(&inputs.shells)?);
    let studio = inputs.studio(seed)?;
    let mut outcome = Outcome::new(&shells);
    for (begin_s, seconds) in PASSAGES {
        tracing::info!("rendering and tracking {seconds} s from {begin_s} s of the scene");
        let passage = Passage::render(&studio, begin_s, seconds, RATE_HZ)?;
        let mut tracker = Tracker::new(rig.clone(), shells.clone(), TrackerSettings::default())?;
        outcome.track(&mut tracker, passage);
    }
    if let Some(path) = plot {
        plot::draw(path, &outcome).with_context(|| format!("cannot draw {}", path.display()))?;
        tracing::info!("errors over time: {}", path.display());
    }
    Ok(report(&outcome, seed))
}

fn report(outcome: &Outcome, seed: u64) -> Report {
    let mut report = Report::new("vision", seed);
    for shell in &outcome.shells {
        shell_figures(shell, &mut report);
    }
    report
        .push(Figure::new("tags.false_accepted", outcome.false_accepted as f64, "").must(Must::AtMost(0.0)));
    report.push(Figure::new("tags.read_of_readable", outcome.read_share(), ""));
    let (large_px, small_px) = outcome.corner_rms_px();
    report.push(
        Figure::new("tags.corner_rms_30px_up", large_px, "px")
            .reference(0.055, "static tags of 40 to 60 px in a TagSLAM test recording, real cameras"),
    );
    report.push(Figure::new("tags.corner_rms_16_to_30px", small_px, "px"));
    // Wall time of a machine that may be busy: a figure to compare within one run, hence without a bound.
    report.push(Figure::new("tracker.updates_per_s", outcome.updates_per_s(), "Hz"));
    report
}

/// What the issue asks of each shell, beside the best published tracker of a tag-covered body.
fn shell_figures(shell: &ShellOutcome, report: &mut Report) {
    let figure = |what: &str, value: f64, unit: &'static str| {
        Figure::new(format!("{}.{what}", shell.name), value, unit)
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
