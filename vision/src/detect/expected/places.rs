//! Where cells of a tag lie in the image: good to a tenth of a pixel, for choosing pixels; eight at a time.
//!
//! The homography is exact, the lens is its Taylor series of second order about the tag's middle. What is measured
//! goes the other way, from the pixel that was chosen to its ray ([`super::rays`]), and is exact.

use nalgebra::{Matrix2, Matrix3, Point2, Vector2};
use wide::f32x8;

use crate::camera::Camera;
use crate::image::GrayImage;
use crate::vector::{LANES, Vector};

/// Local coordinates of the ideal image round a tag: origin at its middle, unit half its side.
#[derive(Debug, Clone, Copy)]
pub struct Local {
    /// The origin in the ideal image.
    pub origin: Vector2<f64>,
    /// The unit there.
    pub unit: f64,
    /// Derivative of the pixel by local coordinates.
    pub px_by_local: Matrix2<f64>,
    /// Coefficients of 1, x, y, x², xy, y² for both axes of the image.
    series: [[f32; 6]; 2],
}

/// From cells to pixels.
#[derive(Debug, Clone, Copy)]
pub struct Places {
    local_from_cells: [f32; 9],
    series: [[f32; 6]; 2],
}

impl Local {
    /// About a point of the ideal image.
    pub fn new(camera: &Camera, origin: Vector2<f64>, unit: f64) -> Self {
        let at = |x: f64, y: f64| {
            let (pixel, by_ideal) = camera.pixel_of_ideal_with_jacobian(origin + Vector2::new(x, y) * unit);
            (pixel, by_ideal * unit)
        };
        /// Where the derivative is compared with that of the middle.
        const ASIDE: f64 = 0.5;
        let (middle_px, px_by_local) = at(0.0, 0.0);
        let by_x = (at(ASIDE, 0.0).1 - px_by_local) / ASIDE;
        let by_y = (at(0.0, ASIDE).1 - px_by_local) / ASIDE;
        let series = [0, 1].map(|axis| {
            [
                middle_px[axis],
                px_by_local[(axis, 0)],
                px_by_local[(axis, 1)],
                0.5 * by_x[(axis, 0)],
                0.5 * (by_x[(axis, 1)] + by_y[(axis, 0)]),
                0.5 * by_y[(axis, 1)],
            ]
            .map(|number| number as f32)
        });
        Self { origin, unit, px_by_local, series }
    }

    /// The places of a tag that lies thus in local coordinates.
    pub fn places(&self, local_from_cells: &Matrix3<f64>) -> Places {
        let local_from_cells = std::array::from_fn(|k| local_from_cells[(k / 3, k % 3)] as f32);
        Places { local_from_cells, series: self.series }
    }
}

impl Places {
    /// Pixels of eight cell coordinates.
    #[inline(always)]
    pub fn pixels<V: Vector>(&self, u: V, v: V) -> [V; 2] {
        let (x, y) = mapped(&self.local_from_cells, u, v);
        [series(&self.series[0], x, y), series(&self.series[1], x, y)]
    }

    /// The pixel of one cell coordinate.
    pub fn pixel(&self, u: f64, v: f64) -> Point2<f64> {
        let [x, y] = self.pixels(f32x8::splat(u as f32), f32x8::splat(v as f32));
        Point2::new(f64::from(x.to_array()[0]), f64::from(y.to_array()[0]))
    }
}

/// (x, y) mapped by a homography, given by rows.
#[inline(always)]
pub fn mapped<V: Vector>(h: &[f32; 9], x: V, y: V) -> (V, V) {
    let inv_w = V::splat(1.0) / plane(h[6], h[7], h[8], x, y);
    (plane(h[0], h[1], h[2], x, y) * inv_w, plane(h[3], h[4], h[5], x, y) * inv_w)
}

/// a x + b y + c.
#[inline(always)]
pub fn plane<V: Vector>(a: f32, b: f32, c: f32, x: V, y: V) -> V {
    V::splat(a).times_plus(x, V::splat(b).times_plus(y, V::splat(c)))
}

/// See [`Local::series`].
#[inline(always)]
fn series<V: Vector>(c: &[f32; 6], x: V, y: V) -> V {
    let of_x = plane(c[3], c[4], c[1], x, y);
    let of_y = y.times_plus(V::splat(c[5]), V::splat(c[2]));
    x.times_plus(of_x, y.times_plus(of_y, V::splat(c[0])))
}

/// The nearest column or row of an image of so many.
#[inline(always)]
pub fn nearest<V: Vector>(place: V, size: u32) -> V {
    // What is cut off is rounded that way, since it is not negative.
    (place.bounded(0.0, size as f32 - 1.0) + V::splat(0.5)).floor()
}

/// Grey levels of the nearest pixels.
#[inline(always)]
pub fn greys<V: Vector>(image: &GrayImage, [x, y]: [V; 2]) -> [u8; LANES] {
    let (columns, rows) = (nearest(x, image.width()).whole(), nearest(y, image.height()).whole());
    let width = image.width() as i32;
    let mut greys = [0; LANES];
    for lane in 0..LANES {
        greys[lane] = image.data()[(rows[lane] * width + columns[lane]) as usize];
    }
    greys
}
