//! Where foot and gripper get to: joint angles uniform in the model's ranges, those without self-collision.

use locoman_robot::{
    collision::{Clearances, Pair, Part},
    commander::TorsoRange,
    joints::{JointVector, Leg, Side},
    kinematics::{body_poses, torso_from_frame},
    model::{Frame, Model},
    modes::PoseSettings,
};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Whose workspace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effector {
    /// The centre of the foot, of a robot without arms.
    Foot,
    /// The gripper's grasp centre.
    Gripper,
}

impl Effector {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Foot, Self::Gripper];

    /// As figures name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Foot => "foot",
            Self::Gripper => "gripper",
        }
    }

    const fn frame(self) -> Frame {
        match self {
            Self::Foot => Frame::Foot(Leg::FrontRight),
            Self::Gripper => Frame::Gripper(Side::Right),
        }
    }
}

/// How the torso moves while the limb does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Torso {
    /// Not at all.
    Fixed,
    /// Anywhere in its range.
    Moving(TorsoRange),
}

/// Places of the right effector, and how many samples were thrown away.
#[derive(Debug, Clone)]
pub struct Cloud {
    /// In the frame of the torso as it stands, m.
    pub points: Vec<Vector3<f64>>,
    /// Share of the samples that collided.
    pub rejected: f64,
}

/// All limbs standing, arms folded.
pub fn standing(poses: &PoseSettings) -> JointVector {
    let mut joints = JointVector::zeros();
    for leg in Leg::ALL {
        joints.fixed_rows_mut::<3>(leg.first_joint()).copy_from(&poses.stand_rad);
    }
    for side in Side::ALL {
        joints.fixed_rows_mut::<3>(side.first_arm_joint()).copy_from(&poses.stow(side));
    }
    joints
}

impl Cloud {
    /// Samples the right limb; the other limbs stand. The foot's robot has no arms to collide with.
    pub fn sample(
        model: &Model,
        poses: &PoseSettings,
        effector: Effector,
        torso: &Torso,
        samples: usize,
        seed: u64,
    ) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let pairs = pairs(model, effector);
        let mut clearances = Clearances::new();
        let mut joints = standing(poses);
        let mut points = Vec::with_capacity(samples);
        for _ in 0..samples {
            for joint in [0, 1, 2, 12, 13, 14] {
                joints[joint] = random.random_range(model.lower[joint]..=model.upper[joint]);
            }
            let pose = torso.pose(&mut random);
            clearances.update(&model.collision, &pairs, &body_poses(model, &joints), 0.0);
            if clearances.near().is_empty() {
                let place = torso_from_frame(model, &joints, effector.frame()).translation.vector;
                points.push((pose * Point3::from(place)).coords);
            }
        }
        let rejected = 1.0 - points.len() as f64 / samples as f64;
        Self { points, rejected }
    }

    /// With those of the left side, which is the mirror image.
    pub fn both_sides(&self) -> Vec<Vector3<f64>> {
        let mirrored = self.points.iter().map(|p| Vector3::new(p.x, -p.y, p.z));
        self.points.iter().copied().chain(mirrored).collect()
    }
}

/// Pairs of links that can meet in the robot with this effector.
fn pairs(model: &Model, effector: Effector) -> Vec<Pair> {
    let exists = |part: Part| effector == Effector::Gripper || !(part.is_of_arm() || part == Part::Mount);
    let pairs = model.collision.pairs_of(Side::Right).iter();
    pairs.filter(|pair| pair.links(&model.collision).iter().all(|link| exists(link.part))).copied().collect()
}

impl Torso {
    /// As figures name it.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Fixed => "torso_fixed",
            Self::Moving(_) => "torso_moving",
        }
    }

    fn pose(&self, random: &mut ChaCha8Rng) -> Isometry3<f64> {
        match self {
            Self::Fixed => Isometry3::identity(),
            Self::Moving(range) => {
                let mut within =
                    |range: &locoman_robot::commander::Range| random.random_range(range.min..=range.max);
                let place = Vector3::new(within(&range.x), within(&range.y), within(&range.z));
                let [roll, pitch, yaw] = [within(&range.roll), within(&range.pitch), within(&range.yaw)];
                Isometry3::from_parts(place.into(), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
            }
        }
    }
}
