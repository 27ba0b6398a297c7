//! The way from four feet to sitting upright on the shanks of the rear legs, planned from the model alone.
//!
//! ```text
//!      stand                touch               kneel                upright
//!    ___________         ___________          ___________               /|
//!    |\       |\          \\        \            /       \___          | |__
//!    |/       |/         __\\_______ \         _/___         \___     _|__ ``
//! ```
//! Seen from the side, in the *ground's frame* (origin between the centres of the rear feet, x forward, z up): with the
//! shanks on the ground the knees rest behind the feet, the hips are on a circle about the knees, and the pose of the torso
//! is that of the hips and a pitch. The feet stay where they stand. What decides is the centre of mass: while the front
//! feet still carry, the level torso goes back over the shanks (from "touch" to "kneel") until all of the weight is between
//! knees and feet; only then it rises. So the whole way can be gone slowly, stopped and turned round at any place, which a
//! sit-up that swings cannot.
//!
//! From "kneel" to "upright" the hips go forward as cos θ, for the torso's own centre of mass comes back as cos θ too: what
//! carries stays between knees and feet all the way.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::{
    joints::{JointVector, Leg, Side},
    kinematics::{leg_towards, of_leg, torso_from_frame},
    model::{FOOT_RADIUS_M, Frame, KNEE_RADIUS_M, Model},
    modes::{
        scene::Scene,
        settings::{PoseSettings, UprightSettings},
        shift::centre_of_mass,
    },
};

/// Places on the way, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Node {
    /// On four feet.
    Stand,
    /// On four feet, the knees of the rear legs touch the ground.
    Touch,
    /// On rear feet and knees, the front feet still on the ground without a load.
    Kneel,
    /// On rear feet and knees, the torso upright.
    Upright,
}

/// Share of the rise after which the front limbs leave the posture in which they stood: until then the torso lifts them.
const LIMBS_AFTER: f64 = 0.5;
/// Rear legs that kneel spread or close by so much at most: feet that stand farther off step into place before, rad.
const MOST_HIP_RAD: f64 = 0.15;
/// Each round leaves about a tenth of what lacks.
const ROUNDS: usize = 6;

/// The way of one robot on one place.
#[derive(Debug, Clone, Copy)]
pub struct Path {
    world_from_ground: Isometry3<f64>,
    geometry: Geometry,
    /// Hips' place behind the rear feet at the three last nodes, m.
    hips: [f64; 3],
    upright_rad: f64,
    stand: Isometry3<f64>,
    /// Hip joints of the rear legs right, left, rad.
    rear_hips: [f64; 2],
    /// Front legs right, left as they stand at [`Node::Kneel`], rad.
    standing: [Vector3<f64>; 2],
    /// Front leg and arm right, left at [`Node::Upright`], rad.
    ready: [[Vector3<f64>; 2]; 2],
    stowed: [Vector3<f64>; 2],
}

/// Lengths of the model, m.
#[derive(Debug, Clone, Copy)]
struct Geometry {
    /// From the torso's origin to the hips, along it.
    hips_behind: f64,
    thigh: f64,
    /// Knees behind and above the centres of the feet.
    knee: [f64; 2],
}

impl Geometry {
    fn of(model: &Model) -> Self {
        let hip = Leg::RearRight.first_joint();
        let offset = |joint: usize| model.joints[joint].parent_from_joint.translation.vector;
        let shank = model.calf_from_foot(Leg::RearRight).translation.vector.norm();
        let up = KNEE_RADIUS_M - FOOT_RADIUS_M;
        Self {
            hips_behind: -(offset(hip) + offset(hip + 1)).x,
            thigh: offset(hip + 2).z.abs(),
            knee: [-(shank * shank - up * up).sqrt(), up],
        }
    }

    /// x and z of the torso with the shanks on the ground; `hips` are before the rear feet.
    fn torso(&self, hips: f64, pitch: f64) -> (f64, f64) {
        let forward = ((hips - self.knee[0]) / self.thigh).clamp(-1.0, 1.0);
        let above = self.knee[1] + self.thigh * (1.0 - forward * forward).sqrt();
        let (sin, cos) = pitch.sin_cos();
        (hips + self.hips_behind * cos, above + self.hips_behind * sin)
    }
}

impl Path {
    /// For a robot that stands on four feet.
    pub fn plan(poses: &PoseSettings, settings: &UprightSettings, scene: &Scene<'_>) -> Self {
        let stand = scene.middle_of_feet(poses.stand_height_m);
        let rear =
            (scene.foot(Leg::RearRight) + scene.foot(Leg::RearLeft)) / 2.0 - rolled_back(scene, &stand);
        let world_from_ground = Isometry3::from_parts(rear.into(), stand.rotation);
        let goals = [settings.touch_com_m, settings.kneel_com_m, settings.upright_com_m];
        let mut path = Self {
            world_from_ground,
            geometry: Geometry::of(scene.model),
            hips: [0.0; 3],
            upright_rad: settings.pitch_rad,
            stand,
            rear_hips: [0.0; 2],
            standing: Side::ALL.map(|side| of_leg(scene.desired, side.leg())),
            ready: Side::ALL.map(|side| poses.upright(side)),
            stowed: Side::ALL.map(|side| poses.stow(side)),
        };
        path.rear_hips = Side::ALL.map(|side| path.rear_hip(scene, side));
        // Between where they will be: from farther away the front feet are out of reach.
        let mut hips = path.geometry.knee[0] + 0.3 * path.geometry.thigh;
        for (place, (goal, node)) in goals.into_iter().zip([1.0, 2.0, 3.0]).enumerate() {
            for _ in 0..ROUNDS {
                path.hips[place] = path.within_reach(hips);
                let com = centre_of_mass(scene.model, &path.torso(node), &path.posture(poses, scene, node));
                hips =
                    path.hips[place] + goal - path.world_from_ground.inverse_transform_point(&com.into()).x;
            }
            path.hips[place] = path.within_reach(hips);
            hips = path.hips[place];
            if node == 2.0 {
                let posture = path.posture(poses, scene, node);
                path.standing = Side::ALL.map(|side| of_leg(&posture, side.leg()));
            }
        }
        path
    }

    /// The hip joint of a rear leg whose foot stands where it does, with the torso level over shanks that lie down.
    fn rear_hip(&self, scene: &Scene<'_>, side: Side) -> f64 {
        let leg = side.rear_leg();
        let offset = |joint: usize| scene.model.joints[joint].parent_from_joint.translation.y;
        let foot = self.world_from_ground.inverse_transform_point(&scene.foot(leg).into());
        let aside = foot.y - offset(leg.first_joint()) - offset(leg.first_joint() + 1);
        (aside / self.geometry.thigh).clamp(-MOST_HIP_RAD, MOST_HIP_RAD)
    }

    /// The hips are on a circle about the knees.
    fn within_reach(&self, hips: f64) -> f64 {
        let Geometry { thigh, knee, .. } = self.geometry;
        hips.clamp(knee[0] - 0.7 * thigh, knee[0] + 0.9 * thigh)
    }

    /// All joints at a place of the way; those of front legs that stand by where their feet are.
    fn posture(&self, poses: &PoseSettings, scene: &Scene<'_>, at: f64) -> JointVector {
        let mut posture = self.joints(at);
        if at > 2.0 {
            return posture;
        }
        let (torso, start) = (self.torso(at), poses.posture(&poses.stand_rad));
        for leg in Side::ALL.map(Side::leg) {
            let foot = torso.inverse_transform_point(&scene.foot(leg).into()).coords;
            let joints = leg_towards(scene.model, &start, leg, &foot);
            posture.fixed_rows_mut::<3>(leg.first_joint()).copy_from(&joints);
        }
        posture
    }

    /// The front feet stand as they do now: so they leave the ground, and so they come back to it.
    pub fn stand_here(&mut self, scene: &Scene<'_>) {
        self.standing = Side::ALL.map(|side| of_leg(&scene.state.position, side.leg()));
    }

    /// Goes with the rear feet where they slide or creep, by a share of the way: what keeps the balance is where the torso
    /// is above them.
    pub fn follow(&mut self, scene: &Scene<'_>, share: f64) {
        let [right, left] = [Leg::RearRight, Leg::RearLeft].map(|leg| scene.foot(leg));
        let across = left - right;
        let now = &mut self.world_from_ground;
        let middle = (right + left) / 2.0 - now.translation.vector;
        let forward = now.rotation * Vector3::x();
        let turn = (-across.dot(&forward)).atan2(across.xy().norm());
        now.translation.vector += share * middle;
        now.rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), share * turn) * now.rotation;
    }

    /// Where the torso stands on four feet.
    pub fn stand(&self) -> Isometry3<f64> {
        self.stand
    }

    /// Pose of the torso in the world at a place of the way, 1 to 3.
    pub fn torso(&self, at: f64) -> Isometry3<f64> {
        let (hips, pitch) = self.hips_and_pitch(at);
        let (x, z) = self.geometry.torso(hips, pitch);
        let nose_up = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -pitch);
        self.world_from_ground * Isometry3::from_parts(Vector3::new(x, 0.0, z).into(), nose_up)
    }

    /// Where the hips are before the rear feet, m, and how far the nose is up, rad.
    fn hips_and_pitch(&self, at: f64) -> (f64, f64) {
        let [touch, kneel, upright] = self.hips;
        let pitch = self.upright_rad * (at - 2.0).clamp(0.0, 1.0);
        if pitch > 0.0 {
            let share = (pitch.cos() - self.upright_rad.cos()) / (1.0 - self.upright_rad.cos());
            (upright + (kneel - upright) * share, pitch)
        } else {
            (touch + (kneel - touch) * (at - 1.0).clamp(0.0, 1.0), 0.0)
        }
    }

    /// All joints at a place of the way, 1 to 3; those of front legs as they are in the air.
    pub fn joints(&self, at: f64) -> JointVector {
        let mut joints = JointVector::zeros();
        let (thigh, calf) = self.shanks_down(at);
        let share = smooth((at - 2.0 - LIMBS_AFTER) / (1.0 - LIMBS_AFTER));
        for side in Side::ALL {
            let place = side.index();
            let rear = Vector3::new(self.rear_hips[place], thigh, calf);
            joints.fixed_rows_mut::<3>(side.rear_leg().first_joint()).copy_from(&rear);
            let [leg, arm] = &self.ready[place];
            let between = |from: &Vector3<f64>, to: &Vector3<f64>| from + (to - from) * share;
            let leg = between(&self.standing[place], leg);
            joints.fixed_rows_mut::<3>(side.leg().first_joint()).copy_from(&leg);
            let arm = between(&self.stowed[place], arm);
            joints.fixed_rows_mut::<3>(side.first_arm_joint()).copy_from(&arm);
        }
        joints
    }

    /// Thigh and calf of a rear leg with its shank on the ground.
    fn shanks_down(&self, at: f64) -> (f64, f64) {
        let Geometry { thigh, knee, .. } = self.geometry;
        let (hips, pitch) = self.hips_and_pitch(at);
        let leans = ((hips - knee[0]) / thigh).clamp(-1.0, 1.0).asin();
        let shank = -FRAC_PI_2 - (knee[1] / -knee[0]).atan();
        (leans + pitch, shank - leans)
    }
}

/// How far the rear feet roll back, in the world, as their shanks lie down: they are spheres.
fn rolled_back(scene: &Scene<'_>, stand: &Isometry3<f64>) -> Vector3<f64> {
    let forward = stand.rotation * Vector3::x();
    let knee = |side: Side| {
        let torso_from_knee = torso_from_frame(scene.model, &scene.state.position, Frame::Knee(side));
        (scene.state.world_from_torso * torso_from_knee).translation.vector
    };
    let mean = Side::ALL.map(|side| {
        let shank = scene.foot(side.rear_leg()) - knee(side);
        FRAC_PI_2 - shank.dot(&forward).atan2(-shank.z)
    });
    forward * (FOOT_RADIUS_M * (mean[0] + mean[1]) / 2.0)
}

/// From 0 to 1 without a step in velocity or acceleration.
fn smooth(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    s * s * s * (10.0 + s * (6.0 * s - 15.0))
}
