//! The lens, tabulated: the ideal image coordinates (x/z, y/z) that each pixel sees.
//!
//! Edges of a tag are straight in the ideal image only. Rays are kept at every fourth pixel and interpolated
//! linearly: over four pixels the lens of a webcam bends by less than a thousandth of a pixel.

use nalgebra::Point2;

use crate::camera::Camera;
use crate::vector::{LANES, Vector};

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

    /// The rays of eight pixels of the image.
    #[inline(always)]
    pub fn at<V: Vector>(&self, x: V, y: V) -> [V; 2] {
        let per_step = V::splat(1.0 / STEP as f32);
        let (x, y) = (x * per_step, y * per_step);
        let (left, upper) = (x.floor(), y.floor());
        let first = upper.times_plus(V::splat(self.columns as f32), left).whole();
        // The nodes round each pixel: x and y of the upper left one, the upper right one, …
        let mut nodes = [[0.0; LANES]; 8];
        for lane in 0..LANES {
            let first = first[lane] as usize;
            let above = &self.nodes[first..first + 2];
            let below = &self.nodes[first + self.columns..first + self.columns + 2];
            [nodes[0][lane], nodes[1][lane]] = above[0];
            [nodes[2][lane], nodes[3][lane]] = above[1];
            [nodes[4][lane], nodes[5][lane]] = below[0];
            [nodes[6][lane], nodes[7][lane]] = below[1];
        }
        let (share_x, share_y) = (x - left, y - upper);
        let [ax, ay, bx, by, cx, cy, dx, dy] = nodes;
        [between([ax, bx, cx, dx], share_x, share_y), between([ay, by, cy, dy], share_x, share_y)]
    }
}

/// Between the upper left, upper right, lower left and lower right.
#[inline(always)]
fn between<V: Vector>([a, b, c, d]: [[f32; LANES]; 4], share_x: V, share_y: V) -> V {
    let (a, c) = (V::new(a), V::new(c));
    let upper = share_x.times_plus(V::new(b) - a, a);
    let lower = share_x.times_plus(V::new(d) - c, c);
    share_y.times_plus(lower - upper, upper)
}

#[cfg(test)]
mod tests {
    use wide::f32x8;

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
                let ray = sut.at(f32x8::splat(x as f32), f32x8::splat(y as f32));
                let ray = ray.map(|all| f64::from(all.to_array()[0]));
                let exact = camera.unproject(&Point2::new(f64::from(x), f64::from(y)));
                let error = (ray[0] - exact.x).hypot(ray[1] - exact.y);
                assert!(error * camera.focal_px.x < TOLERANCE_PX, "{error}");
            }
        }
    }
}
