//! Errors of the gripper's orientation over time.

use std::path::Path;

use anyhow::Context;
use plotters::prelude::*;

use super::pointing::{Outcome, seconds};

const SIZE_PX: (u32, u32) = (1000, 420);

/// Draws a line for each task, as SVG.
pub fn draw(path: &Path, shown: &[(&str, Outcome)]) -> anyhow::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let area = SVGBackend::new(path, SIZE_PX).into_drawing_area();
    area.fill(&WHITE)?;
    let count = shown.iter().map(|(_, outcome)| outcome.errors_rad.len()).max().unwrap_or(1).max(1);
    let top = shown.iter().map(|(_, outcome)| outcome.greatest_rad()).fold(1e-3, f64::max);
    let mut chart = ChartBuilder::on(&area)
        .caption("gripper's orientation in the world while trotting: error, rad", ("sans-serif", 16))
        .margin(8)
        .x_label_area_size(34)
        .y_label_area_size(50)
        .build_cartesian_2d(0.0..seconds(count), 0.0..1.05 * top)?;
    chart.configure_mesh().x_desc("s").light_line_style(WHITE).draw()?;
    for ((name, outcome), colour) in shown.iter().zip(locoman_teleop::review::COLOURS.iter().cycle()) {
        let line =
            outcome.errors_rad.iter().enumerate().step_by(4).map(|(tick, error)| (seconds(tick), *error));
        chart
            .draw_series(LineSeries::new(line, colour.stroke_width(1)))?
            .label(*name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour));
    }
    chart.configure_series_labels().background_style(WHITE.mix(0.8)).draw()?;
    area.present().context("the file cannot be written")
}
