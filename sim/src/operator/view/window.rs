//! Which rays may hit something: a cheap question before the dear one.

use nalgebra::Point3;

use crate::operator::lens::Ray;

/// A rectangle of rays (x, y, 1) of the camera's frame, outside which nothing is hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Window {
    left: f32,
    right: f32,
    top: f32,
    bottom: f32,
}

/// Nothing nearer than this has a window: all rays may hit it.
const NEAR_M: f64 = 0.02;
/// Room for rounding: a tenth of a pixel.
const SLACK: f64 = 1e-4;

impl Window {
    const ALL: Self =
        Self { left: f32::NEG_INFINITY, right: f32::INFINITY, top: f32::NEG_INFINITY, bottom: f32::INFINITY };
    const NONE: Self =
        Self { left: f32::INFINITY, right: f32::NEG_INFINITY, top: f32::INFINITY, bottom: f32::NEG_INFINITY };

    /// Of what lies between some points.
    pub(super) fn of_points<'a>(points: impl Iterator<Item = &'a Point3<f64>>) -> Self {
        Self::of_balls(points.copied(), 0.0)
    }

    /// Of what lies between some balls of one radius.
    pub(super) fn of_balls(centers: impl Iterator<Item = Point3<f64>>, radius_m: f64) -> Self {
        let mut window = Self::NONE;
        for center in centers {
            if center.z - radius_m < NEAR_M {
                return Self::ALL;
            }
            // The ball's silhouette seen along y, and along x: tangents to a circle.
            let extent = |across: f64| {
                let middle = across.atan2(center.z);
                let half = (radius_m / across.hypot(center.z)).asin();
                ((middle - half).tan() - SLACK, (middle + half).tan() + SLACK)
            };
            let (left, right) = extent(center.x);
            let (top, bottom) = extent(center.y);
            window.left = window.left.min(left as f32);
            window.right = window.right.max(right as f32);
            window.top = window.top.min(top as f32);
            window.bottom = window.bottom.max(bottom as f32);
        }
        window
    }

    /// Whether a ray is inside.
    #[inline]
    pub(super) fn holds(&self, [x, y]: Ray) -> bool {
        x >= self.left && x <= self.right && y >= self.top && y <= self.bottom
    }

    /// Of a pixel with these corners.
    pub(super) fn of_rays(corners: &[Ray; 4]) -> Self {
        let mut window = Self::NONE;
        for [x, y] in corners {
            window.left = window.left.min(*x);
            window.right = window.right.max(*x);
            window.top = window.top.min(*y);
            window.bottom = window.bottom.max(*y);
        }
        window
    }

    /// Whether the two have a ray in common.
    #[inline]
    pub(super) fn meets(&self, other: &Self) -> bool {
        self.left <= other.right
            && other.left <= self.right
            && self.top <= other.bottom
            && other.top <= self.bottom
    }
}
