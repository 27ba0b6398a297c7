//! What a control step asks of the joints.

use nalgebra::{Vector3, Vector6};

use super::{ContactPoint, WbcStatus};
use crate::{
    joints::{JOINTS, JointVector},
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
    /// f_r: force of the ground on each point in the world, N; zero without contact.
    pub contact_force: [Vector3<f64>; ContactPoint::COUNT],
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
            contact_force: [Vector3::zeros(); ContactPoint::COUNT],
            torso_slack: Vector6::zeros(),
            status: WbcStatus::default(),
        }
    }

    /// Whether every number that goes to the joints is finite.
    pub fn is_finite(&self) -> bool {
        [&self.position, &self.velocity, &self.torque]
            .iter()
            .all(|vector| vector.iter().all(|entry| entry.is_finite()))
    }

    /// Cuts positions, velocities and torques to the joints' limits, and notes which.
    pub(super) fn limit(&mut self, model: &Model) {
        for joint in 0..JOINTS {
            let (speed, torque) = (model.max_velocity[joint], model.max_torque[joint]);
            let cut = [
                cut(&mut self.position[joint], model.lower[joint], model.upper[joint]),
                cut(&mut self.velocity[joint], -speed, speed),
                cut(&mut self.torque[joint], -torque, torque),
            ];
            if cut.contains(&true) {
                self.status.limited |= 1 << joint;
            }
        }
    }
}

/// Cuts a value to a range; whether it was outside. Leaves what is not a number.
fn cut(value: &mut f64, lower: f64, upper: f64) -> bool {
    let outside = *value < lower || *value > upper;
    if outside {
        *value = value.max(lower).min(upper);
    }
    outside
}
