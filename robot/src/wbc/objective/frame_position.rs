//! A frame's origin in the world.

use super::{PointReference, Robot, Track};
use crate::{
    model::Frame,
    wbc::{
        Gains,
        task::{Task, linear, rows},
    },
};

/// Torso, foot or gripper that is to be at a place.
pub(super) struct FramePosition<'a> {
    pub(super) frame: Frame,
    pub(super) reference: &'a PointReference,
}

impl Track for FramePosition<'_> {
    fn task(&self, robot: &Robot<'_>, gains: &Gains) -> Task {
        let frame = robot.dynamics.frame(self.frame);
        Task::commanded(
            rows(frame, 0),
            self.reference.position - frame.world_from_frame.translation.vector,
            [self.reference.velocity, linear(&frame.velocity)],
            self.reference.acceleration,
            linear(&frame.bias_acceleration),
            gains,
        )
    }
}
