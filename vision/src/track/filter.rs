//! Constant-velocity filter on SE(3) for one shell, with the error in the tangent space.
//!
//! State: position p and velocity v in world axes, orientation R, angular velocity ω in shell axes. Error:
//! (δp, δθ, δv, δω) with R = R̂·exp(δθ), as [`crate::pose`] has it. Over a step dt:
//!
//! ```text
//! p ← p + v dt        δp ← δp + δv dt
//! R ← R exp(ω dt)     δθ ← exp(−ω dt) δθ + δω dt
//! ```
//!
//! driven by white acceleration of density q: Q = q [dt³/3, dt²/2; dt²/2, dt] for each axis (Bar-Shalom, Li,
//! Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001, section 6.2.2).

use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, Translation3, UnitQuaternion, Vector3, Vector6};

/// Covariance of the whole state.
pub type Matrix12 = SMatrix<f64, 12, 12>;

/// How a hand moves, and what to believe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterSettings {
    /// Density of the linear acceleration, m²/s³. 2: what 4.5 m/s² lasting 0.1 s amounts to.
    pub acceleration_density: f64,
    /// Density of the angular acceleration, rad²/s³. 150: 40 rad/s² lasting 0.1 s.
    pub angular_density: f64,
    /// Standard deviation of the velocity at the start, m/s.
    pub start_speed_m_s: f64,
    /// Standard deviation of the angular velocity at the start, rad/s.
    pub start_rate_rad_s: f64,
    /// Squared Mahalanobis distance beyond which a pose is taken for a jump. For six degrees of freedom 40
    /// is exceeded by chance once in two million.
    pub gate: f64,
}

impl Default for FilterSettings {
    fn default() -> Self {
        Self {
            acceleration_density: 2.0,
            angular_density: 150.0,
            start_speed_m_s: 1.0,
            start_rate_rad_s: 5.0,
            gate: 40.0,
        }
    }
}

/// Where a shell is, how it moves, and how sure that is, at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// The instant.
    pub time_ns: u64,
    /// Pose of the shell in the world.
    pub world_from_shell: Isometry3<f64>,
    /// Velocity of the shell's origin, world axes, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Angular velocity, shell axes, rad/s.
    pub rate_rad_s: Vector3<f64>,
    covariance: Matrix12,
}

/// What became of a measured pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Judgement {
    /// It agrees with the motion and was taken in.
    Accepted,
    /// It jumps farther than the motion allows and was left aside.
    Jump,
}

impl Motion {
    /// Begins with a measured pose, at rest as far as is known.
    pub fn begin(
        time_ns: u64,
        pose: &Isometry3<f64>,
        covariance: &Matrix6<f64>,
        settings: &FilterSettings,
    ) -> Self {
        let mut full = Matrix12::zeros();
        full.fixed_view_mut::<6, 6>(0, 0).copy_from(covariance);
        for k in 0..3 {
            full[(6 + k, 6 + k)] = settings.start_speed_m_s.powi(2);
            full[(9 + k, 9 + k)] = settings.start_rate_rad_s.powi(2);
        }
        Self {
            time_ns,
            world_from_shell: *pose,
            velocity_m_s: Vector3::zeros(),
            rate_rad_s: Vector3::zeros(),
            covariance: full,
        }
    }

    /// A motion that was described elsewhere; `covariance` as [`Motion::covariance`] gives it.
    pub fn restored(
        time_ns: u64,
        world_from_shell: Isometry3<f64>,
        velocity_m_s: Vector3<f64>,
        rate_rad_s: Vector3<f64>,
        covariance: Matrix12,
    ) -> Self {
        Self { time_ns, world_from_shell, velocity_m_s, rate_rad_s, covariance }
    }

    /// Covariance of position (world axes), rotation (shell axes), velocity (world) and angular velocity (shell).
    pub fn covariance(&self) -> &Matrix12 {
        &self.covariance
    }

    /// Covariance of position (world axes), then rotation (shell axes).
    pub fn pose_covariance(&self) -> Matrix6<f64> {
        self.covariance.fixed_view::<6, 6>(0, 0).into()
    }

    /// The motion at another instant; backwards too, although with no less doubt.
    pub fn predicted(&self, time_ns: u64, settings: &FilterSettings) -> Self {
        let dt_s = (i128::from(time_ns) - i128::from(self.time_ns)) as f64 * 1e-9;
        let turn = UnitQuaternion::from_scaled_axis(self.rate_rad_s * dt_s);
        let mut transition = Matrix12::identity();
        let mut block = |row, column, value: Matrix3<f64>| {
            transition.fixed_view_mut::<3, 3>(row, column).copy_from(&value);
        };
        block(0, 6, Matrix3::identity() * dt_s);
        block(3, 3, turn.inverse().to_rotation_matrix().into_inner());
        block(3, 9, Matrix3::identity() * dt_s);
        let mut covariance = transition * self.covariance * transition.transpose();
        let age_s = dt_s.abs();
        for (offset, density) in [(0, settings.acceleration_density), (3, settings.angular_density)] {
            for k in offset..offset + 3 {
                covariance[(k, k)] += density * age_s.powi(3) / 3.0;
                covariance[(k + 6, k + 6)] += density * age_s;
                let mixed = density * age_s * dt_s / 2.0;
                covariance[(k, k + 6)] += mixed;
                covariance[(k + 6, k)] += mixed;
            }
        }
        let position = self.world_from_shell.translation.vector + self.velocity_m_s * dt_s;
        Self {
            time_ns,
            world_from_shell: Isometry3::from_parts(
                Translation3::from(position),
                self.world_from_shell.rotation * turn,
            ),
            covariance,
            ..*self
        }
    }

    /// Takes in a pose measured at this motion's instant: call [`Motion::predicted`] first.
    pub fn correct(
        &mut self,
        measured: &Isometry3<f64>,
        covariance: &Matrix6<f64>,
        settings: &FilterSettings,
    ) -> Judgement {
        let innovation = tangent(&self.world_from_shell, measured);
        let Some(spread_inverse) = (self.pose_covariance() + covariance).try_inverse() else {
            return Judgement::Jump;
        };
        if innovation.dot(&(spread_inverse * innovation)) > settings.gate {
            return Judgement::Jump;
        }
        let gain: SMatrix<f64, 12, 6> = self.covariance.fixed_view::<12, 6>(0, 0) * spread_inverse;
        let step = gain * innovation;
        let shift: Vector3<f64> = step.fixed_rows::<3>(0).into();
        let turn: Vector3<f64> = step.fixed_rows::<3>(3).into();
        self.world_from_shell.translation.vector += shift;
        self.world_from_shell.rotation *= UnitQuaternion::from_scaled_axis(turn);
        self.velocity_m_s += step.fixed_rows::<3>(6);
        self.rate_rad_s += step.fixed_rows::<3>(9);
        // Joseph's form keeps the covariance positive.
        let mut keep = Matrix12::identity();
        let mut seen = keep.fixed_view_mut::<12, 6>(0, 0);
        seen -= &gain;
        let covariance = keep * self.covariance * keep.transpose() + gain * covariance * gain.transpose();
        self.covariance = (covariance + covariance.transpose()) * 0.5;
        Judgement::Accepted
    }
}

/// From one pose to another in the tangent space of the first.
fn tangent(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let shift = to.translation.vector - from.translation.vector;
    let turn = (from.rotation.inverse() * to.rotation).scaled_axis();
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_NS: u64 = 33_333_333;

    fn helix(time_ns: u64) -> Isometry3<f64> {
        let t = time_ns as f64 * 1e-9;
        Isometry3::from_parts(
            Translation3::new(0.4 * t, 0.1 - 0.3 * t, 1.0),
            UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 2.0 * t, 0.0)),
        )
    }

    fn followed(steps: u64) -> Motion {
        let settings = FilterSettings::default();
        let covariance = Matrix6::identity() * 1e-8;
        let mut sut = Motion::begin(0, &helix(0), &covariance, &settings);
        for k in 1..=steps {
            sut = sut.predicted(k * STEP_NS, &settings);
            let judgement = sut.correct(&helix(k * STEP_NS), &covariance, &settings);
            assert_eq!(judgement, Judgement::Accepted);
        }
        sut
    }

    #[test]
    fn constant_motion_is_predicted_exactly_once_it_is_known() {
        let sut = followed(30);
        let later = 30 * STEP_NS + 40_000_000;
        let error =
            sut.predicted(later, &FilterSettings::default()).world_from_shell.inverse() * helix(later);
        assert!(error.translation.vector.norm() < 1e-5, "{error}");
        assert!(error.rotation.angle() < 1e-4, "{error}");
        assert!((sut.velocity_m_s - Vector3::new(0.4, -0.3, 0.0)).norm() < 1e-3);
        assert!((sut.rate_rad_s - Vector3::new(0.0, 2.0, 0.0)).norm() < 1e-2);
    }

    #[test]
    fn doubt_grows_while_nothing_is_seen() {
        let sut = followed(10);
        let settings = FilterSettings::default();
        let mut last = 0.0;
        for ahead_ms in [0, 10, 50, 200] {
            let doubt = sut.predicted(sut.time_ns + ahead_ms * 1_000_000, &settings);
            let trace = doubt.pose_covariance().trace();
            assert!(trace > last, "{ahead_ms} ms: {trace}");
            last = trace;
        }
    }

    #[test]
    fn a_jump_is_left_aside() {
        let settings = FilterSettings::default();
        let sut = followed(10).predicted(11 * STEP_NS, &settings);
        let mut after = sut.clone();
        let far = Isometry3::translation(0.2, 0.0, 0.0) * helix(11 * STEP_NS);
        let judgement = after.correct(&far, &(Matrix6::identity() * 1e-8), &settings);
        assert_eq!(judgement, Judgement::Jump);
        assert_eq!(after, sut);
    }
}
