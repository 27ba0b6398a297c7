//! The arms' and grippers' part of a robot on wires: servos on a bus of their own, beside the legs' line.

use super::JointCommand;
use crate::modes::PoseSettings;

/// Joints of both arms.
pub const ARM_JOINTS: usize = 6;

/// What the servos say. Joints in the order of [`crate::joints`]: right arm, left arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmSample {
    /// rad.
    pub position: [f64; ARM_JOINTS],
    /// rad/s.
    pub velocity: [f64; ARM_JOINTS],
    /// N m, by the servos' currents.
    pub torque: [f64; ARM_JOINTS],
    /// Openings right, left: 0 closed, 1 open.
    pub opening: [f64; 2],
    /// A servo has an error, or does not answer.
    pub fault: bool,
    /// The hottest servo, °C.
    pub hottest_c: f64,
}

/// The servos of arms and grippers.
pub trait ArmServos: Send {
    /// Hands the arms' part of a command over and returns the newest sample. Never waits.
    fn exchange(&mut self, command: &JointCommand) -> ArmSample;
}

/// Arms that nobody drives: folded up along their calves, where they stay.
#[derive(Debug, Clone, Copy)]
pub struct FoldedArms {
    sample: ArmSample,
}

impl FoldedArms {
    /// Folded as the poses of `control.toml` say.
    pub fn new(poses: &PoseSettings) -> Self {
        let posture = poses.posture(&poses.fold_rad);
        let sample = ArmSample {
            position: std::array::from_fn(|joint| posture[12 + joint]),
            velocity: [0.0; ARM_JOINTS],
            torque: [0.0; ARM_JOINTS],
            opening: [0.0; 2],
            fault: false,
            hottest_c: 30.0,
        };
        Self { sample }
    }
}

impl ArmServos for FoldedArms {
    fn exchange(&mut self, _: &JointCommand) -> ArmSample {
        self.sample
    }
}
