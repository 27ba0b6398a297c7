//! How errors grow with what cannot be reached, and how disturbances die away.

use std::path::Path;

use anyhow::Context;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::targets::Kind;
use super::trial::{self, Case, seconds};
use super::wander;

const SIZE_PX: (u32, u32) = (1200, 1500);
/// Above, of the whole height.
const SCATTER_PX: i32 = 420;
const COLOURS: [RGBColor; 4] =
    [RGBColor(0, 114, 178), RGBColor(0, 150, 110), RGBColor(230, 120, 0), RGBColor(204, 70, 140)];

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Draws a dot for each trajectory above, a line for each disturbed robot below, as SVG.
pub fn draw(
    path: &Path,
    wandered: &[wander::Outcome],
    trials: &[(Case, trial::Outcome)],
) -> anyhow::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let area = SVGBackend::new(path, SIZE_PX).into_drawing_area();
    area.fill(&WHITE)?;
    let (above, below) = area.split_vertically(SCATTER_PX);
    scatter(&above, wandered)?;
    let panels = below.split_evenly((Case::ALL.len().div_ceil(2), 2));
    for (panel, case) in panels.iter().zip(Case::ALL) {
        let of_case: Vec<&trial::Outcome> =
            trials.iter().filter(|(other, _)| *other == case).map(|(_, outcome)| outcome).collect();
        lines(panel, &format!("{}: gripper from its reference, mm", case.name()), &of_case)?;
    }
    area.present().context("the file cannot be written")
}

fn scatter(area: &Area<'_>, wandered: &[wander::Outcome]) -> anyhow::Result<()> {
    let most = |of: fn(&wander::Outcome) -> f64| wandered.iter().map(of).fold(1.0, f64::max);
    let (right, top) = (most(|outcome| outcome.withheld_mm), most(|outcome| outcome.error_mm[1]));
    let mut chart = ChartBuilder::on(area)
        .caption("each trajectory: greatest error of the true gripper, mm", ("sans-serif", 15))
        .margin(6)
        .x_label_area_size(34)
        .y_label_area_size(44)
        .build_cartesian_2d(0.0..1.05 * right, 0.0..1.05 * top)?;
    chart
        .configure_mesh()
        .x_desc("farthest that the limits kept the reference from the trajectory, mm")
        .light_line_style(WHITE)
        .draw()?;
    for (kind, colour) in Kind::ALL.into_iter().zip(COLOURS) {
        let dots = wandered.iter().filter(|outcome| outcome.kind == kind);
        let dots = dots.map(|outcome| {
            Circle::new((outcome.withheld_mm, outcome.error_mm[1]), 2, colour.mix(0.7).filled())
        });
        chart
            .draw_series(dots)?
            .label(kind.name())
            .legend(move |(x, y)| Circle::new((x + 9, y), 3, colour.filled()));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.8))
        .draw()?;
    Ok(())
}

fn lines(area: &Area<'_>, caption: &str, outcomes: &[&trial::Outcome]) -> anyhow::Result<()> {
    let errors = || outcomes.iter().map(|outcome| &outcome.errors_mm[1]);
    let top = errors().flatten().copied().fold(0.0, f64::max);
    let count = errors().map(Vec::len).max().unwrap_or(0);
    if count == 0 || top <= 0.0 {
        return Ok(());
    }
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 15))
        .margin(6)
        .x_label_area_size(22)
        .y_label_area_size(44)
        .build_cartesian_2d(0.0..seconds(count), 0.0..1.05 * top)?;
    chart.configure_mesh().light_line_style(WHITE).y_labels(5).draw()?;
    for (samples, colour) in errors().zip(COLOURS.iter().cycle()) {
        let line = samples.iter().enumerate().step_by(4).map(|(tick, error)| (seconds(tick), *error));
        chart.draw_series(LineSeries::new(line, colour.mix(0.7).stroke_width(1)))?;
    }
    Ok(())
}
