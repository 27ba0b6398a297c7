//! What each body should do in one control step.

use nalgebra::{Isometry3, Vector3};

use super::{
    mode::Arms,
    table::{self, MAX_OBJECTIVES, Row},
};
use crate::{
    commander::{PoseReference, rebased_point},
    joints::{Leg, Side},
    locomotion::Steps,
    wbc::{ContactPoint, ContactSet, Objective, ObjectiveKind, PointReference, RotationReference},
};

/// References of all bodies, which of them are in force, and the feet that stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint {
    /// What is tracked.
    row: &'static Row,
    /// Torso in the world.
    pub torso: PoseReference,
    /// Feet in the world.
    feet: [PointReference; 4],
    /// Joints of legs.
    legs: [PointReference; 4],
    /// Grippers right, left in the world.
    grippers: [PoseReference; 2],
    /// Joints of the arms right, left.
    arms: [PointReference; 2],
    /// Feet that stand.
    pub contacts: ContactSet,
}

/// Objectives in order of priority.
#[derive(Debug, Clone, Copy)]
pub struct ObjectiveList {
    objectives: [Objective; MAX_OBJECTIVES],
    count: usize,
}

impl ObjectiveList {
    /// The most important first.
    pub fn as_slice(&self) -> &[Objective] {
        &self.objectives[..self.count]
    }
}

impl Setpoint {
    /// Four feet, arms held.
    pub fn standing(torso: &Isometry3<f64>, arms: [Vector3<f64>; 2]) -> Self {
        Self {
            row: &table::STANCE,
            torso: PoseReference::hold(torso),
            feet: [PointReference::hold(Vector3::zeros()); 4],
            legs: [PointReference::hold(Vector3::zeros()); 4],
            grippers: [PoseReference::hold(torso); 2],
            arms: arms.map(PointReference::hold),
            contacts: table::STANCE.contacts(),
        }
    }

    /// What is tracked.
    pub fn row(&self) -> &'static Row {
        self.row
    }

    /// Four feet are on the ground.
    pub fn stand(&mut self) {
        self.row = &table::STANCE;
    }

    /// A front foot is in the air, there; its arm has a posture of its own.
    pub fn lift(&mut self, side: Side, foot: PointReference) {
        self.row = &table::SINGLE_FOOT[side.index()];
        self.feet[side.leg().index()] = foot;
    }

    /// Leg and arm bring a gripper there.
    pub fn grasp(&mut self, side: Side, gripper: PoseReference) {
        self.row = &table::SINGLE_GRIPPER[side.index()];
        self.grippers[side.index()] = gripper;
    }

    /// The robot kneels: joints of the rear legs, of front legs in the air and of the arms are led.
    pub fn kneel(&mut self) {
        self.row = &table::KNEELING;
    }

    /// The joints of a leg, for when its posture is in force.
    pub fn hold_leg(&mut self, leg: Leg, posture: PointReference) {
        self.legs[leg.index()] = posture;
    }

    /// Where a foot in the air should be.
    pub fn lead_foot(&mut self, leg: Leg, foot: PointReference) {
        self.feet[leg.index()] = foot;
    }

    /// The robot is upright: its grippers are there; those of limbs that are led by foot and arm are not tracked.
    pub fn grasp_upright(&mut self, grippers: [PoseReference; 2], led: [bool; 2]) {
        self.row = table::bimanual(led);
        self.grippers = grippers;
    }

    /// The robot walks; grippers of these arms are turned.
    pub fn walk(&mut self, steps: &Steps, arms: Option<Arms>) {
        self.row = arms.map_or(&table::LOCOMOTION, table::loco_manipulation);
        self.torso = steps.torso;
        self.feet = steps.feet;
        self.contacts = steps.contacts;
    }

    /// How a gripper is turned, for when only that is in force.
    pub fn turn_gripper(&mut self, side: Side, rotation: RotationReference) {
        self.grippers[side.index()].rotation = rotation;
    }

    /// The joints of an arm, for when its posture is in force.
    pub fn hold_arm(&mut self, side: Side, posture: PointReference) {
        self.arms[side.index()] = posture;
    }

    /// Reference of a gripper that is tracked.
    pub fn gripper(&self, side: Side) -> Option<&PoseReference> {
        self.row.controls(ObjectiveKind::GripperPosition(side)).then_some(&self.grippers[side.index()])
    }

    /// Reference of a gripper's orientation that is tracked.
    pub fn gripper_rotation(&self, side: Side) -> Option<&RotationReference> {
        let kind = ObjectiveKind::GripperOrientation(side);
        self.row.controls(kind).then_some(&self.grippers[side.index()].rotation)
    }

    /// Reference of a foot that is tracked.
    pub fn foot(&self, leg: Leg) -> Option<&PointReference> {
        self.row.controls(ObjectiveKind::FootPosition(leg)).then_some(&self.feet[leg.index()])
    }

    /// Reference of an arm whose posture is held.
    pub fn arm(&self, side: Side) -> Option<&PointReference> {
        self.row.controls(ObjectiveKind::ArmPosture(side)).then_some(&self.arms[side.index()])
    }

    /// An objective with its reference.
    fn objective(&self, kind: ObjectiveKind) -> Objective {
        match kind {
            ObjectiveKind::TorsoPosition => Objective::TorsoPosition(self.torso.point),
            ObjectiveKind::TorsoOrientation => Objective::TorsoOrientation(self.torso.rotation),
            ObjectiveKind::FootPosition(leg) => Objective::FootPosition(leg, self.feet[leg.index()]),
            ObjectiveKind::GripperPosition(side) => {
                Objective::GripperPosition(side, self.grippers[side.index()].point)
            }
            ObjectiveKind::GripperOrientation(side) => {
                Objective::GripperOrientation(side, self.grippers[side.index()].rotation)
            }
            ObjectiveKind::LegPosture(leg) => Objective::LegPosture(leg, self.legs[leg.index()]),
            ObjectiveKind::ArmPosture(side) => Objective::ArmPosture(side, self.arms[side.index()]),
        }
    }

    /// A foot that stands is not moved, nor the joints of a front leg that does.
    fn is_in_force(&self, kind: ObjectiveKind) -> bool {
        match kind {
            ObjectiveKind::FootPosition(leg) => !self.contacts.contains(leg),
            ObjectiveKind::LegPosture(leg) => leg.side().is_none() || !self.contacts.contains(leg),
            _ => true,
        }
    }

    /// The row's objectives with their references.
    pub fn objectives(&self) -> ObjectiveList {
        let mut list = ObjectiveList {
            objectives: [Objective::TorsoPosition(self.torso.point); MAX_OBJECTIVES],
            count: 0,
        };
        let kinds = self.row.objectives.iter().filter(|kind| self.is_in_force(**kind));
        for (place, kind) in list.objectives.iter_mut().zip(kinds) {
            *place = self.objective(*kind);
            list.count += 1;
        }
        list
    }

    /// The same in another world.
    #[must_use]
    pub fn rebased(&self, new_from_old: &Isometry3<f64>) -> Self {
        Self {
            torso: self.torso.rebased(new_from_old),
            feet: self.feet.map(|foot| rebased_point(&foot, new_from_old)),
            grippers: self.grippers.map(|gripper| gripper.rebased(new_from_old)),
            ..*self
        }
    }

    /// Moves a foot's share of the load towards `share` by at most `step`.
    pub fn load(&mut self, leg: Leg, share: f64, step: f64) {
        self.load_point(ContactPoint::Foot(leg), share, step);
    }

    /// Moves a point's share of the load towards `share` by at most `step`.
    pub fn load_point(&mut self, point: ContactPoint, share: f64, step: f64) {
        let now = self.contacts.share_of(point);
        self.contacts = self.contacts.with(point, now + (share - now).clamp(-step, step));
    }
}
