//! Errors of all shells over time.

use std::path::Path;

use anyhow::Context;
use locoman_teleop::review::COLOURS;
use plotters::prelude::*;

use super::error::PoseError;
use super::tally::{ShellTally, Tally};

const SIZE_PX: (u32, u32) = (1000, 640);
/// Longer pauses than this are gaps in a line.
const GAP_S: f64 = 0.2;

/// Draws position errors above, rotation errors below, as SVG.
pub fn draw(path: &Path, tally: &Tally) -> anyhow::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let area = SVGBackend::new(path, SIZE_PX).into_drawing_area();
    area.fill(&WHITE)?;
    let (above, below) = area.split_vertically(SIZE_PX.1 / 2);
    panel(&above, tally, "position error, mm", |error| 1e3 * error.position_m.norm())?;
    panel(&below, tally, "rotation error, deg", |error| error.rotation_rad.norm().to_degrees())?;
    area.present().context("the file cannot be written")
}

fn panel(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    tally: &Tally,
    caption: &str,
    value: impl Fn(&PoseError) -> f64,
) -> anyhow::Result<()> {
    let errors = || tally.shells.iter().flat_map(|shell| &shell.errors);
    let times = || errors().map(|error| error.time_s);
    let begin_s = times().fold(f64::INFINITY, f64::min);
    let end_s = times().fold(f64::NEG_INFINITY, f64::max);
    let top = errors().map(&value).fold(0.0, f64::max);
    if !(begin_s < end_s && top > 0.0) {
        return Ok(());
    }
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 18))
        .margin(8)
        .x_label_area_size(32)
        .y_label_area_size(48)
        .build_cartesian_2d(begin_s..end_s, 0.0..1.05 * top)?;
    chart.configure_mesh().x_desc("time of the scene, s").light_line_style(WHITE).draw()?;
    for (shell, colour) in tally.shells.iter().zip(COLOURS.iter().cycle()) {
        for (i, line) in stretches(shell).enumerate() {
            let points = line.iter().map(|error| (error.time_s, value(error)));
            let drawn = chart.draw_series(LineSeries::new(points, colour.stroke_width(1)))?;
            if i == 0 {
                let sample = move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2));
                drawn.label(&shell.name).legend(sample);
            }
        }
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperMiddle)
        .background_style(WHITE.mix(0.8))
        .draw()?;
    Ok(())
}

/// Errors without long pauses between them, and without steps back in time: another film begins there.
fn stretches(shell: &ShellTally) -> impl Iterator<Item = &[PoseError]> {
    shell.errors.chunk_by(|a, b| (0.0..GAP_S).contains(&(b.time_s - a.time_s)))
}
