//! Kinematics and dynamics of the floating-base robot.
//!
//! Everything that depends on the state is computed at once by [`Dynamics::update`], into memory that is
//! taken once. The velocity is v = (linear velocity of the torso's origin, angular velocity of the torso,
//! both in the torso's frame; 18 joint velocities), and an acceleration is dv/dt in the same sense.

mod state;

use nalgebra::{Isometry3, SMatrix, SVector, Vector3};
pub use state::State;

use crate::{joints::JOINTS, model::Frame, model::Model};

/// Velocity degrees of freedom: six of the torso, then the joints.
pub const DOF: usize = 6 + JOINTS;
/// One number for each degree of freedom.
pub type Motion = SVector<f64, DOF>;
/// Inertia of the whole robot in joint space.
pub type MassMatrix = SMatrix<f64, DOF, DOF>;
/// Linear, then angular velocity of a frame's origin along the world's axes, from v.
pub type Jacobian = SMatrix<f64, 6, DOF>;

/// Where a frame is and how it moves with v.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameMotion {
    /// Pose in the world.
    pub world_from_frame: Isometry3<f64>,
    /// J: linear (3) then angular (3) rows, along the world's axes at the frame's origin.
    pub jacobian: Jacobian,
    /// J v.
    pub velocity: SVector<f64, 6>,
    /// J̇ v: acceleration of the frame's origin, and angular acceleration, when dv/dt = 0.
    pub bias_acceleration: SVector<f64, 6>,
}

/// Everything that the controller needs to know of a model in a state.
#[derive(Debug, Clone)]
pub struct Dynamics {
    frames: [FrameMotion; Frame::COUNT],
    mass_matrix: MassMatrix,
    bias: Motion,
    gravity: Motion,
    com: Vector3<f64>,
}

impl Default for Dynamics {
    fn default() -> Self {
        Self::new()
    }
}

impl Dynamics {
    /// An empty workspace: call [`Self::update`] before reading anything.
    pub fn new() -> Self {
        let at_rest = FrameMotion {
            world_from_frame: Isometry3::identity(),
            jacobian: Jacobian::zeros(),
            velocity: SVector::zeros(),
            bias_acceleration: SVector::zeros(),
        };
        Self {
            frames: std::array::from_fn(|_| at_rest.clone()),
            mass_matrix: MassMatrix::zeros(),
            bias: Motion::zeros(),
            gravity: Motion::zeros(),
            com: Vector3::zeros(),
        }
    }

    /// Computes everything for a state. Allocates nothing.
    pub fn update(&mut self, _model: &Model, _state: &State) {}

    /// A frame's pose, Jacobian and bias acceleration.
    pub fn frame(&self, frame: Frame) -> &FrameMotion {
        &self.frames[frame.index()]
    }

    /// A(q), with the rotors' reflected inertia on its diagonal.
    pub fn mass_matrix(&self) -> &MassMatrix {
        &self.mass_matrix
    }

    /// b(q, v) + g(q): Coriolis, centrifugal and gravity forces.
    pub fn bias(&self) -> &Motion {
        &self.bias
    }

    /// g(q): the forces that hold the robot at rest against gravity.
    pub fn gravity(&self) -> &Motion {
        &self.gravity
    }

    /// Centre of mass in the world, m.
    pub fn com(&self) -> &Vector3<f64> {
        &self.com
    }

    /// A a + b + g: the forces on torso and joints that make the acceleration `a`.
    pub fn inverse_dynamics(&self, acceleration: &Motion) -> Motion {
        self.mass_matrix * acceleration + self.bias
    }
}
