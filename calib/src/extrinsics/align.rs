//! Lays what was measured over what was drawn, so that few things that are wrong stand out instead of bending the rest.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A measured point and the drawn one.
pub type Pair = (Point3<f64>, Point3<f64>);

/// `drawn_from_measured`: minimises the sum of the distances (not of their squares) of pairs of (measured, drawn) points.
///
/// `None` of fewer than three pairs.
pub fn align(pairs: &[Pair]) -> Option<Isometry3<f64>> {
    const ROUNDS: usize = 60;
    /// Nearer than this all count alike, m: otherwise one perfect pair would weigh everything.
    const FLOOR_M: f64 = 2e-5;
    if pairs.len() < 3 {
        return None;
    }
    let mut weights = vec![1.0; pairs.len()];
    let mut pose = Isometry3::identity();
    for _ in 0..ROUNDS {
        pose = weighted(pairs, &weights)?;
        for (weight, (measured, drawn)) in weights.iter_mut().zip(pairs) {
            *weight = 1.0 / (pose * measured - drawn).norm().max(FLOOR_M);
        }
    }
    Some(pose)
}

/// Least squares (Kabsch, 1976).
fn weighted(pairs: &[Pair], weights: &[f64]) -> Option<Isometry3<f64>> {
    let total: f64 = weights.iter().sum();
    let mean = |of: fn(&Pair) -> Vector3<f64>| {
        pairs.iter().zip(weights).map(|(pair, weight)| of(pair) * *weight).sum::<Vector3<f64>>() / total
    };
    let (from, to) = (mean(|pair| pair.0.coords), mean(|pair| pair.1.coords));
    let mut covariance = Matrix3::zeros();
    for ((measured, drawn), weight) in pairs.iter().zip(weights) {
        covariance += (drawn.coords - to) * (measured.coords - from).transpose() * *weight;
    }
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (u * v_t).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Some(Isometry3::from_parts(Translation3::from(to - rotation * from), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_that_is_off_does_not_bend_the_rest() {
        let pose = Isometry3::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.2, 0.1, -0.5));
        let points: Vec<Point3<f64>> = (0..12)
            .map(|k| Point3::new(f64::from(k).sin(), f64::from(k * k).cos(), f64::from(k % 3)))
            .collect();
        let mut pairs: Vec<_> = points.iter().map(|point| (*point, pose * point)).collect();
        pairs[4].1.x += 0.01;
        let found = align(&pairs).expect("enough");
        assert!((found.translation.vector - pose.translation.vector).norm() < 1e-4);
        assert!(found.rotation.angle_to(&pose.rotation) < 1e-4);
        assert!(align(&pairs[..2]).is_none());
    }
}
