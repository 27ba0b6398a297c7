//! The robot as numbers: a torso and 18 joints, read from `configs/robot/`.
//!
//! ```text
//! torso ─┬─ FR hip ─ thigh ─ calf (foot) ─ right arm 1 ─ 2 ─ 3 (gripper)
//!        ├─ FL hip ─ thigh ─ calf (foot) ─ left arm 1 ─ 2 ─ 3 (gripper)
//!        ├─ RR hip ─ thigh ─ calf (foot)
//!        └─ RL hip ─ thigh ─ calf (foot)
//! ```
//! Links on fixed joints are merged into their parents, so that exactly one body moves with each joint.
//! The tree's shape is fixed (it is what makes the dynamics fast); every number comes from the file.

mod body;
mod drives;
mod error;
mod frame;
mod tree;
mod urdf;

use std::path::Path;

pub use body::RigidBody;
pub(crate) use body::point_inertia;
pub use drives::Drives;
pub use error::ModelError;
pub use frame::{FOOT_RADIUS_M, Frame, KNEE_RADIUS_M};
use nalgebra::{Isometry3, Unit, Vector3};
pub use tree::{JOINT_NAMES, PARENT};

use crate::{
    collision::CollisionModel,
    joints::{JOINTS, JointVector, Leg, Side},
};

/// Standard gravity as the golden figures and the simulator take it, m/s².
pub const GRAVITY: f64 = 9.81;

/// A joint and the body that it carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// Pose of the joint's frame in the parent body's frame at angle zero.
    pub parent_from_joint: Isometry3<f64>,
    /// Axis of rotation, in the joint's frame.
    pub axis: Unit<Vector3<f64>>,
    /// What moves with it (the inertia of all links merged), in the joint's frame.
    pub body: RigidBody,
}

/// Masses, geometry and limits of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The floating body.
    pub torso: RigidBody,
    /// In the order of [`crate::joints`].
    pub joints: [Joint; JOINTS],
    /// Lower ends of the joints' ranges, rad.
    pub lower: JointVector,
    /// Upper ends of the joints' ranges, rad.
    pub upper: JointVector,
    /// Greatest joint speeds, rad/s.
    pub max_velocity: JointVector,
    /// Greatest joint torques, N m.
    pub max_torque: JointVector,
    /// Rotor inertia reflected through the gear, kg m²: added on the diagonal of the mass matrix.
    pub armature: JointVector,
    /// Capsules on the links, for keeping the robot off itself.
    pub collision: CollisionModel,
    calf_from_foot: [Isometry3<f64>; 4],
    hand_from_gripper: [Isometry3<f64>; 2],
}

impl Model {
    /// Reads `locoman.urdf`, `drives.toml` and `collision.toml` from a folder (`configs/robot`).
    pub fn load(folder: &Path) -> Result<Self, ModelError> {
        let mut model = Self::from_urdf(&folder.join("locoman.urdf"))?;
        model.armature = Drives::load(&folder.join("drives.toml"))?.armature();
        model.collision = CollisionModel::load(&folder.join("collision.toml"))?;
        Ok(model)
    }

    /// Reads a URDF alone: no reflected rotor inertia, no shapes.
    pub fn from_urdf(path: &Path) -> Result<Self, ModelError> {
        urdf::read(path)
    }

    /// Mass of everything, kg.
    pub fn mass(&self) -> f64 {
        self.torso.mass + self.joints.iter().map(|joint| joint.body.mass).sum::<f64>()
    }

    /// Pose of the foot (centre of its sphere) in the calf's frame.
    pub fn calf_from_foot(&self, leg: Leg) -> &Isometry3<f64> {
        &self.calf_from_foot[leg.index()]
    }

    /// Pose of the gripper (grasp centre, -z points out) in the frame of the arm's last joint.
    pub fn hand_from_gripper(&self, side: Side) -> &Isometry3<f64> {
        &self.hand_from_gripper[side.index()]
    }
}

/// The robot of this repository, for unit tests.
#[cfg(test)]
pub(crate) fn test_model() -> Model {
    Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/robot")).unwrap()
}
