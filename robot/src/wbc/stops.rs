//! Joints that have reached an end of their range.
//!
//! Where the hierarchy asks a joint to go beyond its range, the joint is stopped at the end of it, with
//! priority over all objectives, and the hierarchy is solved again: the other joints of the limb take over
//! what they can (Flacco, De Luca and Khatib, "Control of redundant robots under hard joint constraints:
//! saturation in the null space", IEEE Transactions on Robotics 31, 2015). Cutting the result instead would
//! leave the error to nobody.

use crate::{
    dynamics::{DOF, State},
    joints::{JOINTS, Leg, Side},
    model::Model,
};

/// The ends at which joints stop.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stops {
    ends: [Option<f64>; JOINTS],
}

impl Stops {
    /// The stopped joints and where.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.ends.iter().enumerate().filter_map(|(joint, end)| end.map(|end| (joint, end)))
    }

    /// Stops in each limb the joint that a solution q̄ - q takes furthest beyond its range; whether there was
    /// any. Limbs meet only in the torso, so that they can be dealt with side by side.
    pub(super) fn extend(&mut self, model: &Model, state: &State, step: &[f64; DOF], margin: f64) -> bool {
        let mut found = false;
        for leg in Leg::ALL {
            let arm = Side::ALL.into_iter().find(|side| side.leg() == leg).map(Side::first_arm_joint);
            let joints = (0..3).map(|k| leg.first_joint() + k);
            let joints = joints.chain(arm.into_iter().flat_map(|first| first..first + 3));
            let mut worst = (0.0, None);
            for joint in joints.filter(|joint| self.ends[*joint].is_none()) {
                let wanted = state.position[joint] + step[6 + joint];
                let end = wanted.clamp(model.lower[joint] + margin, model.upper[joint] - margin);
                if (wanted - end).abs() > worst.0 {
                    worst = ((wanted - end).abs(), Some((joint, end)));
                }
            }
            if let (_, Some((joint, end))) = worst {
                self.ends[joint] = Some(end);
                found = true;
            }
        }
        found
    }
}
