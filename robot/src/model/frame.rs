//! The frames whose motion the controller commands.

use nalgebra::Isometry3;

use super::Model;
use crate::joints::{Leg, Side};

/// Radius of a foot's sphere, m: a foot that stands has its centre so far above the ground, and one that turns rolls
/// with it. From the URDF; the calf's mesh ends in 0.0223 and MuJoCo Menagerie's Go1 has 0.023.
pub const FOOT_RADIUS_M: f64 = 0.02;

/// Height of a rear knee's joint above the ground on which the shank lies, m: the lowest point of thigh and calf there, by
/// the shapes fitted to their meshes.
pub const KNEE_RADIUS_M: f64 = 0.0195;

/// A frame fixed to a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Frame {
    /// The torso: x forward, y left, z up.
    Torso,
    /// A foot: centre of its sphere, axes of the calf.
    Foot(Leg),
    /// The knee of the rear leg of this side: centre of its joint, axes of the calf.
    Knee(Side),
    /// A gripper: grasp centre, -z out of the gripper.
    Gripper(Side),
}

impl Frame {
    /// How many there are.
    pub const COUNT: usize = 9;

    /// All frames, in the order of [`Self::index`].
    pub const ALL: [Self; Self::COUNT] = [
        Self::Torso,
        Self::Foot(Leg::FrontRight),
        Self::Foot(Leg::FrontLeft),
        Self::Foot(Leg::RearRight),
        Self::Foot(Leg::RearLeft),
        Self::Gripper(Side::Right),
        Self::Gripper(Side::Left),
        Self::Knee(Side::Right),
        Self::Knee(Side::Left),
    ];

    /// Place in arrays of [`Self::COUNT`].
    pub const fn index(self) -> usize {
        match self {
            Self::Torso => 0,
            Self::Foot(leg) => 1 + leg.index(),
            Self::Gripper(side) => 5 + side.index(),
            Self::Knee(side) => 7 + side.index(),
        }
    }

    /// The joint whose body carries it, or nothing for the torso.
    pub const fn joint(self) -> Option<usize> {
        match self {
            Self::Torso => None,
            Self::Foot(leg) => Some(leg.first_joint() + 2),
            Self::Knee(side) => Some(side.rear_leg().first_joint() + 2),
            Self::Gripper(side) => Some(side.first_arm_joint() + 2),
        }
    }

    /// Its pose in the frame of the body that carries it.
    pub(crate) fn body_from_frame(self, model: &Model) -> Isometry3<f64> {
        match self {
            Self::Torso | Self::Knee(_) => Isometry3::identity(),
            Self::Foot(leg) => *model.calf_from_foot(leg),
            Self::Gripper(side) => *model.hand_from_gripper(side),
        }
    }
}
