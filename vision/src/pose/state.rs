//! A pose that moves: what the solver estimates, its tangent space, and what was believed before.
//!
//! State x = (p, R, v, ω) at a reference time: position and velocity in world axes, orientation, angular
//! velocity in shell axes. Over a short time dt the shell goes on as it moves:
//!
//! ```text
//! p(dt) = p + v dt        R(dt) = R exp(ω dt)
//! ```
//!
//! Tangent δ = (δp, δθ, δv, δω): p ← p + δp, R ← R exp(δθ), v ← v + δv, ω ← ω + δω.

use nalgebra::{Isometry3, Matrix3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3};

/// A symmetric matrix over the tangent space of a [`State`].
pub type Matrix12 = SMatrix<f64, 12, 12>;
/// A tangent vector of a [`State`]: δp, δθ, δv, δω.
pub type Vector12 = SVector<f64, 12>;

/// Pose and twist of a shell at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Pose of the shell in the world.
    pub world_from_shell: Isometry3<f64>,
    /// Velocity of the shell's origin, world axes, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Angular velocity, shell axes, rad/s.
    pub rate_rad_s: Vector3<f64>,
}

/// What is believed of a state before anything is measured: a normal distribution in the tangent space.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// The mean.
    pub state: State,
    /// Inverse of the covariance; zero for what is not known at all.
    pub information: Matrix12,
}

impl State {
    /// At rest.
    pub fn still(world_from_shell: Isometry3<f64>) -> Self {
        Self { world_from_shell, velocity_m_s: Vector3::zeros(), rate_rad_s: Vector3::zeros() }
    }

    /// The pose a short time later, or earlier.
    pub fn pose_after(&self, dt_s: f64) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(self.world_from_shell.translation.vector + self.velocity_m_s * dt_s),
            self.world_from_shell.rotation * UnitQuaternion::from_scaled_axis(self.rate_rad_s * dt_s),
        )
    }

    /// Moves along a tangent.
    pub fn moved(&self, step: &Vector12) -> Self {
        let shift: Vector3<f64> = step.fixed_rows::<3>(0).into();
        let turn: Vector3<f64> = step.fixed_rows::<3>(3).into();
        Self {
            world_from_shell: Isometry3::from_parts(
                Translation3::from(self.world_from_shell.translation.vector + shift),
                self.world_from_shell.rotation * UnitQuaternion::from_scaled_axis(turn),
            ),
            velocity_m_s: self.velocity_m_s + step.fixed_rows::<3>(6),
            rate_rad_s: self.rate_rad_s + step.fixed_rows::<3>(9),
        }
    }

    /// The tangent along which [`State::moved`] leads to another state.
    pub fn step_to(&self, other: &Self) -> Vector12 {
        let (here, there) = (&self.world_from_shell, &other.world_from_shell);
        let mut step = Vector12::zeros();
        step.fixed_rows_mut::<3>(0).copy_from(&(there.translation.vector - here.translation.vector));
        step.fixed_rows_mut::<3>(3).copy_from(&(here.rotation.inverse() * there.rotation).scaled_axis());
        step.fixed_rows_mut::<3>(6).copy_from(&(other.velocity_m_s - self.velocity_m_s));
        step.fixed_rows_mut::<3>(9).copy_from(&(other.rate_rad_s - self.rate_rad_s));
        step
    }
}

impl Prior {
    /// Nothing is known of the pose but where to begin; the motion is of ordinary speed.
    pub fn of_speed(world_from_shell: Isometry3<f64>, speed_m_s: f64, rate_rad_s: f64) -> Self {
        let mut information = Matrix12::zeros();
        for k in 0..3 {
            information[(6 + k, 6 + k)] = speed_m_s.powi(-2);
            information[(9 + k, 9 + k)] = rate_rad_s.powi(-2);
        }
        Self { state: State::still(world_from_shell), information }
    }

    /// eᵀ Λ e of a state, e being the step from the mean.
    pub fn distance2(&self, state: &State) -> f64 {
        let step = self.state.step_to(state);
        step.dot(&(self.information * step))
    }

    /// Hessian and gradient of half of [`Prior::distance2`] at a state.
    pub(super) fn linearized(&self, state: &State) -> (Matrix12, Vector12) {
        let step = self.state.step_to(state);
        let turn: Vector3<f64> = step.fixed_rows::<3>(3).into();
        // Only the rotation's part of the derivative is not 1.
        let jacobian = right_jacobian_inverse(&turn);
        let mut hessian = self.information;
        let rows = jacobian.tr_mul(&hessian.fixed_rows::<3>(3));
        hessian.fixed_rows_mut::<3>(3).copy_from(&rows);
        let gradient = hessian * step;
        let columns = hessian.fixed_columns::<3>(3) * jacobian;
        hessian.fixed_columns_mut::<3>(3).copy_from(&columns);
        (hessian, gradient)
    }
}

/// d log(exp(φ) exp(δ)) / dδ at 0, to the third order of φ.
fn right_jacobian_inverse(phi: &Vector3<f64>) -> Matrix3<f64> {
    let cross = phi.cross_matrix();
    Matrix3::identity() + cross * 0.5 + cross * cross / 12.0
}
