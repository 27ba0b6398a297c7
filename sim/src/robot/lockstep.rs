//! The simulated robot in lockstep: as fast as it goes, and the same bits from the same seed.

use std::path::Path;

use locoman_robot::plant::{JointCommand, Plant, PlantError, Sensors};

use super::SimRobotError;
use super::disturbance::Disturbance;
use super::machine::{Options, SimRobot};
use super::world::Truth;

/// A plant that advances by 2.5 ms of simulated time at each exchange. Its clock starts at 0.
#[derive(Debug)]
pub struct LockstepPlant {
    robot: SimRobot,
}

impl LockstepPlant {
    /// Builds the robot of a configuration folder.
    pub fn new(configs: &Path, options: &Options) -> Result<Self, SimRobotError> {
        Ok(Self { robot: SimRobot::new(configs, options)? })
    }

    /// Everything, exact, at the time of the last sensors.
    pub fn truth(&mut self) -> Truth {
        self.robot.truth()
    }

    /// Starts again from a posture of the scene file (`lying`, `standing`): the same as a new plant.
    pub fn reset(&mut self, posture: &str) -> Result<(), SimRobotError> {
        self.robot.reset(posture)
    }

    /// Disturbs the robot from now on.
    pub fn disturb(&mut self, disturbance: &Disturbance) -> Result<(), SimRobotError> {
        self.robot.disturb(disturbance)
    }

    /// The machine itself.
    pub fn robot_mut(&mut self) -> &mut SimRobot {
        &mut self.robot
    }
}

impl Plant for LockstepPlant {
    fn exchange(&mut self, command: &JointCommand) -> Result<Sensors, PlantError> {
        self.robot.send(command, 0);
        self.robot.advance().map_err(|error| PlantError::Io(std::io::Error::other(error)))
    }
}
