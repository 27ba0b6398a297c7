//! The rigid motion that best carries one set of points onto another (Kabsch's solution of the orthogonal
//! Procrustes problem).

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

/// The isometry that minimizes `Σ w |to - T from|²`.
///
/// H = Σ w (from - f̄)(to - t̄)ᵀ = U Σ Vᵀ, R = V diag(1, 1, det(V Uᵀ)) Uᵀ, t = t̄ - R f̄. The determinant keeps
/// R a rotation also when the points lie in a plane, as feet do. Nothing if fewer than three points have
/// weight, or if they lie on one line. Allocates nothing.
pub fn align(pairs: impl Iterator<Item = Pair> + Clone) -> Option<Isometry3<f64>> {
    let (mut count, mut weight) = (0_usize, 0.0);
    let (mut from_mean, mut to_mean) = (Vector3::zeros(), Vector3::zeros());
    for pair in pairs.clone().filter(|pair| pair.weight > 0.0) {
        count += 1;
        weight += pair.weight;
        from_mean += pair.weight * pair.from;
        to_mean += pair.weight * pair.to;
    }
    if count < 3 {
        return None;
    }
    from_mean /= weight;
    to_mean /= weight;
    let mut covariance = Matrix3::zeros();
    for pair in pairs.filter(|pair| pair.weight > 0.0) {
        covariance += pair.weight * (pair.from - from_mean) * (pair.to - to_mean).transpose();
    }
    let svd = covariance.try_svd(true, true, f64::EPSILON, 100)?;
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut sigma = svd.singular_values;
    sigma.as_mut_slice().sort_unstable_by(|a, b| b.total_cmp(a));
    if sigma[1] <= DEGENERATE * sigma[0] || !sigma[0].is_finite() {
        return None;
    }
    let v = v_t.transpose();
    // The direction that the points do not span is the one of the least singular value.
    let least = svd.singular_values.imin();
    let mut signs = Vector3::repeat(1.0);
    signs[least] = (v * u.transpose()).determinant().signum();
    let rotation = v * Matrix3::from_diagonal(&signs) * u.transpose();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Some(Isometry3::from_parts((to_mean - rotation * from_mean).into(), rotation))
}

/// Ratio of the second to the first singular value below which points count as lying on a line.
const DEGENERATE: f64 = 1e-6;

/// A point in both frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Where it is in the source frame.
    pub from: Vector3<f64>,
    /// Where it is in the target frame.
    pub to: Vector3<f64>,
    /// How much it counts; 0 leaves it out.
    pub weight: f64,
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Roundings of a 3x3 SVD on points of metres.
    const TOLERANCE: f64 = 1e-9;

    fn pairs(truth: &Isometry3<f64>, points: &[[f64; 3]]) -> Vec<Pair> {
        let pair = |p: &[f64; 3]| {
            let from = Vector3::from(*p);
            Pair { from, to: truth.transform_point(&from.into()).coords, weight: 1.0 }
        };
        points.iter().map(pair).collect()
    }

    proptest! {
        #[test]
        fn feet_in_a_plane_give_back_the_motion(
            translation in prop::array::uniform3(-1.0..1.0f64),
            axis_angle in prop::array::uniform3(-1.7..1.7f64),
            feet in 3..=4usize,
            z in prop::array::uniform4(-0.02..0.02f64),
        ) {
            let truth = Isometry3::new(translation.into(), axis_angle.into());
            let stand = [[0.19, -0.13, z[0]], [0.19, 0.13, z[1]], [-0.19, -0.13, z[2]], [-0.19, 0.13, z[3]]];
            let found = align(pairs(&truth, &stand[..feet]).into_iter()).unwrap();
            let error = truth.inverse() * found;
            prop_assert!(error.translation.vector.norm() < TOLERANCE);
            prop_assert!(error.rotation.angle() < 1e-7);
        }
    }

    #[test]
    fn points_on_a_line_and_too_few_points_are_refused() {
        let truth = Isometry3::identity();
        let line = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]];
        assert_eq!(align(pairs(&truth, &line).into_iter()), None);
        assert_eq!(align(pairs(&truth, &line[..2]).into_iter()), None);
    }
}
