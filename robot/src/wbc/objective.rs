//! What can be controlled, and the references that say where it should be.
//!
//! A list of [`Objective`]s is plain data; what one of them means to the hierarchy, its [`Track`]er knows. A
//! new kind is a variant here and, where none of the trackers fits, a file beside them.

mod frame_orientation;
mod frame_position;
mod posture;

use nalgebra::{UnitQuaternion, Vector3};

use self::{frame_orientation::FrameOrientation, frame_position::FramePosition, posture::Posture};
use super::{Gains, task::Task};
use crate::{
    dynamics::{Dynamics, State},
    joints::{Leg, Side},
    model::Frame,
};

/// The robot as an objective looks at it.
#[derive(Clone, Copy)]
pub(super) struct Robot<'a> {
    /// Where it is.
    pub(super) state: &'a State,
    /// Kinematics and dynamics there.
    pub(super) dynamics: &'a Dynamics,
}

/// Something that is to be somewhere and to move somehow, as the hierarchy takes it.
pub(super) trait Track {
    /// J, x̄ - x, the desired velocity, and the acceleration command with these gains.
    fn task(&self, robot: &Robot<'_>, gains: &Gains) -> Task;
}

/// A desired point and its motion: in the world, or the three joints of an arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointReference {
    /// m, or rad for joints.
    pub position: Vector3<f64>,
    /// m/s, or rad/s.
    pub velocity: Vector3<f64>,
    /// m/s², or rad/s².
    pub acceleration: Vector3<f64>,
}

impl PointReference {
    /// Stay there.
    pub fn hold(position: Vector3<f64>) -> Self {
        Self { position, velocity: Vector3::zeros(), acceleration: Vector3::zeros() }
    }
}

/// A desired orientation in the world and its motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotationReference {
    /// World from the controlled frame.
    pub orientation: UnitQuaternion<f64>,
    /// In the world, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// In the world, rad/s².
    pub angular_acceleration: Vector3<f64>,
}

impl RotationReference {
    /// Stay so.
    pub fn hold(orientation: UnitQuaternion<f64>) -> Self {
        Self { orientation, angular_velocity: Vector3::zeros(), angular_acceleration: Vector3::zeros() }
    }
}

/// Something to be tracked, with its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Objective {
    /// The torso's origin in the world.
    TorsoPosition(PointReference),
    /// The torso's orientation in the world.
    TorsoOrientation(RotationReference),
    /// A foot in the world.
    FootPosition(Leg, PointReference),
    /// A gripper's grasp centre in the world.
    GripperPosition(Side, PointReference),
    /// A gripper's orientation in the world.
    GripperOrientation(Side, RotationReference),
    /// The three joints of a leg.
    LegPosture(Leg, PointReference),
    /// The three joints of an arm. A stowed arm is held so, which no stance leg can feel.
    ArmPosture(Side, PointReference),
}

/// What an [`Objective`] controls, without its reference: the rows of a mode's table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ObjectiveKind {
    /// See [`Objective::TorsoPosition`].
    TorsoPosition,
    /// See [`Objective::TorsoOrientation`].
    TorsoOrientation,
    /// See [`Objective::FootPosition`].
    FootPosition(Leg),
    /// See [`Objective::GripperPosition`].
    GripperPosition(Side),
    /// See [`Objective::GripperOrientation`].
    GripperOrientation(Side),
    /// See [`Objective::LegPosture`].
    LegPosture(Leg),
    /// See [`Objective::ArmPosture`].
    ArmPosture(Side),
}

impl ObjectiveKind {
    /// Whether it moves the torso, through the legs that stand.
    pub(super) const fn is_of_torso(self) -> bool {
        matches!(self, Self::TorsoPosition | Self::TorsoOrientation)
    }
}

impl Objective {
    /// What it controls.
    pub const fn kind(&self) -> ObjectiveKind {
        match self {
            Self::TorsoPosition(_) => ObjectiveKind::TorsoPosition,
            Self::TorsoOrientation(_) => ObjectiveKind::TorsoOrientation,
            Self::FootPosition(leg, _) => ObjectiveKind::FootPosition(*leg),
            Self::GripperPosition(side, _) => ObjectiveKind::GripperPosition(*side),
            Self::GripperOrientation(side, _) => ObjectiveKind::GripperOrientation(*side),
            Self::LegPosture(leg, _) => ObjectiveKind::LegPosture(*leg),
            Self::ArmPosture(side, _) => ObjectiveKind::ArmPosture(*side),
        }
    }
    /// Its task; nothing if its reference holds a number that is not finite.
    pub(super) fn task(&self, robot: &Robot<'_>, gains: &Gains) -> Option<Task> {
        let point = |frame, reference| FramePosition { frame, reference }.task(robot, gains);
        let rotation = |frame, reference| FrameOrientation { frame, reference }.task(robot, gains);
        let posture = |first, reference| Posture { first, reference }.task(robot, gains);
        let task = match self {
            Self::TorsoPosition(reference) => point(Frame::Torso, reference),
            Self::TorsoOrientation(reference) => rotation(Frame::Torso, reference),
            Self::FootPosition(leg, reference) => point(Frame::Foot(*leg), reference),
            Self::GripperPosition(side, reference) => point(Frame::Gripper(*side), reference),
            Self::GripperOrientation(side, reference) => rotation(Frame::Gripper(*side), reference),
            Self::LegPosture(leg, reference) => posture(leg.first_joint(), reference),
            Self::ArmPosture(side, reference) => posture(side.first_arm_joint(), reference),
        };
        task.is_finite().then_some(task)
    }
}
