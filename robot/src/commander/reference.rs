//! A desired pose and how it moves.

use nalgebra::Isometry3;

use crate::wbc::{PointReference, RotationReference};

/// Reference of a body in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseReference {
    /// Of its origin.
    pub point: PointReference,
    /// Of its axes.
    pub rotation: RotationReference,
}

impl PoseReference {
    /// Stay there.
    pub fn hold(pose: &Isometry3<f64>) -> Self {
        Self {
            point: PointReference::hold(pose.translation.vector),
            rotation: RotationReference::hold(pose.rotation),
        }
    }

    /// Where it is.
    pub fn pose(&self) -> Isometry3<f64> {
        Isometry3::from_parts(self.point.position.into(), self.rotation.orientation)
    }

    /// The same reference in another world.
    #[must_use]
    pub fn rebased(&self, new_from_old: &Isometry3<f64>) -> Self {
        let turn = &new_from_old.rotation;
        Self {
            point: rebased_point(&self.point, new_from_old),
            rotation: RotationReference {
                orientation: turn * self.rotation.orientation,
                angular_velocity: turn * self.rotation.angular_velocity,
                angular_acceleration: turn * self.rotation.angular_acceleration,
            },
        }
    }
}

/// The same point in another world.
pub fn rebased_point(point: &PointReference, new_from_old: &Isometry3<f64>) -> PointReference {
    PointReference {
        position: new_from_old.transform_point(&point.position.into()).coords,
        velocity: new_from_old.rotation * point.velocity,
        acceleration: new_from_old.rotation * point.acceleration,
    }
}
