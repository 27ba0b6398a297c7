//! A desired pose and how it moves.

use nalgebra::{Isometry3, Vector3};

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

    /// The same motion at a pace of r in place of 1: v r, a r² + v dr/dt. `quickening` is dr/dt, 1/s.
    #[must_use]
    pub fn paced(&self, pace: f64, quickening: f64) -> Self {
        let Self { point, rotation } = self;
        let faster = |velocity: Vector3<f64>, acceleration: Vector3<f64>| {
            acceleration * (pace * pace) + velocity * quickening
        };
        Self {
            point: PointReference {
                position: point.position,
                velocity: point.velocity * pace,
                acceleration: faster(point.velocity, point.acceleration),
            },
            rotation: RotationReference {
                orientation: rotation.orientation,
                angular_velocity: rotation.angular_velocity * pace,
                angular_acceleration: faster(rotation.angular_velocity, rotation.angular_acceleration),
            },
        }
    }

    /// This motion, as a displacement in the world's axes, of a body that was at `anchor`.
    #[must_use]
    pub fn displacing(&self, anchor: &Isometry3<f64>) -> Self {
        let mut moved = *self;
        moved.point.position += anchor.translation.vector;
        moved.rotation.orientation *= anchor.rotation;
        moved
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
