//! The way of a lifted leg back to above its landing point, in the space of its joints: on a straight line in
//! the world, a leg that an operator has led far around would meet the ends of its ranges.

use nalgebra::{Isometry3, Vector3};

use super::scene::Scene;
use crate::{
    commander::PointMotion,
    joints::{JointVector, Leg, Side},
    kinematics::{of_leg, torso_from_frame},
    model::{Frame, Model},
    wbc::PointReference,
};

/// Half the interval of the central differences that give velocity and acceleration, s.
const STEP_S: f64 = 1e-3;

/// A leg on its way back.
#[derive(Debug, Clone, Copy)]
pub struct LegReturn {
    leg: Leg,
    joints: PointMotion,
    /// What the reference is off the desired joints' place at the beginning fades out on the way.
    offset: PointMotion,
}

impl LegReturn {
    /// At rest.
    pub fn hold(leg_rad: Vector3<f64>) -> Self {
        let nothing = PointMotion::hold(Vector3::zeros());
        Self { leg: Leg::FrontRight, joints: PointMotion::hold(leg_rad), offset: nothing }
    }

    /// From the foot's reference to where the leg's joints take it at `goal`.
    pub fn new(
        scene: &Scene<'_>,
        side: Side,
        foot: &PointReference,
        world_from_torso: &Isometry3<f64>,
        goal: &Vector3<f64>,
        duration_s: f64,
    ) -> Self {
        let leg = side.leg();
        let start = PointReference::hold(of_leg(scene.desired, leg));
        let offset = foot.position - place(scene.model, scene.desired, leg, world_from_torso);
        Self {
            leg,
            joints: PointMotion::new(&start, goal, duration_s),
            offset: PointMotion::new(&PointReference::hold(offset), &Vector3::zeros(), duration_s),
        }
    }

    /// How long it takes, s.
    pub fn duration_s(&self) -> f64 {
        self.joints.duration_s()
    }

    /// The foot's reference in the world; `torso_at` is the torso's reference after some time.
    pub fn sample(
        &self,
        scene: &Scene<'_>,
        elapsed_s: f64,
        torso_at: impl Fn(f64) -> Isometry3<f64>,
    ) -> PointReference {
        let at = |at_s: f64| {
            let mut joints = *scene.desired;
            joints.fixed_rows_mut::<3>(self.leg.first_joint()).copy_from(&self.joints.sample(at_s).position);
            place(scene.model, &joints, self.leg, &torso_at(at_s)) + self.offset.sample(at_s).position
        };
        let (before, now, after) = (at((elapsed_s - STEP_S).max(0.0)), at(elapsed_s), at(elapsed_s + STEP_S));
        PointReference {
            position: now,
            velocity: (after - before) / (2.0 * STEP_S),
            acceleration: (after - 2.0 * now + before) / (STEP_S * STEP_S),
        }
    }
}

/// Where a foot is in the world.
fn place(model: &Model, joints: &JointVector, leg: Leg, world_from_torso: &Isometry3<f64>) -> Vector3<f64> {
    (world_from_torso * torso_from_frame(model, joints, Frame::Foot(leg))).translation.vector
}
