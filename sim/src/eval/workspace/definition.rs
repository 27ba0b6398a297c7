//! What is meant by a workspace and by its volume.

use std::collections::HashSet;

use locoman_robot::{
    joints::Leg,
    kinematics::torso_from_frame,
    model::{Frame, Model},
    modes::PoseSettings,
};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::{
    hull::Hull,
    sample::{Cloud, standing},
};

/// The paper's volumes of foot and gripper, m³: single, both, combined.
pub const PAPER: [[f64; 2]; 3] = [[0.34, 0.68], [0.38, 0.83], [0.63, 1.14]];

/// Hip, thigh and calf of the hind legs when the torso is upright, rad (the authors' program).
const UPRIGHT_HIND_RAD: [f64; 3] = [0.0, 2.35, -2.17];

/// Which limbs, in which postures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// One limb.
    Single,
    /// Both sides.
    Both,
    /// Both sides, level and upright.
    Combined,
}

impl Mode {
    /// All, in the paper's order.
    pub const ALL: [Self; 3] = [Self::Single, Self::Both, Self::Combined];

    /// As figures name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Both => "both",
            Self::Combined => "combined",
        }
    }

    /// The paper's volumes of foot and gripper, m³.
    pub const fn paper(self) -> [f64; 2] {
        PAPER[self as usize]
    }

    /// The paper's ratio; of the first two it gives more digits than of the volumes.
    pub fn paper_ratio(self) -> f64 {
        match self {
            Self::Single => 1.9901,
            Self::Both => 2.1828,
            Self::Combined => 1.14 / 0.63,
        }
    }
}

/// How a volume is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Convex hull.
    Hull,
    /// Cubes of 4 cm that hold a point.
    Voxels4,
    /// Cubes of 2 cm that hold a point.
    Voxels2,
}

impl Measure {
    /// All.
    pub const ALL: [Self; 3] = [Self::Hull, Self::Voxels4, Self::Voxels2];

    /// As figures name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hull => "hull",
            Self::Voxels4 => "voxels_4cm",
            Self::Voxels2 => "voxels_2cm",
        }
    }
}

/// The points of a mode.
pub struct Space {
    points: Vec<Vector3<f64>>,
}

impl Space {
    /// From those of the right limb.
    pub fn new(mode: Mode, cloud: &Cloud, level_from_upright: &Isometry3<f64>) -> Self {
        let points = match mode {
            Mode::Single => cloud.points.clone(),
            Mode::Both => cloud.both_sides(),
            Mode::Combined => {
                let mut points = cloud.both_sides();
                let upright = points.clone();
                points.extend(upright.into_iter().map(|p| (level_from_upright * Point3::from(p)).coords));
                points
            }
        };
        Self { points }
    }

    /// In the frame of the torso as it stands.
    pub fn points(&self) -> &[Vector3<f64>] {
        &self.points
    }

    /// m³
    pub fn volume(&self, measure: Measure) -> f64 {
        match measure {
            Measure::Hull => Hull::of(&self.points).volume(),
            Measure::Voxels4 => voxels(&self.points, 0.04),
            Measure::Voxels2 => voxels(&self.points, 0.02),
        }
    }
}

fn voxels(points: &[Vector3<f64>], size: f64) -> f64 {
    let cells: HashSet<[i32; 3]> =
        points.iter().map(|p| [p.x, p.y, p.z].map(|x| (x / size).floor() as i32)).collect();
    cells.len() as f64 * size.powi(3)
}

/// Pose of the upright torso in the frame of the standing one: pitched up by 90 degrees, hind feet where they stood.
pub fn upright(model: &Model, poses: &PoseSettings) -> Isometry3<f64> {
    let hind = |joints| {
        let foot = |leg| torso_from_frame(model, joints, Frame::Foot(leg)).translation.vector;
        (foot(Leg::RearRight) + foot(Leg::RearLeft)) / 2.0
    };
    let level = standing(poses);
    let mut sitting = level;
    for leg in [Leg::RearRight, Leg::RearLeft] {
        sitting.fixed_rows_mut::<3>(leg.first_joint()).copy_from_slice(&UPRIGHT_HIND_RAD);
    }
    let pitch = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -std::f64::consts::FRAC_PI_2);
    Isometry3::from_parts((hind(&level) - pitch * hind(&sitting)).into(), pitch)
}
