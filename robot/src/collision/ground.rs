//! Flat ground, and how far a limb's links are above it.

use nalgebra::{Isometry3, Vector3};

use super::{CollisionModel, Link};
use crate::{
    joints::{JointVector, Leg},
    kinematics::{Bodies, slope_of_point},
    model::FOOT_RADIUS_M,
};

/// Flat, level ground, seen from the torso.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// Upwards in the torso's frame, of length 1.
    pub up: Vector3<f64>,
    /// Of the torso's origin above it, m.
    pub torso_height: f64,
}

/// An end of a capsule above the ground: a link's lowest point is the lower one of its two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Altitude {
    /// The link.
    pub link: Link,
    /// The joint that turns it.
    pub joint: usize,
    /// Centre of the capsule's end in the torso's frame, m.
    pub center: Vector3<f64>,
    /// Of the end's lowest point above the ground, m.
    pub height: f64,
}

impl Ground {
    /// At a height in the world, m.
    pub fn at(height_m: f64, world_from_torso: &Isometry3<f64>) -> Self {
        let up = world_from_torso.rotation.inverse() * Vector3::z();
        Self { up, torso_height: world_from_torso.translation.z - height_m }
    }

    /// The ends of the capsules on a leg and its arm.
    pub fn altitudes<'a>(
        &'a self,
        leg: Leg,
        model: &'a CollisionModel,
        bodies: &'a impl Bodies,
    ) -> impl Iterator<Item = Altitude> + 'a {
        model.shapes_of(leg).flat_map(move |shape| {
            shape.link.joint().into_iter().flat_map(move |joint| {
                let (rotation, origin) = bodies.pose(joint);
                [shape.capsule.a, shape.capsule.b].map(|end| {
                    let center = rotation * end + origin;
                    let height = self.up.dot(&center) + self.torso_height - shape.capsule.radius;
                    Altitude { link: shape.link, joint, center, height }
                })
            })
        })
    }
}

impl Altitude {
    /// How the height grows with each joint's angle while the torso stands still, m/rad.
    pub fn gradient(&self, ground: &Ground, bodies: &impl Bodies) -> JointVector {
        slope_of_point(bodies, Some(self.joint), &self.center, &ground.up)
    }
}

/// Mean height of the ground under feet that stand, from those of their centres, m; nothing without any.
pub fn height_under(feet: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = feet.fold((0.0, 0.0), |(sum, count), height| (sum + height, count + 1.0));
    (count > 0.0).then(|| sum / count - FOOT_RADIUS_M)
}
