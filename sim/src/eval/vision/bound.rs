//! How well the corners of a tag, and the pose of a shell, can be known at all from one instant: Cramér-Rao bounds.
//!
//! Of a tag: all pixels of its print and margin, I = b + c s(p), with the sensor's noise σ²(I) (reading, shots, and the
//! twelfth of a grey level that rounding adds) and everything but the eight coordinates θ of its corners, the black b and
//! the contrast c known, the blur too. A pixel moves with the corners as the homography that they span says:
//!
//! ```text
//! F = Σ_pixels a aᵀ / σ²(I)     a = (∇Iᵀ ∂p/∂θ, 1, I)     Cov(θ) ≥ (F_θθ − F_θn F_nn⁻¹ F_nθ)⁻¹,  n = (b, c)
//! ```
//!
//! I and ∇I are those of the same picture rendered without noise. Of a shell: all tags that are truly before the cameras
//! count, each with its bound, and nothing is known beforehand: Cov(pose) ≥ (Σ Jᵀ Cov(θ)⁻¹ J)⁻¹, J = ∂θ/∂(p, φ), position
//! in world axes, rotation in the shell's. An estimator that also knows earlier instants can do better, one that has
//! to find out the blur, the light's gradient or the noise cannot do as well.

use locoman_vision::camera::Camera;
use locoman_vision::detect::CornerCovariance;
use locoman_vision::shells::ShellTag;
use nalgebra::{Isometry3, Matrix2, Matrix3, Matrix6, Point2, Point3, SMatrix, SVector, Vector2, Vector3};

use crate::operator::scene::Sensor;
use crate::operator::studio::Picture;

/// Corners in units of the tag's side, in their order.
const UNIT: [[f64; 2]; 4] = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
/// Half of the printed tag with most of its white margin, in sides: beyond it other things begin.
const REACH: f64 = 0.6;

/// The variance of a pixel's noise at a grey level.
pub fn noise_variance(sensor: &Sensor, grey: f64) -> f64 {
    const ROUNDING: f64 = 1.0 / 12.0;
    sensor.read_noise.powi(2) + sensor.shot_noise * (grey - sensor.black_level).max(0.0) + ROUNDING
}

/// Least covariance of the corners of a tag, from a picture without noise; `None` at the image's edge.
pub fn of_corners(
    picture: &Picture,
    corners_px: &[Point2<f64>; 4],
    variance: impl Fn(f64) -> f64,
) -> Option<CornerCovariance> {
    let pixels_from_tag = homography(corners_px)?;
    let tag_from_pixels = pixels_from_tag.try_inverse()?;
    let by_corner = derivatives(corners_px)?;
    let mut information = SMatrix::<f64, 10, 10>::zeros();
    let reach = [[-REACH, -REACH], [REACH, -REACH], [REACH, REACH], [-REACH, REACH]];
    let outline = reach.map(|[u, v]| mapped(&pixels_from_tag, u, v));
    let least = |axis: usize| outline.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min).floor() as i64;
    let most = |axis: usize| outline.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max).ceil() as i64;
    if least(0) < 1
        || least(1) < 1
        || most(0) >= i64::from(picture.width) - 1
        || most(1) >= i64::from(picture.height) - 1
    {
        return None;
    }
    let grey = |x: i64, y: i64| f64::from(picture.grey[y as usize * picture.width as usize + x as usize]);
    for y in least(1)..=most(1) {
        for x in least(0)..=most(0) {
            let at = mapped(&tag_from_pixels, x as f64, y as f64);
            if at.x.abs() > REACH || at.y.abs() > REACH {
                continue;
            }
            let gradient = Vector2::new(
                0.5 * (grey(x + 1, y) - grey(x - 1, y)),
                0.5 * (grey(x, y + 1) - grey(x, y - 1)),
            );
            let level = grey(x, y);
            let mut row = SVector::<f64, 10>::zeros();
            for (k, changed) in by_corner.iter().enumerate() {
                row[k] = gradient.dot(&moved(&pixels_from_tag, changed, at.x, at.y));
            }
            row[8] = 1.0;
            row[9] = level;
            information += row * row.transpose() / variance(level);
        }
    }
    let nuisance: Matrix2<f64> = information.fixed_view::<2, 2>(8, 8).into();
    let between = information.fixed_view::<8, 2>(0, 8).into_owned();
    let own: CornerCovariance = information.fixed_view::<8, 8>(0, 0).into();
    (own - between * nuisance.try_inverse()? * between.transpose()).cholesky().map(|factor| factor.inverse())
}

/// What a tag with such corners says of its shell's pose.
pub fn information(
    camera: &Camera,
    world_from_shell: &Isometry3<f64>,
    tag: &ShellTag,
    covariance_px2: &CornerCovariance,
) -> Option<Matrix6<f64>> {
    let camera_from_world = camera.world_from_camera.inverse();
    let mut jacobian = SMatrix::<f64, 8, 6>::zeros();
    for (k, corner) in tag.corners().into_iter().enumerate() {
        let in_camera: Point3<f64> = camera_from_world * world_from_shell * corner;
        let (_, by_point) = camera.project_with_jacobian(&in_camera)?;
        let by_position = by_point * camera_from_world.rotation.to_rotation_matrix().matrix();
        let rotation = world_from_shell.rotation.to_rotation_matrix();
        let by_rotation = -by_position * rotation.matrix() * corner.coords.cross_matrix();
        jacobian.fixed_view_mut::<2, 3>(2 * k, 0).copy_from(&by_position);
        jacobian.fixed_view_mut::<2, 3>(2 * k, 3).copy_from(&by_rotation);
    }
    Some(jacobian.transpose() * covariance_px2.cholesky()?.solve(&jacobian))
}

/// From the tag's plane, in sides, to pixels.
fn homography(corners_px: &[Point2<f64>; 4]) -> Option<Matrix3<f64>> {
    let mut matrix = SMatrix::<f64, 8, 8>::zeros();
    let mut right = SVector::<f64, 8>::zeros();
    for (k, ([u, v], pixel)) in UNIT.into_iter().zip(corners_px).enumerate() {
        for axis in 0..2 {
            let at = 2 * k + axis;
            for (i, number) in [u, v, 1.0].into_iter().enumerate() {
                matrix[(at, 3 * axis + i)] = number;
            }
            matrix[(at, 6)] = -pixel[axis] * u;
            matrix[(at, 7)] = -pixel[axis] * v;
            right[at] = pixel[axis];
        }
    }
    let h = matrix.lu().solve(&right)?;
    Some(Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0))
}

/// A change of each of the eight coordinates by this much, pixels: the homography is nearly linear in it.
const CHANGE_PX: f64 = 1e-3;

fn derivatives(corners_px: &[Point2<f64>; 4]) -> Option<[Matrix3<f64>; 8]> {
    let mut changed = [Matrix3::zeros(); 8];
    for (k, changed) in changed.iter_mut().enumerate() {
        let mut corners_px = *corners_px;
        corners_px[k / 2][k % 2] += CHANGE_PX;
        *changed = homography(&corners_px)?;
    }
    Some(changed)
}

fn moved(from: &Matrix3<f64>, to: &Matrix3<f64>, u: f64, v: f64) -> Vector2<f64> {
    (mapped(to, u, v) - mapped(from, u, v)) / CHANGE_PX
}

fn mapped(homography: &Matrix3<f64>, u: f64, v: f64) -> Point2<f64> {
    let p = homography * Vector3::new(u, v, 1.0);
    Point2::new(p.x / p.z, p.y / p.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A black square on white, its edges blurred.
    fn square(side: f64, sigma: f64) -> (Picture, [Point2<f64>; 4]) {
        let (width, height, middle) = (100u32, 100u32, 50.0);
        // The normal distribution's integral, near enough.
        let edge = |x: f64| 1.0 / (1.0 + (-1.702 * x / sigma).exp());
        let inside = |x: f64| edge(x - middle + 0.5 * side) * edge(middle + 0.5 * side - x);
        let grey = (0..width * height)
            .map(|at| {
                (200.0 - 160.0 * inside(f64::from(at % width)) * inside(f64::from(at / width))).round() as u8
            })
            .collect();
        let corners_px = UNIT.map(|[u, v]| Point2::new(middle + side * u, middle + side * v));
        (Picture { width, height, grey, jpeg_quality: 92 }, corners_px)
    }

    #[test]
    fn the_bound_of_a_plain_square_is_that_of_its_four_edges() {
        let (side, sigma, noise, contrast) = (60.0, 1.0, 2.0, 160.0);
        let (picture, corners_px) = square(side, sigma);
        let sut = of_corners(&picture, &corners_px, |_| noise * noise).unwrap();
        // A straight edge of length L is known to σ_n/A √(2 √π s / L), its ends to twice that; a corner is where
        // two of them end.
        let edge_px = noise / contrast * (2.0 * std::f64::consts::PI.sqrt() * sigma / side).sqrt();
        let rms_px = (sut.trace() / 8.0).sqrt();
        // A little is lost: the corners themselves are round, and black and contrast have to be found too.
        let loss = rms_px / (2.0 * edge_px) - 1.0;
        assert!((0.0..0.15).contains(&loss), "{rms_px} px, the edges say {}", 2.0 * edge_px);
    }
}
