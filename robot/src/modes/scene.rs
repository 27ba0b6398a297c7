//! What scripted and driven motions look at: the robot as it is, and as it was asked to be.

use nalgebra::{Isometry3, UnitQuaternion, Vector2, Vector3};

use crate::{
    collision::height_under,
    commander::from_above,
    dynamics::State,
    joints::{JointVector, Leg, Side},
    kinematics::torso_from_frame,
    model::{Frame, Model},
    wbc::ContactSet,
};

/// The robot in one control step.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// The robot.
    pub model: &'a Model,
    /// Where it is, by the estimator.
    pub state: &'a State,
    /// Joint positions asked for in the last step.
    pub desired: &'a JointVector,
    /// Centre of mass in the world.
    pub com: Vector3<f64>,
    /// Vertical forces of the feet, N.
    pub foot_force: [f64; 4],
    /// Now.
    pub now_ns: u64,
    /// Since the last step, s.
    pub dt_s: f64,
}

impl Scene<'_> {
    /// Centre of a foot in the world, as measured.
    pub fn foot(&self, leg: Leg) -> Vector3<f64> {
        let torso_from_foot = torso_from_frame(self.model, &self.state.position, Frame::Foot(leg));
        (self.state.world_from_torso * torso_from_foot).translation.vector
    }

    /// Joint angles asked of an arm.
    pub fn desired_arm(&self, side: Side) -> Vector3<f64> {
        self.desired.fixed_rows::<3>(side.first_arm_joint()).into_owned()
    }

    /// Where a front foot completes the parallelogram of the other three (the paper's switcher).
    pub fn landing(&self, side: Side) -> Vector3<f64> {
        let (other, rear_same, rear_other) = match side {
            Side::Right => (Leg::FrontLeft, Leg::RearRight, Leg::RearLeft),
            Side::Left => (Leg::FrontRight, Leg::RearLeft, Leg::RearRight),
        };
        self.foot(other) + self.foot(rear_same) - self.foot(rear_other)
    }

    /// Pose of a torso that stands level over the middle of the feet, facing where they face.
    pub fn middle_of_feet(&self, height_m: f64) -> Isometry3<f64> {
        let feet = Leg::ALL.map(|leg| self.foot(leg));
        let middle = feet.iter().sum::<Vector3<f64>>() / 4.0;
        let [front_right, front_left, rear_right, rear_left] = feet;
        let forward = front_right + front_left - rear_right - rear_left;
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), forward.y.atan2(forward.x));
        Isometry3::from_parts((middle + Vector3::z() * height_m).into(), yaw)
    }

    /// How far a foot is from its place about the middle of the feet at most: forward and aside, m.
    pub fn astray(&self, stance_m: &Vector2<f64>) -> f64 {
        let middle = self.middle_of_feet(0.0);
        let of = |leg: Leg| {
            let foot = middle.inverse_transform_point(&self.foot(leg).into());
            (foot.coords.xy().abs() - stance_m).amax()
        };
        Leg::ALL.into_iter().map(of).fold(0.0, f64::max)
    }

    /// The legs that stand, with the centres of their feet, and how many they are.
    pub fn footholds(&self, contacts: &ContactSet) -> ([(Leg, Vector3<f64>); 4], usize) {
        let (mut footholds, mut count) = ([(Leg::FrontRight, Vector3::zeros()); 4], 0);
        for (place, leg) in footholds.iter_mut().zip(contacts.legs()) {
            *place = (leg, self.foot(leg));
            count += 1;
        }
        (footholds, count)
    }

    /// The feet that stand, seen from above, and how many they are.
    pub fn standing_feet(&self, contacts: &ContactSet) -> ([Vector2<f64>; 4], usize) {
        let (footholds, count) = self.footholds(contacts);
        (footholds.map(|(_, foot)| from_above(&foot)), count)
    }

    /// Height of the ground under the feet that stand, in their mean; without any there is no ground.
    pub fn ground(&self, contacts: &ContactSet) -> f64 {
        height_under(contacts.legs().map(|leg| self.foot(leg).z)).unwrap_or(f64::NEG_INFINITY)
    }
}
