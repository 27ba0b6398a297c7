//! A picture of a calibration: where points were seen, how well projections are known, how large errors are.

use std::path::Path;

use plotters::prelude::*;

use super::fit::Calibration;
use super::verdict::SUPPORTED_PX;
use super::view::View;
use crate::bundle::Part;

/// Draws an SVG, whole or not at all. `views` and `target` are those of the calibration.
///
/// Cells of the image are green where projections are known, yellow towards [`SUPPORTED_PX`], and crossed out in red
/// where the calibration is not supported; dots are points; bars below are the views' errors.
pub fn draw(
    path: &Path,
    calibration: &Calibration,
    views: &[View],
    target: &[Part],
) -> Result<(), PlotError> {
    let mut text = String::new();
    render(&mut text, calibration, views, target).map_err(|error| PlotError::Draw(error.to_string()))?;
    crate::file::write_whole(path, &text).map_err(|source| PlotError::Write { path: path.to_owned(), source })
}

/// A picture that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// It cannot be drawn.
    #[error("the plot cannot be drawn: {0}")]
    Draw(String),
    /// It cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: std::path::PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

fn render(
    text: &mut String,
    calibration: &Calibration,
    views: &[View],
    target: &[Part],
) -> Result<(), Box<dyn std::error::Error>> {
    const WIDTH: u32 = 900;
    const BARS: u32 = 220;
    let (width, height) = (f64::from(calibration.camera.width), f64::from(calibration.camera.height));
    let image = (f64::from(WIDTH) * height / width) as u32 + 60;
    let root = SVGBackend::with_string(text, (WIDTH, image + BARS)).into_drawing_area();
    root.fill(&WHITE)?;
    let (above, below) = root.split_vertically(image);
    let title = format!(
        "{}: {:.3} px RMS, {} views; red: not supported",
        calibration.camera.id,
        calibration.outcome.rms_px,
        calibration.views.len()
    );
    let mut chart = ChartBuilder::on(&above)
        .caption(title, ("sans-serif", 18))
        .margin(8)
        .x_label_area_size(20)
        .y_label_area_size(36)
        .build_cartesian_2d(0.0..width, height..0.0)?;
    chart.configure_mesh().disable_mesh().draw()?;
    let half = calibration.coverage.cell_px / 2.0;
    for (cell, sigma_px) in calibration.coverage.cells.iter().zip(&calibration.uncertainty_px) {
        let (x, y) = (cell.center_px.x, cell.center_px.y);
        let corners = [(x - half.x, y - half.y), (x + half.x, y + half.y)];
        let doubt = (sigma_px / SUPPORTED_PX).min(1.0);
        let shade = RGBColor((120.0 + 130.0 * doubt) as u8, (220.0 - 20.0 * doubt) as u8, 130);
        chart.draw_series(std::iter::once(Rectangle::new(corners, shade.mix(0.6).filled())))?;
        if *sigma_px > SUPPORTED_PX {
            let lines = [corners, [(x - half.x, y + half.y), (x + half.x, y - half.y)]];
            chart.draw_series(lines.map(|line| PathElement::new(line.to_vec(), RED)))?;
        }
    }
    for result in &calibration.views {
        let points = views.get(result.view).into_iter().flat_map(|view| view.points(target));
        chart.draw_series(points.map(|(_, pixel)| Circle::new((pixel.x, pixel.y), 1, BLUE.filled())))?;
    }
    let worst = calibration.views.iter().map(|view| view.rms_px).fold(0.0, f64::max);
    let count = calibration.views.len();
    let mut bars = ChartBuilder::on(&below)
        .caption("errors of each view, px RMS", ("sans-serif", 14))
        .margin(8)
        .x_label_area_size(20)
        .y_label_area_size(36)
        .build_cartesian_2d(0.0..count as f64, 0.0..worst.max(0.01) * 1.1)?;
    bars.configure_mesh().disable_x_mesh().draw()?;
    bars.draw_series(calibration.views.iter().enumerate().map(|(k, view)| {
        let k = k as f64;
        Rectangle::new([(k + 0.1, 0.0), (k + 0.9, view.rms_px)], BLUE.mix(0.6).filled())
    }))?;
    root.present()?;
    Ok(())
}
