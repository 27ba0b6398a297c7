//! The boundary to the robot: what the controller sends and what it gets back.
//!
//! A plant runs the joint law `tau = tau_ff + kp (q_des - q) + kd (dq_des - dq)` by itself, at 2 kHz or
//! more, as the Go1's motor boards do, and keeps the last command until it gets another.

pub mod arms;
mod go1;
mod health;
pub mod preflight;
mod servos;
mod sim;
pub mod wire;

pub use arms::ArmServos;
pub use go1::Go1Plant;
pub use health::{Health, SustainedPower};
use serde::{Deserialize, Serialize};
pub use servos::BusServos;
pub use sim::SimPlant;

use crate::joints::{JOINTS, JointVector};

/// Set-points for every joint and both grippers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct JointCommand {
    /// Desired positions, rad.
    pub position: JointVector,
    /// Desired velocities, rad/s.
    pub velocity: JointVector,
    /// Feed-forward torques, N m.
    pub torque: JointVector,
    /// Position gains, N m/rad.
    pub kp: JointVector,
    /// Velocity gains, N m s/rad.
    pub kd: JointVector,
    /// Gripper openings right, left: 0 closed, 1 open.
    pub opening: [f64; 2],
}

impl JointCommand {
    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        [&self.position, &self.velocity, &self.torque, &self.kp, &self.kd]
            .into_iter()
            .all(|vector| vector.iter().all(|x| x.is_finite()))
            && self.opening.iter().all(|x| x.is_finite())
    }

    /// Soft damping: no position control, velocity driven to zero.
    pub fn damping() -> Self {
        /// N m s/rad: the Go1's own soft damping (facts/hardware.md 1.8: 2 to 4).
        const LEG_KD: f64 = 3.0;
        /// N m s/rad, about what the servos' own loop gives.
        const ARM_KD: f64 = 0.1;
        let mut kd = JointVector::repeat(LEG_KD);
        kd.rows_mut(12, JOINTS - 12).fill(ARM_KD);
        Self {
            position: JointVector::zeros(),
            velocity: JointVector::zeros(),
            torque: JointVector::zeros(),
            kp: JointVector::zeros(),
            kd,
            opening: [0.0; 2],
        }
    }
}

/// Everything that the robot measures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sensors {
    /// When it was measured: this machine's monotonic clock, or simulated time in lockstep, ns.
    pub time_ns: u64,
    /// Joint positions, rad.
    pub position: JointVector,
    /// Joint velocities, rad/s.
    pub velocity: JointVector,
    /// Joint torques as the drives estimate them, N m.
    pub torque: JointVector,
    /// Measured gripper openings right, left: 0 closed, 1 open.
    pub opening: [f64; 2],
    /// Attitude of the trunk, w, x, y, z (yaw drifts).
    pub attitude: [f64; 4],
    /// Angular velocity of the trunk in its own frame, rad/s.
    pub gyro: [f64; 3],
    /// Specific force in the trunk's frame, m/s2 (+9.81 on z at rest).
    pub accelerometer: [f64; 3],
    /// Vertical force of each foot, N.
    pub foot_force: [f64; 4],
}

impl Sensors {
    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let vectors = [&self.position, &self.velocity, &self.torque];
        let arrays: [&[f64]; 5] =
            [&self.opening, &self.attitude, &self.gyro, &self.accelerometer, &self.foot_force];
        vectors.into_iter().all(|vector| vector.iter().all(|x| x.is_finite()))
            && arrays.into_iter().flatten().all(|x| x.is_finite())
    }
}

/// Why a plant could not exchange.
#[derive(Debug, thiserror::Error)]
pub enum PlantError {
    /// No sample came in time.
    #[error("no state from the robot for {waited_ms} ms")]
    Silent {
        /// How long was waited.
        waited_ms: u64,
    },
    /// The connection itself failed.
    #[error("robot connection: {0}")]
    Io(#[from] std::io::Error),
}

/// A robot, real or simulated.
pub trait Plant {
    /// Sends the command and waits for the sensors of the next control period.
    ///
    /// In lockstep the plant advances by exactly one control period; on a wire this paces the caller.
    /// On an error the plant keeps its last command, and `exchange` may be called again.
    fn exchange(&mut self, command: &JointCommand) -> Result<Sensors, PlantError>;

    /// What the robot said of itself at the last exchange. One that says nothing is taken to be well.
    fn health(&self) -> Health {
        Health::default()
    }
}
