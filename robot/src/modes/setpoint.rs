//! What each body should do in one control step.

use nalgebra::{Isometry3, Vector3};

use crate::{
    commander::{PoseReference, rebased_point},
    joints::{Leg, Side},
    wbc::{ContactSet, Objective, PointReference},
};

/// What an arm and its leg, if that is in the air, are for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ArmGoal {
    /// Keep these joint angles.
    Posture(PointReference),
    /// Keep these joint angles; the foot is in the air, at this place in the world.
    PostureAndFoot(PointReference, PointReference),
    /// Bring the gripper there, with leg and arm.
    Gripper(PoseReference),
}

/// References of torso, feet and arms in the world, and the feet that stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint {
    /// Torso.
    pub torso: PoseReference,
    /// Arms right, left.
    pub arms: [ArmGoal; 2],
    /// Feet that stand.
    pub contacts: ContactSet,
}

/// The most objectives that a set-point makes.
pub const MAX_OBJECTIVES: usize = 6;

/// Objectives in order of priority.
#[derive(Debug, Clone, Copy)]
pub struct ObjectiveList {
    objectives: [Objective; MAX_OBJECTIVES],
    count: usize,
}

impl ObjectiveList {
    fn new() -> Self {
        let filler = Objective::TorsoPosition(PointReference::hold(Vector3::zeros()));
        Self { objectives: [filler; MAX_OBJECTIVES], count: 0 }
    }

    fn push(&mut self, objective: Objective) {
        if let Some(place) = self.objectives.get_mut(self.count) {
            *place = objective;
            self.count += 1;
        }
    }

    /// The most important first.
    pub fn as_slice(&self) -> &[Objective] {
        &self.objectives[..self.count]
    }
}

impl Setpoint {
    /// Four feet, arms held.
    pub fn standing(torso: &Isometry3<f64>, arms: [Vector3<f64>; 2]) -> Self {
        Self {
            torso: PoseReference::hold(torso),
            arms: arms.map(|arm| ArmGoal::Posture(PointReference::hold(arm))),
            contacts: ContactSet::STANCE,
        }
    }

    /// The paper's table of priorities: torso position, torso orientation, foot or gripper position, gripper
    /// orientation, postures.
    pub fn objectives(&self) -> ObjectiveList {
        let mut list = ObjectiveList::new();
        list.push(Objective::TorsoPosition(self.torso.point));
        list.push(Objective::TorsoOrientation(self.torso.rotation));
        for side in Side::ALL {
            match self.arms[side.index()] {
                ArmGoal::Gripper(gripper) => {
                    list.push(Objective::GripperPosition(side, gripper.point));
                    list.push(Objective::GripperOrientation(side, gripper.rotation));
                }
                ArmGoal::PostureAndFoot(_, foot) => list.push(Objective::FootPosition(side.leg(), foot)),
                ArmGoal::Posture(_) => {}
            }
        }
        for side in Side::ALL {
            match self.arms[side.index()] {
                ArmGoal::Posture(posture) | ArmGoal::PostureAndFoot(posture, _) => {
                    list.push(Objective::ArmPosture(side, posture));
                }
                ArmGoal::Gripper(_) => {}
            }
        }
        list
    }

    /// The same in another world.
    #[must_use]
    pub fn rebased(&self, new_from_old: &Isometry3<f64>) -> Self {
        Self {
            torso: self.torso.rebased(new_from_old),
            arms: self.arms.map(|arm| match arm {
                ArmGoal::Posture(posture) => ArmGoal::Posture(posture),
                ArmGoal::PostureAndFoot(posture, foot) => {
                    ArmGoal::PostureAndFoot(posture, rebased_point(&foot, new_from_old))
                }
                ArmGoal::Gripper(gripper) => ArmGoal::Gripper(gripper.rebased(new_from_old)),
            }),
            contacts: self.contacts,
        }
    }

    /// Target of a gripper, if it has one.
    pub fn gripper(&self, side: Side) -> Option<&PoseReference> {
        match &self.arms[side.index()] {
            ArmGoal::Gripper(gripper) => Some(gripper),
            _ => None,
        }
    }

    /// Moves a foot's share of the load towards `share` by at most `step`.
    pub fn load(&mut self, leg: Leg, share: f64, step: f64) {
        let now = self.contacts.share(leg);
        self.contacts = self.contacts.with_share(leg, now + (share - now).clamp(-step, step));
    }
}
