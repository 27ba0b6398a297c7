//! Names and shape of the kinematic tree, in the order of [`crate::joints`].

use crate::joints::JOINTS;

/// The URDF's names of the joints.
pub const JOINT_NAMES: [&str; JOINTS] = [
    "1_FR_hip_joint",
    "1_FR_thigh_joint",
    "1_FR_calf_joint",
    "2_FL_hip_joint",
    "2_FL_thigh_joint",
    "2_FL_calf_joint",
    "3_RR_hip_joint",
    "3_RR_thigh_joint",
    "3_RR_calf_joint",
    "4_RL_hip_joint",
    "4_RL_thigh_joint",
    "4_RL_calf_joint",
    "1_FR_joint_1",
    "1_FR_joint_2",
    "1_FR_joint_3",
    "2_FL_joint_1",
    "2_FL_joint_2",
    "2_FL_joint_3",
];

/// The joint before each joint; nothing where the torso comes before. A parent's index is always lower.
pub const PARENT: [Option<usize>; JOINTS] = [
    None,
    Some(0),
    Some(1),
    None,
    Some(3),
    Some(4),
    None,
    Some(6),
    Some(7),
    None,
    Some(9),
    Some(10),
    Some(2),
    Some(12),
    Some(13),
    Some(5),
    Some(15),
    Some(16),
];

/// Links that carry the frames which the controller commands: feet, then grippers.
pub(super) const FOOT_LINKS: [&str; 4] = ["1_FR_foot", "2_FL_foot", "3_RR_foot", "4_RL_foot"];
/// See [`FOOT_LINKS`].
pub(super) const GRIPPER_LINKS: [&str; 2] = ["1_FR_eef", "2_FL_eef"];
/// The link that is the torso.
pub(super) const TORSO_LINK: &str = "trunk";
