//! The ground under the robot, as far as its feet know it.

use nalgebra::{Matrix2, Vector2, Vector3};

use crate::joints::Leg;

/// The plane that fits the feet's last places on the ground best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundPlane {
    /// Last places of the feet's centres on the ground.
    footholds: [Vector3<f64>; 4],
}

impl GroundPlane {
    /// Through four feet.
    pub const fn new(footholds: [Vector3<f64>; 4]) -> Self {
        Self { footholds }
    }

    /// A foot stands somewhere.
    pub fn stand(&mut self, leg: Leg, foot: Vector3<f64>) {
        self.footholds[leg.index()] = foot;
    }

    /// Height of a foot's centre on the ground there.
    pub fn height(&self, at: &Vector2<f64>) -> f64 {
        let mean = self.footholds.iter().sum::<Vector3<f64>>() / 4.0;
        let (mut moments, mut lean) = (Matrix2::from_diagonal_element(1e-3), Vector2::zeros());
        for foothold in &self.footholds {
            let from_mean = foothold - mean;
            let seen = from_mean.xy();
            moments += seen * seen.transpose();
            lean += seen * from_mean.z;
        }
        let slope = moments.cholesky().map_or_else(Vector2::zeros, |factor| factor.solve(&lean));
        mean.z + slope.dot(&(at - mean.xy()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ground_is_the_plane_through_the_feet() {
        let slope = |x: f64, y: f64| Vector3::new(x, y, 0.1 * x - 0.05 * y + 0.02);
        let feet = [slope(0.2, -0.15), slope(0.2, 0.15), slope(-0.2, -0.15), slope(-0.2, 0.15)];
        let height = GroundPlane::new(feet).height(&Vector2::new(0.3, 0.1));
        assert!((height - 0.045).abs() < 2e-3, "{height}");
    }
}
