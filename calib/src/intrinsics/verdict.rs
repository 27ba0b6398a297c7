//! What a calibration of a camera is worth, in plain words; and which boards are not what their file says.

use std::fmt::Write;

use nalgebra::Vector3;

use super::IntrinsicsError;
use super::fit::Calibration;
use crate::bundle::{self, FREE, Problem, lens};

/// Refuses a calibration in which the printed tags do not stand as the board file says.
pub(super) fn refuse_wrong_board(
    problem: &Problem,
    calibration: &Calibration,
) -> Result<(), IntrinsicsError> {
    /// More than this share set aside: most of the board is not where it is thought.
    const MOST_OUTLIERS: f64 = 0.3;
    /// A calibration whose errors are larger is not believed, pixels: what bad prints have is a third of it.
    const MOST_RMS_PX: f64 = 1.5;
    /// A ratio that printers and rulers do not get wrong.
    const MOST_RATIO: f64 = 0.004;
    let outcome = &calibration.outcome;
    let share = outcome.outliers as f64 / problem.sightings.len().max(1) as f64;
    let tags = problem.parts.iter().all(|part| part.points.len() == bundle::POINTS);
    if tags {
        // A common scale of the tags against their distances is what a wrong size in the file looks like.
        let mut freed = problem.clone();
        freed.sightings.iter_mut().for_each(|sighting| sighting.outlier = false);
        freed.parts.iter_mut().for_each(|part| part.loose[2] = FREE);
        let rough =
            bundle::Settings { rounds: 1, steps: 15, outlier: f64::INFINITY, ..bundle::Settings::default() };
        let _ = bundle::adjust(&mut freed, &rough, &mut |_, _| {});
        let mut scales: Vec<f64> =
            freed.parts.iter().map(|part| part.scale).filter(|scale| *scale != 1.0).collect();
        scales.sort_by(f64::total_cmp);
        let ratio = scales.get(scales.len() / 2).copied().unwrap_or(1.0);
        if (ratio - 1.0).abs() > MOST_RATIO {
            return Err(IntrinsicsError::WrongSize { ratio, rms_px: outcome.rms_px });
        }
    }
    if share > MOST_OUTLIERS || outcome.rms_px > MOST_RMS_PX {
        return Err(IntrinsicsError::WrongBoard { share, rms_px: outcome.rms_px });
    }
    Ok(())
}

/// Half of the cells' standard deviations that a calibration may have to be called good, pixels.
pub const GOOD_PX: f64 = 0.1;
/// Beyond this a cell is called unsupported, pixels.
pub const SUPPORTED_PX: f64 = 0.3;

/// The verdict: a sentence a line, the judgement first, then what would make it better.
pub fn verdict(calibration: &Calibration) -> String {
    let mut text = String::new();
    let outcome = &calibration.outcome;
    let mut spread: Vec<f64> = calibration.uncertainty_px.clone();
    spread.sort_by(f64::total_cmp);
    let at = |share: f64| spread[((spread.len() - 1) as f64 * share) as usize];
    let word = match at(0.95) {
        px if !outcome.converged || px.is_nan() => "Not finished",
        px if px <= GOOD_PX => "Good",
        px if px <= SUPPORTED_PX => "Usable",
        _ => "Weak at the borders",
    };
    let _ = writeln!(
        text,
        "{word}: {:.3} px RMS over {} views and {} points; projections are known to {:.3} px in the middle of the \
         ranking, {:.3} px in 95 % of the image.",
        outcome.rms_px,
        calibration.views.len(),
        outcome.points,
        at(0.5),
        at(0.95),
    );
    if outcome.outliers > 0 {
        let _ = writeln!(text, "{} tags or points did not fit and were set aside.", outcome.outliers);
    }
    if let Some(places) = uncovered(calibration) {
        let _ = writeln!(text, "No support {places}: hold the board there, near the camera.");
    }
    let tilt_deg = most_tilt_deg(calibration);
    if tilt_deg < 25.0 {
        let _ = writeln!(
            text,
            "The board was tilted by {tilt_deg:.0} degrees at most: tilt it by 30 to 45 degrees, or focal length and \
             distance are hard to tell apart."
        );
    }
    for (name, value, sigma) in parameters(calibration) {
        if name.starts_with('k') && value.abs() < 2.0 * sigma {
            let _ = writeln!(
                text,
                "{name} = {value:.4} is not told from 0 (deviation {sigma:.4}): a smaller model would do."
            );
        }
    }
    text
}

/// Name, value and standard deviation of each fitted intrinsic.
pub fn parameters(calibration: &Calibration) -> Vec<(&'static str, f64, f64)> {
    let sigmas = calibration.outcome.eye_sigmas(0);
    let names = lens::names(&calibration.camera.distortion);
    let count = 4 + calibration.model.coefficients();
    let row = |(k, name): (usize, &&'static str)| {
        (*name, lens::value(&calibration.camera, k), sigmas.get(6 + k).copied().unwrap_or(f64::NAN))
    };
    names.iter().take(count).enumerate().map(row).collect()
}

/// Where projections are not known, in words; `None` if they are everywhere.
fn uncovered(calibration: &Calibration) -> Option<String> {
    let coverage = &calibration.coverage;
    let mut places = Vec::new();
    for (vertical, rows) in
        [("top", 0..coverage.rows / 3), ("bottom", coverage.rows - coverage.rows / 3..coverage.rows)]
    {
        for (side, columns) in [
            ("left", 0..coverage.columns / 3),
            ("right", coverage.columns - coverage.columns / 3..coverage.columns),
        ] {
            let cells = rows.clone().flat_map(|row| columns.clone().map(move |column| (row, column)));
            let worst = cells
                .map(|(row, column)| calibration.uncertainty_px[row * coverage.columns + column])
                .fold(0.0, f64::max);
            if worst > SUPPORTED_PX {
                places.push(format!("{vertical} {side} ({worst:.1} px)"));
            }
        }
    }
    (!places.is_empty()).then(|| places.join(", "))
}

fn most_tilt_deg(calibration: &Calibration) -> f64 {
    let tilt = |view: &super::ViewResult| {
        let normal = view.camera_from_target.rotation * Vector3::z();
        let sight = -view.camera_from_target.translation.vector;
        normal.angle(&sight).to_degrees()
    };
    calibration.views.iter().map(tilt).fold(0.0, f64::max)
}
