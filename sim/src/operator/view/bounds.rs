//! Where in an image something may appear.

use locoman_vision::camera::Camera;
use nalgebra::{Point2, Point3};

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

/// Lens distortion, blur and uneven motion may carry an outline this far out of the projected points.
const SLACK_PX: f64 = 4.0;

impl Bounds {
    const EMPTY: Self =
        Self { left: f64::INFINITY, top: f64::INFINITY, right: f64::NEG_INFINITY, bottom: f64::NEG_INFINITY };

    /// The pixels that balls of one radius around some points may cover; `None` if one is too near.
    pub(super) fn of(
        camera: &Camera,
        points: impl Iterator<Item = Point3<f64>>,
        radius_m: f64,
    ) -> Option<Self> {
        let mut bounds = Self::EMPTY;
        for point in points {
            let center = camera.project(&point)?;
            let near = point.z - radius_m;
            if near <= 0.05 {
                return None;
            }
            // A ball off the axis projects to an ellipse that is longer by its distance from the axis.
            let stretch = point.coords.norm() / point.z;
            let reach = 1.1 * camera.focal_px.max() * radius_m / near * stretch * stretch + SLACK_PX;
            bounds.include(&center, reach);
        }
        Some(bounds)
    }

    /// The pixels that an outline with these corners may cover.
    pub(super) fn around(corners: &[Point2<f64>]) -> Self {
        let mut bounds = Self::EMPTY;
        for corner in corners {
            bounds.include(corner, SLACK_PX);
        }
        bounds
    }

    /// The image's rows among them, the last outside; `None` if there are none.
    pub(super) fn rows(&self, height: usize) -> Option<(usize, usize)> {
        let first = self.top.floor().max(0.0) as usize;
        let end = ((self.bottom.ceil() + 1.0).max(0.0) as usize).min(height);
        (first < end).then_some((first, end))
    }

    fn include(&mut self, center: &Point2<f64>, reach: f64) {
        self.left = self.left.min(center.x - reach);
        self.right = self.right.max(center.x + reach);
        self.top = self.top.min(center.y - reach);
        self.bottom = self.bottom.max(center.y + reach);
    }
}
