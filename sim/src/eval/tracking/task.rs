//! The paper's five tasks and its square, and what each has to show.

use locoman_robot::joints::Side;
use locoman_robot::modes::Mode;
use locoman_robot::trajectory::{Trajectory, Waypoint};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::eval::body::Body;

/// Poses of a random trajectory, and the time from each to the next, s: 3200 targets at 400 Hz.
const POSES: usize = 4;
const POSE_S: f64 = 2.0;

/// A task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum Task {
    /// The gripper moves, the torso holds.
    GripperTorsoStill,
    /// Gripper and torso move.
    GripperTorsoMoving,
    /// A front foot moves, the torso holds.
    FootTorsoStill,
    /// A front foot and the torso move.
    FootTorsoMoving,
    /// On four feet, the torso moves.
    StandingTorsoMoving,
    /// The gripper draws a rectangle in space while the torso leans in.
    Square,
}

/// Largest displacement of a random pose on each axis.
#[derive(Debug, Clone, Copy)]
struct Reach {
    position_m: f64,
    rotation_rad: f64,
}

/// What one quantity has to be: mean Euclidean norms in mm or rad.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// Against the robot's own estimator: the issue's.
    pub estimate: Option<f64>,
    /// Against the simulator's truth: the issue's.
    pub truth: Option<f64>,
    /// The paper's figure, against its own estimator.
    pub paper: Option<f64>,
    /// The authors' controller in MuJoCo with comparable imperfections, against truth: the better of two seeds.
    pub authors_truth: Option<f64>,
}

/// Of position (mm) and rotation (rad).
pub type PoseBounds = [Bounds; 2];

impl Task {
    /// All of them, in the order of the table.
    pub const ALL: [Self; 6] = [
        Self::GripperTorsoStill,
        Self::GripperTorsoMoving,
        Self::FootTorsoStill,
        Self::FootTorsoMoving,
        Self::StandingTorsoMoving,
        Self::Square,
    ];

    /// In figures.
    pub const fn name(self) -> &'static str {
        match self {
            Self::GripperTorsoStill => "gripper_torso_still",
            Self::GripperTorsoMoving => "gripper_torso_moving",
            Self::FootTorsoStill => "foot_torso_still",
            Self::FootTorsoMoving => "foot_torso_moving",
            Self::StandingTorsoMoving => "standing_torso_moving",
            Self::Square => "square",
        }
    }

    /// The side that a seed uses: right and left in turn; the square is drawn by the right gripper.
    pub const fn side(self, seed: u64) -> Side {
        if matches!(self, Self::Square) || seed % 2 == 1 { Side::Right } else { Side::Left }
    }

    /// The mode in which it is done.
    pub const fn mode(self, side: Side) -> Mode {
        match self {
            Self::StandingTorsoMoving => Mode::Stance,
            Self::FootTorsoStill | Self::FootTorsoMoving => Mode::Foot(side),
            Self::GripperTorsoStill | Self::GripperTorsoMoving | Self::Square => Mode::Gripper(side),
        }
    }

    /// The limb that it moves.
    pub const fn limb(self, side: Side) -> Option<Body> {
        match self {
            Self::StandingTorsoMoving => None,
            Self::FootTorsoStill | Self::FootTorsoMoving => Some(Body::Foot(side)),
            Self::GripperTorsoStill | Self::GripperTorsoMoving | Self::Square => Some(Body::Gripper(side)),
        }
    }

    /// The motion of a seed. `square` is the one of the file.
    pub fn trajectory(self, seed: u64, square: &Trajectory) -> Trajectory {
        if self == Self::Square {
            return *square;
        }
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let side = self.side(seed).index();
        let (limb, torso) = self.reach();
        let waypoints = (1..=POSES).map(|number| {
            let mut waypoint = Waypoint::still(POSE_S * number as f64);
            waypoint.limbs[side] = limb.pose(&mut random);
            waypoint.torso = torso.pose(&mut random);
            waypoint
        });
        Trajectory::new(waypoints).unwrap_or(*square)
    }

    /// Reach of limb and torso: that of the measurement of the authors' controller, so that figures compare.
    const fn reach(self) -> (Reach, Reach) {
        const NONE: Reach = Reach { position_m: 0.0, rotation_rad: 0.0 };
        const GRIPPER: Reach = Reach { position_m: 0.05, rotation_rad: 0.25 };
        const FOOT: Reach = Reach { position_m: 0.05, rotation_rad: 0.0 };
        const TORSO: Reach = Reach { position_m: 0.015, rotation_rad: 0.08 };
        const STANDING: Reach = Reach { position_m: 0.04, rotation_rad: 0.2 };
        match self {
            Self::GripperTorsoStill => (GRIPPER, NONE),
            Self::GripperTorsoMoving => (GRIPPER, TORSO),
            Self::FootTorsoStill => (FOOT, NONE),
            Self::FootTorsoMoving => (FOOT, TORSO),
            Self::StandingTorsoMoving => (NONE, STANDING),
            Self::Square => (NONE, NONE),
        }
    }

    /// Of the limb: position in mm, rotation in rad.
    pub const fn limb_bounds(self) -> Option<PoseBounds> {
        match self {
            Self::GripperTorsoStill => Some([
                bounds(Some(0.80), Some(1.5), Some(1.67), Some(3.6)),
                bounds(Some(0.006), Some(0.010), Some(0.045), None),
            ]),
            Self::GripperTorsoMoving => Some([
                bounds(Some(0.80), Some(1.5), Some(1.89), Some(4.0)),
                bounds(Some(0.006), Some(0.010), Some(0.047), None),
            ]),
            Self::FootTorsoStill => {
                Some([bounds(Some(0.45), Some(1.5), Some(0.93), Some(3.6)), bounds(None, None, None, None)])
            }
            Self::FootTorsoMoving => {
                Some([bounds(Some(0.55), Some(1.5), Some(1.10), Some(4.0)), bounds(None, None, None, None)])
            }
            Self::StandingTorsoMoving => None,
            Self::Square => {
                Some([bounds(Some(0.50), Some(1.5), Some(1.06), None), bounds(None, None, None, None)])
            }
        }
    }

    /// Of the torso: position in mm, rotation in rad.
    pub const fn torso_bounds(self) -> PoseBounds {
        match self {
            Self::GripperTorsoStill => [
                bounds(Some(0.60), Some(1.0), Some(1.92), Some(2.0)),
                bounds(Some(0.002), Some(0.004), Some(0.0075), None),
            ],
            Self::GripperTorsoMoving => [
                bounds(Some(0.60), Some(1.0), Some(2.38), Some(2.5)),
                bounds(Some(0.003), Some(0.005), Some(0.016), None),
            ],
            Self::FootTorsoStill => [
                bounds(Some(0.60), Some(1.0), Some(2.02), Some(2.1)),
                bounds(Some(0.002), Some(0.004), Some(0.0078), None),
            ],
            Self::FootTorsoMoving => [
                bounds(Some(0.60), Some(1.0), Some(2.26), Some(2.4)),
                bounds(Some(0.003), Some(0.005), Some(0.017), None),
            ],
            Self::StandingTorsoMoving => [
                bounds(Some(0.50), Some(1.0), Some(1.05), Some(2.4)),
                bounds(Some(0.003), Some(0.005), Some(0.014), None),
            ],
            Self::Square => {
                [bounds(None, None, None, None), bounds(Some(0.005), Some(0.008), Some(0.023), None)]
            }
        }
    }
}

const fn bounds(
    estimate: Option<f64>,
    truth: Option<f64>,
    paper: Option<f64>,
    authors_truth: Option<f64>,
) -> Bounds {
    Bounds { estimate, truth, paper, authors_truth }
}

impl Reach {
    /// A pose whose coordinates and rotation vector are uniform on each axis.
    fn pose(&self, random: &mut ChaCha8Rng) -> Isometry3<f64> {
        let mut vector = |half: f64| Vector3::from_fn(|_, _| half * random.random_range(-1.0..=1.0));
        let position = vector(self.position_m);
        Isometry3::from_parts(position.into(), UnitQuaternion::from_scaled_axis(vector(self.rotation_rad)))
    }
}
