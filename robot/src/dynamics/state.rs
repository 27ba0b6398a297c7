//! Where the robot is and how it moves.

use nalgebra::{Isometry3, Vector6};

use super::Motion;
use crate::joints::JointVector;

/// State of torso and joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Pose of the torso in the world.
    pub world_from_torso: Isometry3<f64>,
    /// Velocity of the torso's origin (3), then its angular velocity (3), in the torso's frame.
    pub torso_twist: Vector6<f64>,
    /// Joint positions, rad.
    pub position: JointVector,
    /// Joint velocities, rad/s.
    pub velocity: JointVector,
}

impl State {
    /// At rest, torso at the world's origin.
    pub fn at_rest(position: JointVector) -> Self {
        Self {
            world_from_torso: Isometry3::identity(),
            torso_twist: Vector6::zeros(),
            position,
            velocity: JointVector::zeros(),
        }
    }

    /// v: the torso's twist, then the joint velocities.
    pub fn motion(&self) -> Motion {
        let mut motion = Motion::zeros();
        motion.fixed_rows_mut::<6>(0).copy_from(&self.torso_twist);
        motion.fixed_rows_mut::<{ crate::joints::JOINTS }>(6).copy_from(&self.velocity);
        motion
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let pose = &self.world_from_torso;
        pose.translation.vector.iter().all(|x| x.is_finite())
            && pose.rotation.coords.iter().all(|x| x.is_finite())
            && self.torso_twist.iter().all(|x| x.is_finite())
            && self.position.iter().all(|x| x.is_finite())
            && self.velocity.iter().all(|x| x.is_finite())
    }
}
