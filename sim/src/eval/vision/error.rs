//! The error of one pose, and what the tracker's own covariance says of it.

use locoman_vision::track::ShellUpdate;
use nalgebra::{Isometry3, Matrix3, Vector3, Vector6};

/// The error of one pose that was called measured.
#[derive(Debug, Clone, Copy)]
pub struct PoseError {
    /// Scene time.
    pub time_s: f64,
    /// From the found place to the true one, world axes.
    pub position_m: Vector3<f64>,
    /// From the found orientation to the true one, shell axes.
    pub rotation_rad: Vector3<f64>,
    /// Squared error by the covariance, six degrees of freedom; no number if the covariance is none.
    pub squared: f64,
    /// Error of the position in standard deviations: the root of its squared error by its covariance.
    pub position_sigmas: f64,
}

/// A pose is wrong if its position is off by more than this, metres,
const WRONG_M: f64 = 0.010;
/// and by more than this many standard deviations.
const WRONG_SIGMAS: f64 = 5.0;
/// 95 % of χ² with six degrees of freedom.
const CHI2_95: f64 = 12.592;

impl PoseError {
    /// Compares; `None` without a pose.
    pub fn new(time_s: f64, truth: &Isometry3<f64>, update: &ShellUpdate) -> Option<Self> {
        let found = update.world_from_shell.as_ref()?;
        // As the covariance has it: position in world axes, rotation in the shell's.
        let position_m = truth.translation.vector - found.translation.vector;
        let rotation_rad = (found.rotation.inverse() * truth.rotation).scaled_axis();
        let mut error = Vector6::zeros();
        error.fixed_rows_mut::<3>(0).copy_from(&position_m);
        error.fixed_rows_mut::<3>(3).copy_from(&rotation_rad);
        let squared =
            update.covariance.cholesky().map_or(f64::NAN, |factor| error.dot(&factor.solve(&error)));
        let of_position: Matrix3<f64> = update.covariance.fixed_view::<3, 3>(0, 0).into();
        let position_sigmas = of_position
            .cholesky()
            .map_or(f64::INFINITY, |factor| position_m.dot(&factor.solve(&position_m)).sqrt());
        Some(Self { time_s, position_m, rotation_rad, squared, position_sigmas })
    }

    /// Whether nobody should have called this measured.
    pub fn is_wrong(&self) -> bool {
        self.position_m.norm() > WRONG_M && self.position_sigmas > WRONG_SIGMAS
    }

    /// Squared error by the covariance, per degree of freedom: 1 on average if the covariance is true.
    pub fn normalized(&self) -> f64 {
        self.squared / 6.0
    }

    /// Whether the 95 % ellipsoid of the covariance holds the truth.
    pub fn is_covered(&self) -> bool {
        self.squared <= CHI2_95
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix6;

    use super::*;

    #[test]
    fn an_error_of_one_standard_deviation_in_each_direction_has_the_normalized_error_one() {
        let truth = Isometry3::new(Vector3::new(0.001, -0.001, 0.001), Vector3::new(0.01, 0.01, -0.01));
        let covariance = Matrix6::from_diagonal(&Vector6::new(1e-6, 1e-6, 1e-6, 1e-4, 1e-4, 1e-4));
        let update =
            ShellUpdate { world_from_shell: Some(Isometry3::identity()), covariance, ..ShellUpdate::lost() };
        let sut = PoseError::new(0.0, &truth, &update).unwrap();
        assert!((sut.normalized() - 1.0).abs() < 1e-12 && sut.is_covered() && !sut.is_wrong());
        let sure = ShellUpdate { covariance: covariance * 1e-4, ..update };
        let far = Isometry3::translation(0.011, 0.0, 0.0);
        let sut = PoseError::new(0.0, &far, &sure).unwrap();
        assert!(!sut.is_covered() && sut.is_wrong());
        assert!(PoseError::new(0.0, &far, &ShellUpdate::lost()).is_none());
    }
}
