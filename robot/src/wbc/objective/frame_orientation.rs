//! A frame's orientation in the world.

use super::{Robot, RotationReference, Track};
use crate::{
    model::Frame,
    wbc::{
        Gains,
        task::{Task, angular, rows},
    },
};

/// Torso or gripper that is to be turned somehow. The error is log(R̄ Rᵀ), the shortest rotation to the
/// reference, along the world's axes as the Jacobian's angular rows.
pub(super) struct FrameOrientation<'a> {
    pub(super) frame: Frame,
    pub(super) reference: &'a RotationReference,
}

impl Track for FrameOrientation<'_> {
    fn task(&self, robot: &Robot<'_>, gains: &Gains) -> Task {
        let frame = robot.dynamics.frame(self.frame);
        let rotation = &frame.world_from_frame.rotation;
        Task::commanded(
            rows(frame, 3),
            (self.reference.orientation * rotation.inverse()).scaled_axis(),
            [self.reference.angular_velocity, angular(&frame.velocity)],
            self.reference.angular_acceleration,
            angular(&frame.bias_acceleration),
            gains,
        )
    }
}
