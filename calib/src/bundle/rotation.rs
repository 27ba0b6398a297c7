//! Small rotations: the Jacobians of SO(3) that bundle adjustment needs.
//!
//! Convention: perturbations stand on the right, R ← R exp(δ). J_r(φ) says how exp(φ + δ) = exp(φ) exp(J_r(φ) δ);
//! its inverse how log(exp(φ) exp(δ)) = φ + J_r⁻¹(φ) δ. J_l(φ) = J_r(−φ). (Solà et al., "A micro Lie theory", 2018.)

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Below this angle (rad) the series are exact to rounding.
const SMALL_RAD: f64 = 1e-3;

/// J_r(φ).
pub(super) fn right_jacobian(phi: &Vector3<f64>) -> Matrix3<f64> {
    let (angle2, cross) = (phi.norm_squared(), phi.cross_matrix());
    let (a, b) = if angle2 < SMALL_RAD * SMALL_RAD {
        (0.5 - angle2 / 24.0, 1.0 / 6.0 - angle2 / 120.0)
    } else {
        let angle = angle2.sqrt();
        ((1.0 - angle.cos()) / angle2, (angle - angle.sin()) / (angle2 * angle))
    };
    Matrix3::identity() - cross * a + cross * cross * b
}

/// J_r⁻¹(φ).
pub(super) fn right_jacobian_inverse(phi: &Vector3<f64>) -> Matrix3<f64> {
    let (angle2, cross) = (phi.norm_squared(), phi.cross_matrix());
    let b = if angle2 < SMALL_RAD * SMALL_RAD {
        1.0 / 12.0 + angle2 / 720.0
    } else {
        let angle = angle2.sqrt();
        1.0 / angle2 - (1.0 + angle.cos()) / (2.0 * angle * angle.sin())
    };
    Matrix3::identity() + cross * 0.5 + cross * cross * b
}

/// J_l⁻¹(φ).
pub(super) fn left_jacobian_inverse(phi: &Vector3<f64>) -> Matrix3<f64> {
    right_jacobian_inverse(&-phi)
}

/// R exp(φ).
pub(super) fn turned(rotation: &UnitQuaternion<f64>, phi: &Vector3<f64>) -> UnitQuaternion<f64> {
    // Renewed, so that hundreds of steps do not let the norm drift.
    UnitQuaternion::new_normalize((rotation * UnitQuaternion::from_scaled_axis(*phi)).into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_jacobians_are_the_derivatives_that_they_claim_to_be() {
        const STEP: f64 = 1e-6;
        const TOLERANCE: f64 = 1e-8;
        for scale in [1e-4, 0.02, 1.1, 2.9] {
            let phi = Vector3::new(0.5, -0.7, 0.51).normalize() * scale;
            let at = UnitQuaternion::from_scaled_axis(phi);
            for axis in 0..3 {
                let delta = Vector3::from_fn(|row, _| if row == axis { STEP } else { 0.0 });
                let moved = |sign: f64| {
                    (at.inverse() * UnitQuaternion::from_scaled_axis(phi + delta * sign)).scaled_axis()
                };
                let numeric = (moved(1.0) - moved(-1.0)) / (2.0 * STEP);
                assert!((right_jacobian(&phi).column(axis) - numeric).norm() < TOLERANCE, "{scale}");
            }
            let inverse = right_jacobian(&phi) * right_jacobian_inverse(&phi);
            assert!((inverse - Matrix3::identity()).norm() < 1e-10, "{scale}");
        }
    }
}
