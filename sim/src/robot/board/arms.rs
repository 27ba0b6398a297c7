//! The virtual robot's arms: on their own bus of virtual servos, or held where they are.

use locoman_robot::plant::JointCommand;
use locoman_robot::servo::{Gripper, Place, SERVOS};

use crate::robot::machine::SimRobot;
use crate::servo_bus::{JointMotion, ServoGoal, VirtualBus};

/// The first servo's joint.
const FIRST: usize = 12;
/// Resistance of a joint whose servo gives no torque, N m s/rad: its gears.
const LIMP_KD: f64 = 0.1;

/// Who says what the arms do.
pub enum VirtualArms {
    /// Nobody: they hold this.
    Held(Box<JointCommand>),
    /// Eight servos on their bus.
    Bus {
        /// The bus.
        bus: VirtualBus,
        /// From a jaw's angle to an opening.
        gripper: Gripper,
    },
}

impl VirtualArms {
    /// Tells the servos what their joints do, and returns the arms' part of a command as they have it from their bus.
    pub fn command(&self, robot: &SimRobot) -> JointCommand {
        match self {
            Self::Held(held) => **held,
            Self::Bus { bus, gripper } => {
                let motions = robot.servo_motions();
                bus.feed(&motions);
                told(&bus.goals(), &motions, gripper)
            }
        }
    }
}

fn told(goals: &[ServoGoal; SERVOS], motions: &[JointMotion; SERVOS], gripper: &Gripper) -> JointCommand {
    let mut command = JointCommand::damping();
    for place in Place::ALL {
        let (goal, motion) = (goals[place.index()], motions[place.index()]);
        let limp = goal.current_a == 0.0;
        let position_rad = if limp { motion.position_rad } else { goal.position_rad };
        if place.is_gripper() {
            command.opening[place.side.index()] = gripper.opening(position_rad);
        } else {
            let joint = FIRST + place.index();
            command.position[joint] = position_rad;
            // Zero gains: the servos hold with their own.
            command.kd[joint] = if limp { LIMP_KD } else { 0.0 };
        }
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn servos_with_torque_hold_their_goals_and_the_others_are_limp() {
        let gripper = Gripper { closed_rad: 0.02, open_rad: 0.7, lead_rad: 0.2 };
        let mut goals = [ServoGoal { position_rad: 0.36, current_a: 0.9 }; SERVOS];
        goals[1].current_a = 0.0;
        let command = told(&goals, &[JointMotion::default(); SERVOS], &gripper);
        assert_eq!((command.position[FIRST], command.kd[FIRST], command.kp[FIRST]), (0.36, 0.0, 0.0));
        assert_eq!((command.position[FIRST + 1], command.kd[FIRST + 1]), (0.0, LIMP_KD));
        assert!((command.opening[0] - 0.5).abs() < 1e-12 && (command.opening[1] - 0.5).abs() < 1e-12);
    }
}
