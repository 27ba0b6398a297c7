//! The lens, tabulated: the ideal image coordinates (x/z, y/z) that each pixel sees.
//!
//! Edges of a tag are straight in the ideal image only. Rays are kept at every fourth pixel and interpolated
//! linearly: over four pixels the lens of a webcam bends by less than a thousandth of a pixel.

use nalgebra::Point2;

use crate::camera::Camera;

/// Distance of the nodes, pixels.
const STEP: usize = 4;

/// Rays of all pixels of one camera.
#[derive(Debug, Clone)]
pub struct RayGrid {
    columns: usize,
    nodes: Vec<[f32; 2]>,
}

impl RayGrid {
    /// Tabulates a camera.
    pub fn new(camera: &Camera) -> Self {
        let count = |pixels: u32| pixels as usize / STEP + 2;
        let (columns, rows) = (count(camera.width), count(camera.height));
        let node = |at: usize| {
            let pixel = Point2::new((at % columns * STEP) as f64, (at / columns * STEP) as f64);
            let ray = camera.unproject(&pixel);
            [ray.x as f32, ray.y as f32]
        };
        Self { columns, nodes: (0..columns * rows).map(node).collect() }
    }

    /// The rays of one row of the image.
    pub fn row(&self, y: usize) -> RayRow<'_> {
        let first = y / STEP * self.columns;
        RayRow {
            above: &self.nodes[first..first + self.columns],
            below: &self.nodes[first + self.columns..first + 2 * self.columns],
            share: (y % STEP) as f32 / STEP as f32,
        }
    }
}

/// Rays of one row of pixels.
#[derive(Debug, Clone, Copy)]
pub struct RayRow<'a> {
    above: &'a [[f32; 2]],
    below: &'a [[f32; 2]],
    share: f32,
}

impl RayRow<'_> {
    /// The ray of a pixel of the row.
    #[inline]
    pub fn at(&self, x: usize) -> [f32; 2] {
        let (left, share) = (x / STEP, (x % STEP) as f32 / STEP as f32);
        let (a, b) = (self.above[left], self.above[left + 1]);
        let (c, d) = (self.below[left], self.below[left + 1]);
        std::array::from_fn(|axis| {
            let upper = a[axis] + share * (b[axis] - a[axis]);
            let lower = c[axis] + share * (d[axis] - c[axis]);
            upper + self.share * (lower - upper)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn tabulated_rays_are_those_of_the_lens() {
        /// In pixels.
        const TOLERANCE_PX: f64 = 1e-3;
        let camera = &testing::rig().cameras[0];
        let sut = RayGrid::new(camera);
        for y in [0, 1, 357, 719] {
            for x in (0..1280).step_by(7) {
                let ray = sut.row(y).at(x);
                let exact = camera.unproject(&Point2::new(x as f64, y as f64));
                let error = (f64::from(ray[0]) - exact.x).hypot(f64::from(ray[1]) - exact.y);
                assert!(error * camera.focal_px.x < TOLERANCE_PX, "{error}");
            }
        }
    }
}
