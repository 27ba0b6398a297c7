//! How a pixel depends on the intrinsics of its camera: the derivatives that [`locoman_vision::camera`] does not give.
//!
//! Intrinsics stand in the order fx, fy, cx, cy, then the lens's coefficients in OpenCV's order.

use locoman_vision::camera::{Camera, Distortion};
use nalgebra::Vector2;

/// Most intrinsics that a camera has: four and the eight of the rational model.
pub const INTRINSICS: usize = 12;

/// Names of the intrinsics of a lens, in their order.
pub fn names(distortion: &Distortion) -> &'static [&'static str] {
    match distortion {
        Distortion::Pinhole => &["fx", "fy", "cx", "cy"],
        Distortion::RadTan(_) => &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"],
        Distortion::Fisheye(_) => &["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"],
    }
}

/// The value of an intrinsic; 0 beyond the last.
pub fn value(camera: &Camera, index: usize) -> f64 {
    match (index, &camera.distortion) {
        (0 | 1, _) => camera.focal_px[index],
        (2 | 3, _) => camera.center_px[index - 2],
        (_, Distortion::Pinhole) => 0.0,
        (_, Distortion::RadTan(k)) => k.get(index - 4).copied().unwrap_or(0.0),
        (_, Distortion::Fisheye(k)) => k.get(index - 4).copied().unwrap_or(0.0),
    }
}

/// Adds to an intrinsic; nothing beyond the last.
pub(super) fn add(camera: &mut Camera, index: usize, step: f64) {
    let place = match (index, &mut camera.distortion) {
        (0 | 1, _) => Some(&mut camera.focal_px[index]),
        (2 | 3, _) => Some(&mut camera.center_px[index - 2]),
        (_, Distortion::Pinhole) => None,
        (_, Distortion::RadTan(k)) => k.get_mut(index - 4),
        (_, Distortion::Fisheye(k)) => k.get_mut(index - 4),
    };
    if let Some(place) = place {
        *place += step;
    }
}

/// Derivatives of the pixel of ideal image coordinates (x/z, y/z) by every intrinsic.
pub fn by_intrinsics(camera: &Camera, ideal: Vector2<f64>) -> [Vector2<f64>; INTRINSICS] {
    let mut columns = [Vector2::zeros(); INTRINSICS];
    let (distorted, _) = camera.distortion.distort(ideal);
    columns[0] = Vector2::new(distorted.x, 0.0);
    columns[1] = Vector2::new(0.0, distorted.y);
    columns[2] = Vector2::x();
    columns[3] = Vector2::y();
    let (x, y) = (ideal.x, ideal.y);
    let r2 = ideal.norm_squared();
    match &camera.distortion {
        Distortion::Pinhole => {}
        Distortion::RadTan(k) => {
            let [k1, k2, _, _, k3, k4, k5, k6] = *k;
            let numerator = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            let denominator = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
            let above = ideal / denominator;
            let below = -ideal * (numerator / (denominator * denominator));
            columns[4] = above * r2;
            columns[5] = above * (r2 * r2);
            columns[6] = Vector2::new(2.0 * x * y, r2 + 2.0 * y * y);
            columns[7] = Vector2::new(r2 + 2.0 * x * x, 2.0 * x * y);
            columns[8] = above * (r2 * r2 * r2);
            columns[9] = below * r2;
            columns[10] = below * (r2 * r2);
            columns[11] = below * (r2 * r2 * r2);
        }
        Distortion::Fisheye(_) => {
            let radius = ideal.norm();
            let theta = radius.atan();
            let unit = if radius < 1e-9 { Vector2::zeros() } else { ideal / radius };
            for (power, column) in (3..).step_by(2).zip(&mut columns[4..8]) {
                *column = unit * theta.powi(power);
            }
        }
    }
    for column in &mut columns[4..] {
        column.component_mul_assign(&camera.focal_px);
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_by_intrinsics_are_those_of_the_projection() {
        const STEP: f64 = 1e-6;
        let lenses = [
            Distortion::Pinhole,
            Distortion::RadTan([-0.2, 0.05, 1e-3, -2e-3, 0.01, 0.1, -0.02, 0.003]),
            Distortion::Fisheye([0.05, -0.01, 0.004, -0.001]),
        ];
        for distortion in lenses {
            let camera = Camera {
                id: "one".into(),
                width: 640,
                height: 480,
                focal_px: Vector2::new(500.0, 505.0),
                center_px: Vector2::new(322.0, 241.0),
                distortion,
                world_from_camera: nalgebra::Isometry3::identity(),
                line_time_s: 0.0,
            };
            let ideal = Vector2::new(0.42, -0.31);
            let columns = by_intrinsics(&camera, ideal);
            for (index, name) in names(&camera.distortion).iter().enumerate() {
                let at = |step: f64| {
                    let mut moved = camera.clone();
                    add(&mut moved, index, step);
                    assert!((value(&moved, index) - value(&camera, index) - step).abs() < 1e-12);
                    moved.pixel_of_ideal(ideal)
                };
                let numeric = (at(STEP) - at(-STEP)) / (2.0 * STEP);
                assert!((columns[index] - numeric).norm() < 1e-5, "{name}: {} {numeric}", columns[index]);
            }
        }
    }
}
