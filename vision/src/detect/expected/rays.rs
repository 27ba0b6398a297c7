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

    /// The rays of the pixels `first..first + out.len()` of a row of the image.
    pub fn row(&self, y: usize, first: usize, out: &mut [[f32; 2]]) {
        let (above, share_y) = (y / STEP, (y % STEP) as f32 / STEP as f32);
        let node = |i: usize| {
            let a = self.nodes[above * self.columns + i];
            let b = self.nodes[(above + 1) * self.columns + i];
            [a[0] + share_y * (b[0] - a[0]), a[1] + share_y * (b[1] - a[1])]
        };
        let mut left = first / STEP;
        let (mut a, mut b) = (node(left), node(left + 1));
        for (k, ray) in out.iter_mut().enumerate() {
            let x = first + k;
            if x / STEP != left {
                left = x / STEP;
                (a, b) = (b, node(left + 1));
            }
            let share = (x % STEP) as f32 / STEP as f32;
            *ray = [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];
        }
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
        let mut rays = [[0.0; 2]; 100];
        for y in [0, 1, 357, 719] {
            for first in [0, 3, 600, 1180] {
                sut.row(y, first, &mut rays);
                for (k, ray) in rays.iter().enumerate() {
                    let exact = camera.unproject(&Point2::new((first + k) as f64, y as f64));
                    let error = (f64::from(ray[0]) - exact.x).hypot(f64::from(ray[1]) - exact.y);
                    assert!(error * camera.focal_px.x < TOLERANCE_PX, "{error}");
                }
            }
        }
    }
}
