//! When each row of a picture is exposed.
//!
//! Capture time is the middle of the exposure of the image's middle row, as in [`Camera::row_delay_s`]. The
//! exposure of each row is cut into slices of time; a global shutter exposes all rows at once.

use locoman_vision::camera::Camera;
use nalgebra::{Point2, Point3};

/// Slices of an exposure.
pub const SLICES: usize = 8;

/// The exposure of one picture.
#[derive(Debug, Clone, Copy)]
pub struct Shutter<'a> {
    /// Whose rows they are.
    pub camera: &'a Camera,
    /// Capture time.
    pub capture_s: f64,
    /// How long each row is exposed.
    pub exposure_s: f64,
}

impl Shutter<'_> {
    /// Middle of the exposure of a row.
    pub fn row_s(&self, y_px: f64) -> f64 {
        self.capture_s + self.camera.row_delay_s(y_px)
    }

    /// Middle of a slice of the exposure of a row.
    pub fn slice_s(&self, y_px: f64, slice: usize) -> f64 {
        let share = (slice as f64 + 0.5) / SLICES as f64 - 0.5;
        self.row_s(y_px) + share * self.exposure_s
    }

    /// Whether all rows are exposed at once.
    pub fn is_global(&self) -> bool {
        self.camera.line_time_s == 0.0
    }

    /// From the first light on any row to the last.
    pub fn span_s(&self) -> (f64, f64) {
        let last_row = f64::from(self.camera.height.saturating_sub(1));
        (self.row_s(0.0) - 0.5 * self.exposure_s, self.row_s(last_row) + 0.5 * self.exposure_s)
    }
}

/// Where a camera sees a moving point: the pixel of the row that is exposed when the point is there, and when.
///
/// `point_at(t_s)` is the point in the camera frame. Solved by iterating time and row, which contracts by the
/// share of a row's time in which the image moves by a row: below 0.1 for anything that a person does.
pub fn seen_by_its_rows(
    camera: &Camera,
    capture_s: f64,
    point_at: impl Fn(f64) -> Point3<f64>,
) -> Option<(Point2<f64>, f64)> {
    const MOST_STEPS: usize = 12;
    /// In time this is below 1e-10 s, in which a point that moves at 10 m/s stays where it is.
    const CONVERGED_PX: f64 = 1e-6;
    let mut t_s = capture_s;
    let mut pixel = camera.project(&point_at(t_s))?;
    if camera.line_time_s == 0.0 {
        return Some((pixel, t_s));
    }
    for _ in 0..MOST_STEPS {
        t_s = capture_s + camera.row_delay_s(pixel.y);
        let next = camera.project(&point_at(t_s))?;
        let step_px = (next.y - pixel.y).abs();
        pixel = next;
        if step_px < CONVERGED_PX {
            break;
        }
    }
    Some((pixel, t_s))
}
