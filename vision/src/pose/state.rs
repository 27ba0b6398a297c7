//! A pose that moves: what the solver estimates, its tangent space, and what was believed before.
//!
//! State x = (p, R, v, ω, a, α) at a reference time: position, velocity and acceleration in world axes, orientation,
//! angular velocity and acceleration in shell axes. Over a short time dt the shell goes on as it moves:
//!
//! ```text
//! p(dt) = p + v dt + a dt²/2        R(dt) = R exp(ω dt + α dt²/2)
//! ```
//!
//! Cameras that are exposed 10 ms apart see a hand that brakes with 3 m/s² on a curve that is 0.15 mm from straight:
//! more than the noise of a palm. Hence the accelerations; from one group of frames they are little more than their
//! prior, from the filter's prediction they are known.
//!
//! Tangent δ = (δp, δθ, δv, δω, δa, δα): R ← R exp(δθ), all others are added.

use nalgebra::{Isometry3, Matrix3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3};

use super::SolverSettings;

/// A symmetric matrix over the tangent space of a [`State`].
pub type Matrix18 = SMatrix<f64, 18, 18>;
/// A tangent vector of a [`State`]: δp, δθ, δv, δω, δa, δα.
pub type Vector18 = SVector<f64, 18>;

/// Pose, twist and accelerations of a shell at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Pose of the shell in the world.
    pub world_from_shell: Isometry3<f64>,
    /// Velocity of the shell's origin, world axes, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Angular velocity, shell axes, rad/s.
    pub rate_rad_s: Vector3<f64>,
    /// Acceleration of the shell's origin, world axes, m/s².
    pub acceleration_m_s2: Vector3<f64>,
    /// Angular acceleration, shell axes, rad/s².
    pub angular_rad_s2: Vector3<f64>,
}

/// What is believed of a state before anything is measured: a normal distribution in the tangent space.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// The mean.
    pub state: State,
    /// Inverse of the covariance; zero for what is not known at all.
    pub information: Matrix18,
}

impl State {
    /// At rest.
    pub fn still(world_from_shell: Isometry3<f64>) -> Self {
        let none = Vector3::zeros();
        Self {
            world_from_shell,
            velocity_m_s: none,
            rate_rad_s: none,
            acceleration_m_s2: none,
            angular_rad_s2: none,
        }
    }

    /// Where the origin is a short time later, or earlier.
    pub(super) fn position_after(&self, dt_s: f64) -> Vector3<f64> {
        let straight = self.world_from_shell.translation.vector + self.velocity_m_s * dt_s;
        straight + self.acceleration_m_s2 * (0.5 * dt_s * dt_s)
    }

    /// How the shell is turned a short time later, or earlier.
    pub(super) fn rotation_after(&self, dt_s: f64) -> UnitQuaternion<f64> {
        let turn = self.rate_rad_s * dt_s + self.angular_rad_s2 * (0.5 * dt_s * dt_s);
        self.world_from_shell.rotation * UnitQuaternion::from_scaled_axis(turn)
    }

    /// The pose a short time later, or earlier.
    pub fn pose_after(&self, dt_s: f64) -> Isometry3<f64> {
        Isometry3::from_parts(Translation3::from(self.position_after(dt_s)), self.rotation_after(dt_s))
    }

    /// Moves along a tangent.
    pub fn moved(&self, step: &Vector18) -> Self {
        let part = |first: usize| -> Vector3<f64> { step.fixed_rows::<3>(first).into() };
        Self {
            world_from_shell: Isometry3::from_parts(
                Translation3::from(self.world_from_shell.translation.vector + part(0)),
                self.world_from_shell.rotation * UnitQuaternion::from_scaled_axis(part(3)),
            ),
            velocity_m_s: self.velocity_m_s + part(6),
            rate_rad_s: self.rate_rad_s + part(9),
            acceleration_m_s2: self.acceleration_m_s2 + part(12),
            angular_rad_s2: self.angular_rad_s2 + part(15),
        }
    }

    /// The tangent along which [`State::moved`] leads to another state.
    pub fn step_to(&self, other: &Self) -> Vector18 {
        let (here, there) = (&self.world_from_shell, &other.world_from_shell);
        let parts = [
            there.translation.vector - here.translation.vector,
            (here.rotation.inverse() * there.rotation).scaled_axis(),
            other.velocity_m_s - self.velocity_m_s,
            other.rate_rad_s - self.rate_rad_s,
            other.acceleration_m_s2 - self.acceleration_m_s2,
            other.angular_rad_s2 - self.angular_rad_s2,
        ];
        Vector18::from_fn(|row, _| parts[row / 3][row % 3])
    }
}

impl Prior {
    /// Nothing is known of the pose but where to begin; the motion is an ordinary one.
    pub fn free(world_from_shell: Isometry3<f64>, settings: &SolverSettings) -> Self {
        let sigmas = [
            settings.free_speed_m_s,
            settings.free_rate_rad_s,
            settings.free_acceleration_m_s2,
            settings.free_angular_rad_s2,
        ];
        let mut information = Matrix18::zeros();
        for (k, sigma) in sigmas.into_iter().enumerate() {
            (0..3).for_each(|axis| information[(6 + 3 * k + axis, 6 + 3 * k + axis)] = sigma.powi(-2));
        }
        Self { state: State::still(world_from_shell), information }
    }

    /// eᵀ Λ e of a state, e being the step from the mean.
    pub fn distance2(&self, state: &State) -> f64 {
        let step = self.state.step_to(state);
        step.dot(&(self.information * step))
    }

    /// Hessian and gradient of half of [`Prior::distance2`] at a state.
    pub(super) fn linearized(&self, state: &State) -> (Matrix18, Vector18) {
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
