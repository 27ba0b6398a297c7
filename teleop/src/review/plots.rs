//! The plots of a tracked recording, as SVG.

use std::path::Path;

use anyhow::{Context, Result};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::tally::{CameraTally, Tally};

/// Of one panel.
const PANEL_PX: (u32, u32) = (560, 360);
/// Blue, green, orange, magenta, grey, for lines of any plot: told apart by the colour-blind too.
pub const COLOURS: [RGBColor; 5] = [
    RGBColor(0, 114, 178),
    RGBColor(0, 150, 110),
    RGBColor(230, 120, 0),
    RGBColor(204, 70, 140),
    RGBColor(90, 90, 90),
];
const FONT: &str = "sans-serif";

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// One panel a camera: residuals of corners as a cloud, x and y.
pub(super) fn residuals(path: &Path, tally: &Tally, rig: &Rig) -> Result<()> {
    panels(path, rig, &tally.cameras, |panel, id, _, camera| {
        let rms_px = camera.residuals.rms_px();
        let reach = (4.0 * rms_px).max(0.05);
        let caption = format!("{id}: residuals, rms {rms_px:.3} px an axis");
        let mut chart = ChartBuilder::on(panel)
            .caption(caption, (FONT, 15))
            .margin(8)
            .x_label_area_size(26)
            .y_label_area_size(44)
            .build_cartesian_2d(-reach..reach, -reach..reach)?;
        chart.configure_mesh().x_labels(5).y_labels(5).light_line_style(WHITE).draw()?;
        let dots = camera.corners.kept.iter().map(|corner| {
            let [x, y] = corner.residual_px;
            Circle::new((x, y), 1, COLOURS[0].mix(0.35).filled())
        });
        chart.draw_series(dots)?;
        Ok(())
    })
}

/// One panel a camera: where in the image corners were used; the larger the dot, the larger the residual.
pub(super) fn coverage(path: &Path, tally: &Tally, rig: &Rig) -> Result<()> {
    panels(path, rig, &tally.cameras, |panel, id, (width, height), camera| {
        let mut chart = ChartBuilder::on(panel)
            .caption(format!("{id}: corners in the image; orange: beyond three times the RMS"), (FONT, 15))
            .margin(8)
            .x_label_area_size(26)
            .y_label_area_size(44)
            // Down is down.
            .build_cartesian_2d(0.0..width, height..0.0)?;
        chart.configure_mesh().x_labels(6).y_labels(5).light_line_style(WHITE).draw()?;
        let rms_px = camera.residuals.rms_px().max(1e-6);
        let dots = camera.corners.kept.iter().map(|corner| {
            let [x, y] = corner.at_px;
            let off = corner.residual_px[0].hypot(corner.residual_px[1]) / rms_px;
            let colour = if off > 3.0 { COLOURS[2] } else { COLOURS[0] };
            Circle::new((x, y), if off > 3.0 { 2 } else { 1 }, colour.mix(0.5).filled())
        });
        chart.draw_series(dots)?;
        Ok(())
    })
}

/// Over time: residual of each shell's pose, and jumps; and how long the frames of each camera took.
pub(super) fn time(path: &Path, tally: &Tally, shells: &ShellSet) -> Result<()> {
    let (first_ns, last_ns) = tally.span_ns.unwrap_or((0, 0));
    let seconds = |ns: u64| ns.saturating_sub(first_ns) as f64 * 1e-9;
    let end_s = seconds(last_ns).max(1e-3);
    let area = SVGBackend::new(path, (2 * PANEL_PX.0, 2 * PANEL_PX.1)).into_drawing_area();
    area.fill(&WHITE)?;
    let rms = || tally.shells.iter().flat_map(|shell| shell.rms.kept.iter().map(|(_, rms_px)| *rms_px));
    let (above, below) = area.split_vertically(PANEL_PX.1);
    let mut chart = ChartBuilder::on(&above)
        .caption("residual of each pose, px; a cross is a jump", (FONT, 15))
        .margin(8)
        .x_label_area_size(30)
        .y_label_area_size(44)
        .build_cartesian_2d(0.0..end_s, 0.0..1.1 * rms().fold(0.05, f64::max))?;
    chart.configure_mesh().x_desc("s").light_line_style(WHITE).draw()?;
    for (index, (shell, tally)) in shells.shells.iter().zip(&tally.shells).enumerate() {
        let colour = COLOURS[index % COLOURS.len()];
        let dots = tally.rms.kept.iter();
        chart
            .draw_series(dots.map(|(ns, rms_px)| Circle::new((seconds(*ns), *rms_px), 1, colour.filled())))?
            .label(shell.name.clone())
            .legend(move |(x, y)| Circle::new((x + 9, y), 3, colour.filled()));
        let jumps = tally.jumps.iter();
        chart.draw_series(jumps.map(|jump| Cross::new((seconds(jump.time_ns), 0.02), 5, colour.filled())))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .draw()?;
    durations(&below, tally)?;
    area.present().with_context(|| format!("cannot write {}", path.display()))
}

/// For each camera the share of frames that took longer than x.
fn durations(area: &Area<'_>, tally: &Tally) -> Result<()> {
    let sorted: Vec<Vec<f64>> = tally
        .cameras
        .iter()
        .map(|camera| {
            let mut ms: Vec<f64> = camera.detect_ns.kept.iter().map(|ns| *ns as f64 * 1e-6).collect();
            ms.sort_by(f64::total_cmp);
            ms
        })
        .collect();
    let most_ms = sorted.iter().filter_map(|ms| ms.last().copied()).fold(0.1, f64::max);
    let mut chart = ChartBuilder::on(area)
        .caption("share of frames whose reading took longer, one line a camera", (FONT, 15))
        .margin(8)
        .x_label_area_size(30)
        .y_label_area_size(44)
        .build_cartesian_2d(0.0..most_ms, 0.0..1.0)?;
    chart.configure_mesh().x_desc("ms").light_line_style(WHITE).draw()?;
    for (index, ms) in sorted.iter().enumerate() {
        let line = ms.iter().enumerate().map(|(k, ms_k)| (*ms_k, 1.0 - (k + 1) as f64 / ms.len() as f64));
        chart.draw_series(LineSeries::new(line, COLOURS[index % COLOURS.len()].stroke_width(2)))?;
    }
    Ok(())
}

/// One panel a camera, two in a row; the panel's drawing gets id, size and tally.
fn panels(
    path: &Path,
    rig: &Rig,
    cameras: &[CameraTally],
    draw: impl Fn(&Area<'_>, &str, (f64, f64), &CameraTally) -> Result<()>,
) -> Result<()> {
    let rows = cameras.len().div_ceil(2);
    let height_px = PANEL_PX.1 * u32::try_from(rows).unwrap_or(1);
    let area = SVGBackend::new(path, (2 * PANEL_PX.0, height_px)).into_drawing_area();
    area.fill(&WHITE)?;
    for (panel, (camera, tally)) in area.split_evenly((rows, 2)).iter().zip(rig.cameras.iter().zip(cameras)) {
        let size = (f64::from(camera.width), f64::from(camera.height));
        draw(panel, &camera.id, size, tally)?;
    }
    area.present().with_context(|| format!("cannot write {}", path.display()))
}
