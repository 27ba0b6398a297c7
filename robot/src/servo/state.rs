//! What goes to the servos and what comes back, in the terms of joints.

use super::{
    place::{Place, SERVOS},
    settings::Gripper,
    wire::HardwareError,
};
use crate::plant::JointCommand;

/// What one servo shall do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoCommand {
    /// Angle of the joint or of the jaws, rad.
    pub position_rad: f64,
    /// Its rate, rad/s; makes up for what the motor's own voltage costs.
    pub velocity_rad_s: f64,
    /// Torque that is needed beyond what the error of the angle gives, N m.
    pub torque_n_m: f64,
    /// Share of the current that the settings permit, 0 to 1; 0 lets go.
    pub effort: f64,
}

impl ServoCommand {
    /// Lets go.
    pub const RELEASED: Self = Self { position_rad: 0.0, velocity_rad_s: 0.0, torque_n_m: 0.0, effort: 0.0 };

    /// Goes to an angle and stays there.
    pub const fn at(position_rad: f64) -> Self {
        Self { position_rad, velocity_rad_s: 0.0, torque_n_m: 0.0, effort: 1.0 }
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        [self.position_rad, self.velocity_rad_s, self.torque_n_m, self.effort].iter().all(|x| x.is_finite())
    }
}

/// The servos' part of a joint command.
///
/// A servo has a loop of its own, so its command has no gains; only that of a damped robot has (`kd` without `kp`), and
/// it lets the arm go.
pub fn commands_of(command: &JointCommand, gripper: &Gripper) -> [ServoCommand; SERVOS] {
    /// The first servo's joint.
    const FIRST: usize = 12;
    let damped = |joint: usize| command.kp[joint] == 0.0 && command.kd[joint] > 0.0;
    let all_damped = (FIRST..FIRST + 6).all(damped);
    Place::ALL.map(|place| {
        if place.is_gripper() {
            let effort = if all_damped { 0.0 } else { 1.0 };
            return ServoCommand {
                effort,
                ..ServoCommand::at(gripper.angle_rad(command.opening[place.side.index()]))
            };
        }
        let joint = FIRST + place.index();
        ServoCommand {
            position_rad: command.position[joint],
            velocity_rad_s: command.velocity[joint],
            torque_n_m: command.torque[joint],
            effort: if damped(joint) { 0.0 } else { 1.0 },
        }
    })
}

impl Gripper {
    /// Jaw angle of an opening (0 closed, 1 open), rad.
    pub fn angle_rad(&self, opening: f64) -> f64 {
        self.closed_rad + opening.clamp(0.0, 1.0) * (self.open_rad - self.closed_rad)
    }

    /// Opening of a jaw angle: 0 closed, 1 open.
    pub fn opening(&self, angle_rad: f64) -> f64 {
        ((angle_rad - self.closed_rad) / (self.open_rad - self.closed_rad)).clamp(0.0, 1.0)
    }
}

/// What is known of one servo.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ServoState {
    /// Angle of the joint or of the jaws, rad.
    pub position_rad: f64,
    /// rad/s.
    pub velocity_rad_s: f64,
    /// Positive turns the joint the positive way, A.
    pub current_a: f64,
    /// What the current makes at standstill, N m.
    pub torque_n_m: f64,
    /// °C.
    pub temperature_c: f64,
    /// V.
    pub voltage_v: f64,
    /// What is wrong with it.
    pub error: HardwareError,
    /// When position, velocity and current came, ns of the monotonic clock; 0 for never.
    pub sample_ns: u64,
    /// Answers that did not come since the start.
    pub lost: u64,
    /// It answers and follows goals. One that is missing is looked for.
    pub present: bool,
}

/// What has gone over the line since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LineCounts {
    /// Cycles.
    pub cycles: u64,
    /// Cycles that began late by a whole period or more, or not at all.
    pub missed: u64,
    /// Answers that did not come, of all servos.
    pub lost: u64,
    /// Packets that came damaged.
    pub damaged: u64,
    /// Commands with numbers that are none.
    pub refused: u64,
    /// Times that the line was opened anew.
    pub reopened: u64,
    /// Times that a servo was set up anew.
    pub adopted: u64,
}

/// What is known of all servos, in the order of places.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ServoStates {
    /// Each servo.
    pub servos: [ServoState; SERVOS],
    /// End of the last cycle, ns of the monotonic clock.
    pub stamp_ns: u64,
    /// Whether the line is open.
    pub line_open: bool,
    /// What has gone over it.
    pub counts: LineCounts,
}

impl ServoStates {
    /// A servo's state.
    pub fn of(&self, place: Place) -> &ServoState {
        &self.servos[place.index()]
    }

    /// Places without a servo that follows goals.
    pub fn missing(&self) -> impl Iterator<Item = Place> {
        Place::ALL.into_iter().filter(|place| !self.of(*place).present)
    }

    /// Whether a servo is missing or has an error.
    pub fn fault(&self) -> bool {
        self.servos.iter().any(|servo| !servo.present || !servo.error.is_none())
    }

    /// The hottest servo, °C.
    pub fn hottest_c(&self) -> f64 {
        self.servos.iter().map(|servo| servo.temperature_c).fold(0.0, f64::max)
    }

    /// Age of the oldest sample of a servo that is present, ns; 0 if none is.
    pub fn age_ns(&self, now_ns: u64) -> u64 {
        let present = self.servos.iter().filter(|servo| servo.present);
        present.map(|servo| now_ns.saturating_sub(servo.sample_ns)).max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRIPPER: Gripper = Gripper { closed_rad: 0.02, open_rad: 0.7, lead_rad: 0.2 };

    #[test]
    fn a_damped_robot_lets_its_arms_go() {
        let released = commands_of(&JointCommand::damping(), &GRIPPER);
        assert!(released.iter().all(|command| command.effort == 0.0));
    }

    #[test]
    fn commands_stand_in_the_order_of_joints_and_openings() {
        let mut command = JointCommand::damping();
        command.kd.fill(0.0);
        for joint in 12..18 {
            command.position[joint] = joint as f64;
        }
        command.opening = [1.0, 0.0];
        let positions = commands_of(&command, &GRIPPER).map(|command| command.position_rad);
        assert_eq!(positions, [12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 0.7, 0.02]);
        assert!((GRIPPER.opening(0.36) - 0.5).abs() < 1e-12);
    }
}
