//! Joints that have reached an end of their range, and limbs that have reached the ground.
//!
//! Where the hierarchy asks a joint to go beyond its range, the joint is stopped at the end of it, with
//! priority over all objectives, and the hierarchy is solved again: the other joints of the limb take over
//! what they can (Flacco, De Luca and Khatib, "Control of redundant robots under hard joint constraints:
//! saturation in the null space", IEEE Transactions on Robotics 31, 2015). Cutting the result instead would
//! leave the error to nobody. In the same way a lifted limb's foot and gripper are stopped above the ground
//! that the other feet stand on: a foot that touches it unplanned lifts the torso off its course.

use super::{
    ContactSet, Gains, Objective, ObjectiveKind, WbcSettings,
    task::{Task, height_row},
};
use crate::{
    dynamics::{Dynamics, Motion, State},
    joints::{JOINTS, Leg, Side},
    model::{Frame, Model},
};

/// What stops at once in a limb: all joints of a front one, its foot and its gripper.
pub(super) const MOST_IN_A_LIMB: usize = 8;

/// Joints and frames that stop, and where.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stops {
    /// Angles, rad.
    ends: [Option<f64>; JOINTS],
    /// Heights in the world, m.
    floors: [Option<f64>; Frame::COUNT],
}

/// What stops depend on, besides the solution.
pub(super) struct Surroundings<'a> {
    pub(super) model: &'a Model,
    pub(super) state: &'a State,
    pub(super) dynamics: &'a Dynamics,
    pub(super) contacts: &'a ContactSet,
    pub(super) objectives: &'a [Objective],
    pub(super) settings: &'a WbcSettings,
}

impl Stops {
    /// The stopped joints, a bit for each.
    pub(super) fn joints(&self) -> u32 {
        let stopped = self.ends.iter().enumerate().filter(|(_, end)| end.is_some());
        stopped.fold(0, |joints, (joint, _)| joints | 1 << joint)
    }

    /// The stopped frames, a bit for each in the order of [`Frame::ALL`].
    pub(super) fn frames(&self) -> u32 {
        let stopped = self.floors.iter().enumerate().filter(|(_, floor)| floor.is_some());
        stopped.fold(0, |frames, (frame, _)| frames | 1 << frame)
    }

    /// Hands over each stop as a task.
    pub(super) fn for_each_task(
        &self,
        state: &State,
        dynamics: &Dynamics,
        gains: &Gains,
        mut add: impl FnMut(Task),
    ) {
        for (joint, end) in self.ends.iter().enumerate() {
            if let Some(end) = end {
                add(Task::stop(state, joint, *end, gains));
            }
        }
        for frame in Frame::ALL {
            if let Some(height) = self.floors[frame.index()] {
                add(Task::floor(dynamics.frame(frame), height, gains));
            }
        }
    }

    /// Stops what a solution q̄ - q takes too far: in each limb the joint that goes furthest beyond its range
    /// (limbs meet only in the torso, so that they can be dealt with side by side), and whatever would touch
    /// the ground. Whether there was anything.
    pub(super) fn extend(&mut self, around: &Surroundings, step: &Motion) -> bool {
        let mut found = false;
        for leg in Leg::ALL {
            found |= self.stop_joint(around, leg, step);
        }
        let Some(ground) = ground_height(around) else { return found };
        for leg in Leg::ALL.into_iter().filter(|leg| !around.contacts.contains(*leg)) {
            let lands = |objective: &Objective| objective.kind() == ObjectiveKind::FootPosition(leg);
            if !around.objectives.iter().any(lands) {
                let least = ground + around.settings.foot_clearance;
                found |= self.stop_frame(around, Frame::Foot(leg), least, step);
            }
            if let Some(side) = Side::ALL.into_iter().find(|side| side.leg() == leg) {
                let least = ground + around.settings.gripper_clearance;
                found |= self.stop_frame(around, Frame::Gripper(side), least, step);
            }
        }
        found
    }

    fn stop_joint(&mut self, around: &Surroundings, leg: Leg, step: &Motion) -> bool {
        let margin = around.settings.joint_margin;
        let mut worst = (0.0, None);
        for joint in limb(leg).filter(|joint| self.ends[*joint].is_none()) {
            let wanted = around.state.position[joint] + step[6 + joint];
            let (lower, upper) = (around.model.lower[joint] + margin, around.model.upper[joint] - margin);
            let end = wanted.max(lower).min(upper);
            if (wanted - end).abs() > worst.0 {
                worst = ((wanted - end).abs(), Some((joint, end)));
            }
        }
        let (_, Some((joint, end))) = worst else { return false };
        self.ends[joint] = Some(end);
        true
    }

    fn stop_frame(&mut self, around: &Surroundings, frame: Frame, least: f64, step: &Motion) -> bool {
        let motion = around.dynamics.frame(frame);
        let row = height_row(motion);
        let rise: f64 = row.iter().zip(step.iter()).map(|(entry, step)| entry * step).sum();
        let touches = motion.world_from_frame.translation.z + rise < least;
        let new = touches && self.floors[frame.index()].is_none();
        if new {
            self.floors[frame.index()] = Some(least);
        }
        new
    }
}

/// The joints of a leg and of the arm that it carries.
fn limb(leg: Leg) -> impl Iterator<Item = usize> {
    let arm = Side::ALL.into_iter().find(|side| side.leg() == leg).map(Side::first_arm_joint);
    let of_leg = leg.first_joint()..leg.first_joint() + 3;
    of_leg.chain(arm.into_iter().flat_map(|first| first..first + 3))
}

/// Mean height of the standing feet's centres; nothing without any.
fn ground_height(around: &Surroundings) -> Option<f64> {
    let height = |leg| around.dynamics.frame(Frame::Foot(leg)).world_from_frame.translation.z;
    let (sum, count) =
        around.contacts.legs().fold((0.0, 0.0), |(sum, count), leg| (sum + height(leg), count + 1.0));
    (count > 0.0).then(|| sum / count)
}
