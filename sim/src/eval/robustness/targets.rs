//! Random trajectories of four poses that a gripper cannot reach, or reaches only at a singularity.

use locoman_robot::joints::{JointVector, Side};
use locoman_robot::kinematics::torso_from_frame;
use locoman_robot::model::{Frame, Model};
use locoman_robot::trajectory::{Trajectory, Waypoint};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Poses, the time from each to the next, the time back to the start, s.
const POSES: usize = 4;
const POSE_S: f64 = 1.5;
const BACK_S: f64 = 2.5;

/// What is difficult about a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Anywhere within 0.4 m and 2.5 rad on each axis: most of it is out of reach.
    Far,
    /// Within 0.15 m and 0.8 rad on each axis: some of it is out of reach.
    Near,
    /// Reachable, with the wrist's second joint at 90 degrees: its first and third axes coincide.
    Wrist,
    /// Reachable, with the knee as straight as it goes: the leg cannot get longer.
    Knee,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Far, Self::Near, Self::Wrist, Self::Knee];

    /// In figures.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Far => "far",
            Self::Near => "near",
            Self::Wrist => "wrist",
            Self::Knee => "knee",
        }
    }
}

/// A robot that is about to move a gripper.
#[derive(Debug, Clone, Copy)]
pub struct Start<'a> {
    /// The controller's model.
    pub model: &'a Model,
    /// Its side.
    pub side: Side,
    /// Its joints.
    pub joints: JointVector,
    /// Its torso.
    pub torso: Isometry3<f64>,
    /// Its gripper.
    pub gripper: Isometry3<f64>,
}

/// Four poses, and back to the start. The torso moves within 40 mm and 0.25 rad on each axis.
pub fn trajectory(kind: Kind, seed: u64, start: &Start<'_>) -> Option<Trajectory> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut waypoints: Vec<Waypoint> = (1..=POSES)
        .map(|number| {
            let mut waypoint = Waypoint::still(POSE_S * number as f64);
            waypoint.torso = uniform(0.04, 0.25, &mut random);
            waypoint.limbs[start.side.index()] = match kind {
                Kind::Far => uniform(0.4, 2.5, &mut random),
                Kind::Near => uniform(0.15, 0.8, &mut random),
                Kind::Wrist | Kind::Knee => start.displacement(kind, &mut random),
            };
            waypoint
        })
        .collect();
    waypoints.push(Waypoint::still(POSE_S * POSES as f64 + BACK_S));
    Trajectory::new(waypoints)
}

/// A displacement whose coordinates and rotation vector are uniform on each axis.
fn uniform(position_m: f64, rotation_rad: f64, random: &mut ChaCha8Rng) -> Isometry3<f64> {
    let mut vector = |half: f64| Vector3::from_fn(|_, _| half * random.random_range(-1.0..=1.0));
    let position = vector(position_m);
    Isometry3::from_parts(position.into(), UnitQuaternion::from_scaled_axis(vector(rotation_rad)))
}

impl Start<'_> {
    /// To a pose that joints near the present ones take, with one of them at its singularity.
    fn displacement(&self, kind: Kind, random: &mut ChaCha8Rng) -> Isometry3<f64> {
        let (leg, arm) = (self.side.leg().first_joint(), self.side.first_arm_joint());
        let mut joints = self.joints;
        for (joint, half) in [(leg, 0.3), (leg + 1, 0.4), (leg + 2, 0.4), (arm, 0.6), (arm + 2, 0.8)] {
            joints[joint] += half * random.random_range(-1.0..=1.0);
        }
        match kind {
            Kind::Knee => joints[leg + 2] = self.model.upper[leg + 2],
            _ => {
                // Each wrist turns further outwards than inwards.
                let inside = self.model.upper[arm + 1] < std::f64::consts::FRAC_PI_2;
                joints[arm + 1] = std::f64::consts::FRAC_PI_2 * if inside { -1.0 } else { 1.0 };
            }
        }
        let pose = self.torso * torso_from_frame(self.model, &joints, Frame::Gripper(self.side));
        let moved = pose.translation.vector - self.gripper.translation.vector;
        Isometry3::from_parts(moved.into(), pose.rotation * self.gripper.rotation.inverse())
    }
}
