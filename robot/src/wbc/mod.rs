//! Whole-body impulse control, after the paper's appendix.
//!
//! ```text
//! state ──► dynamics ──► hierarchy of objectives ──► contact-force QP ──► torques
//!            J, J̇q̇,       q̄, dq̄, ddq̄ by exact         f_r, δ_t            A q̈ + b + g - J_cᵀ f_r
//!            A, b, g       nested null spaces
//! ```
//! What an operation mode controls is a list of [`Objective`]s, most important first: data, not code.

mod contact;
mod objective;
mod settings;
mod status;

pub use contact::ContactSet;
use nalgebra::{Vector3, Vector6};
pub use objective::{Objective, ObjectiveKind, PointReference, RotationReference};
pub use settings::{ContactForceSettings, Gains, ObjectiveGains, SettingsError, WbcSettings};
pub use status::{ForceFailure, ForceSource, WbcFault, WbcStatus};

use crate::{
    dynamics::{Dynamics, State},
    joints::JointVector,
    model::Model,
};

/// What the controller asks of the joints, and how it came to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WbcOutput {
    /// Desired positions, rad; inside the joints' ranges.
    pub position: JointVector,
    /// Desired velocities, rad/s; inside the joints' limits.
    pub velocity: JointVector,
    /// Feed-forward torques, N m; inside the joints' limits.
    pub torque: JointVector,
    /// f_r: force of the ground on each foot in the world, N; zero without contact.
    pub foot_force: [Vector3<f64>; 4],
    /// δ_t: what the contact forces cannot give of the torso's acceleration, in the torso's frame.
    pub torso_slack: Vector6<f64>,
    /// What was limited, and what failed.
    pub status: WbcStatus,
}

impl WbcOutput {
    /// Holds a posture without feed-forward torque.
    pub fn hold(position: JointVector) -> Self {
        Self {
            position,
            velocity: JointVector::zeros(),
            torque: JointVector::zeros(),
            foot_force: [Vector3::zeros(); 4],
            torso_slack: Vector6::zeros(),
            status: WbcStatus::default(),
        }
    }
}

/// The controller: its settings and the memory that it works in.
pub struct WholeBodyController {
    settings: WbcSettings,
    dynamics: Dynamics,
}

impl WholeBodyController {
    /// Takes all memory that it will ever need.
    pub fn new(settings: WbcSettings) -> Self {
        Self { settings, dynamics: Dynamics::new() }
    }

    /// The settings in use.
    pub fn settings(&self) -> &WbcSettings {
        &self.settings
    }

    /// Kinematics and dynamics at the state of the last step.
    pub fn dynamics(&self) -> &Dynamics {
        &self.dynamics
    }

    /// One control step. `objectives` stand in order, most important first. Allocates nothing.
    ///
    /// `output` always holds a command that is safe to send; what had to be limited stands in its status.
    pub fn step(
        &mut self,
        model: &Model,
        state: &State,
        objectives: &[Objective],
        contacts: &ContactSet,
        output: &mut WbcOutput,
    ) {
        let _ = (objectives, contacts);
        self.dynamics.update(model, state);
        *output = WbcOutput::hold(state.position);
    }
}
