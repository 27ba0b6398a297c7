//! Where in an image something may appear.

use locoman_vision::camera::Camera;
use nalgebra::Point3;

/// A pixel rectangle: columns from `left` to `right`, rows from `top` to `bottom`, both inclusive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Leftmost column.
    pub left: f64,
    /// Topmost row.
    pub top: f64,
    /// Rightmost column.
    pub right: f64,
    /// Lowest row.
    pub bottom: f64,
}

impl Bounds {
    /// The pixels that balls of one radius around some points may cover; `None` if one is too near.
    pub(super) fn of(
        camera: &Camera,
        points: impl Iterator<Item = Point3<f64>>,
        radius_m: f64,
    ) -> Option<Self> {
        /// Lens distortion and blur may carry an outline this far out of the projected points.
        const SLACK_PX: f64 = 4.0;
        let mut bounds = Self {
            left: f64::INFINITY,
            top: f64::INFINITY,
            right: f64::NEG_INFINITY,
            bottom: f64::NEG_INFINITY,
        };
        for point in points {
            let center = camera.project(&point)?;
            let near = point.z - radius_m;
            if near <= 0.05 {
                return None;
            }
            // A ball off the axis projects to an ellipse that is longer by its distance from the axis.
            let stretch = point.coords.norm() / point.z;
            let reach = 1.1 * camera.focal_px.max() * radius_m / near * stretch * stretch + SLACK_PX;
            bounds.left = bounds.left.min(center.x - reach);
            bounds.right = bounds.right.max(center.x + reach);
            bounds.top = bounds.top.min(center.y - reach);
            bounds.bottom = bounds.bottom.max(center.y + reach);
        }
        Some(bounds)
    }
}
