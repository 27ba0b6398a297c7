//! A tag that turns while a rolling shutter reads its rows: its edges are bent.
//!
//! A row is exposed t after the one that sees the tag's middle, and t grows with the row. A steady motion of the whole tag
//! only shears its image, which a homography can do. But what lies beside the middle moves otherwise than the middle, by
//! the gradient F of the image's velocity, and is found displaced by
//!
//! ```text
//! δ(x) = t(x) F x        x: local coordinates, t(x) = (time of a row) · (rows from the middle to x)
//! ```
//!
//! which is quadratic in x: at 360 deg/s before rows of 26 us, half a pixel at the corners of a tag of 80 pixels, and what is
//! left of it if a homography is fitted nevertheless is a tenth of a pixel, of the tag as a whole. So pixels are
//! measured where they would be without it, and the corners put back. An error of the predicted motion of one percent is
//! one of a thousandth of a pixel.

use nalgebra::{Matrix2, Matrix3, RowVector2, Vector2, Vector3};

use super::places::Local;
use crate::camera::Camera;
use crate::vector::Vector;

/// How the rows of a rolling shutter bend the image of a tag, in its local coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Bend {
    /// Time of a row after the middle's by local coordinates, seconds.
    time: RowVector2<f64>,
    /// F, 1/s.
    gradient: Matrix2<f64>,
}

impl Bend {
    /// Of a tag whose ideal image moves at such a rate: see [`super::Expectation::ideal_rate`].
    pub fn new(camera: &Camera, local: &Local, rate: &Matrix3<f64>) -> Self {
        let middle = Vector3::new(local.origin.x, local.origin.y, 1.0);
        // ẋ = (M x)₁₂ − x (M x)₃, by x.
        let away = (rate * middle).z;
        let gradient = Matrix2::from_fn(|i, j| {
            rate[(i, j)] - middle[i] * rate[(2, j)] - if i == j { away } else { 0.0 }
        });
        Self { time: local.px_by_local.row(1) * camera.line_time_s, gradient }
    }

    /// Where the rows show what would be seen at local coordinates if all were exposed at once.
    pub fn bent(&self, straight: Vector2<f64>) -> Vector2<f64> {
        // Displaced by what holds where it is displaced to: the next round would change it by a percent of a percent.
        let near = straight + self.displacement(straight);
        straight + self.displacement(near)
    }

    fn displacement(&self, seen: Vector2<f64>) -> Vector2<f64> {
        self.gradient * seen * (self.time * seen).x
    }

    /// The way back for eight pixels, where an image is bent at all.
    #[inline(always)]
    pub fn straightened<V: Vector>(&self, x: V, y: V) -> (V, V) {
        let splat = |number: f64| V::splat(number as f32);
        let sum = |a: f64, b: f64| x.times_plus(splat(a), y * splat(b));
        let earlier = sum(-self.time.x, -self.time.y);
        let f = &self.gradient;
        (earlier.times_plus(sum(f.m11, f.m12), x), earlier.times_plus(sum(f.m21, f.m22), y))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion};

    use super::*;
    use crate::detect::expected::pattern::CORNERS;
    use crate::detect::expected::view::View;
    use crate::detect::expected::{Expectation, Refusal};
    use crate::testing;

    /// The tag turns by ω² t² / 2 more than the series has: 2e-4 of half a side of 40 pixels.
    const TOLERANCE_PX: f64 = 0.03;

    #[test]
    fn corners_of_a_turning_tag_are_put_where_their_rows_see_them() -> Result<(), Refusal> {
        let camera = Camera { line_time_s: 25.6e-6, ..testing::rig().cameras[0].clone() };
        let place = Vector3::new(0.05, -0.02, 0.35);
        let turned = UnitQuaternion::from_euler_angles(std::f64::consts::PI + 0.3, 0.4, 0.2);
        let camera_from_tag = Isometry3::from_parts(place.into(), turned);
        let (mut most_px, mut bent_px) = (0.0_f64, 0.0_f64);
        for rate in [Vector3::new(6.0, 0.0, 0.0), Vector3::new(0.0, 6.0, 0.0), Vector3::new(1.0, 2.0, 6.0)] {
            // About its middle, which stays where it is.
            let normal = turned * Vector3::z();
            let ideal_rate =
                rate.cross_matrix() - rate.cross(&place) * (normal / normal.dot(&place)).transpose();
            let still = Expectation::from_pose(7, &camera_from_tag, 0.03, 1.0);
            let view = View::new(&camera, &Expectation { ideal_rate, ..still })?;
            let middle_row = camera.pixel_of_ideal(place.xy() / place.z).y;
            for [u, v] in CORNERS {
                let on_tag = Point3::new((u - 5.0) * 0.03 / 8.0, (5.0 - v) * 0.03 / 8.0, 0.0);
                let at = |t_s: f64| -> Point2<f64> {
                    let moved = UnitQuaternion::from_scaled_axis(rate * t_s) * turned * on_tag.coords + place;
                    camera.pixel_of_ideal(moved.xy() / moved.z)
                };
                let mut seen = at(0.0);
                for _ in 0..10 {
                    seen = at((seen.y - middle_row) * camera.line_time_s);
                }
                let p = view.local_from_cells * Vector3::new(u, v, 1.0);
                let ideal = view.local.origin + view.bend.bent(p.xy() / p.z) * view.local.unit;
                most_px = most_px.max((camera.pixel_of_ideal(ideal) - seen).norm());
                bent_px = bent_px.max((at(0.0) - seen).norm());
            }
        }
        assert!(bent_px > 10.0 * TOLERANCE_PX, "{bent_px}");
        assert!(most_px < TOLERANCE_PX, "{most_px}");
        Ok(())
    }

    #[test]
    fn what_is_straightened_is_bent_back() {
        /// A share of a share of what is displaced by a hundredth.
        const TOLERANCE: f64 = 1e-4;
        let sut = Bend { time: RowVector2::new(0.0002, 0.001), gradient: Matrix2::new(3.0, -7.0, 8.0, 1.0) };
        for (x, y) in [(0.7, 0.7), (-0.7, 0.5), (0.1, -0.9)] {
            let bent = sut.bent(Vector2::new(x, y)).map(|number| number as f32);
            let (back_x, back_y) = sut.straightened(wide::f32x8::splat(bent.x), wide::f32x8::splat(bent.y));
            let error =
                Vector2::new(f64::from(back_x.to_array()[0]) - x, f64::from(back_y.to_array()[0]) - y);
            assert!(error.norm() < TOLERANCE, "{error}");
        }
    }
}
