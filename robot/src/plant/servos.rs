//! The arms' servos on their bus, as the arms' part of a robot on wires.

use super::{
    ArmServos, JointCommand,
    arms::{ARM_JOINTS, ArmSample},
};
use crate::servo::{Gripper, ServoDriver, ServoState, commands_of};

/// Arms and grippers behind a driver that runs.
#[derive(Debug)]
pub struct BusServos {
    driver: ServoDriver,
    gripper: Gripper,
}

impl BusServos {
    /// `gripper`: how the settings turn openings into angles.
    pub fn new(driver: ServoDriver, gripper: Gripper) -> Self {
        Self { driver, gripper }
    }
}

impl ArmServos for BusServos {
    fn exchange(&mut self, command: &JointCommand) -> ArmSample {
        self.driver.send(&commands_of(command, &self.gripper));
        let states = self.driver.latest();
        let joints = |of: fn(&ServoState) -> f64| std::array::from_fn(|joint| of(&states.servos[joint]));
        let opening = |side: usize| self.gripper.opening(states.servos[ARM_JOINTS + side].position_rad);
        ArmSample {
            position: joints(|servo| servo.position_rad),
            velocity: joints(|servo| servo.velocity_rad_s),
            torque: joints(|servo| servo.torque_n_m),
            opening: [opening(0), opening(1)],
            fault: states.fault() || !states.line_open,
            hottest_c: states.hottest_c(),
        }
    }
}
