//! What the robot walks on, besides the plane: blocks on the ground ahead of it.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A box, fixed to the ground, whose geom has the ground's name and a number after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Centre, m.
    pub center: Vector3<f64>,
    /// Half of the edges, m.
    pub half: Vector3<f64>,
    /// How it is turned.
    pub rotation: UnitQuaternion<f64>,
}

/// The ground.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Terrain {
    /// A plane.
    #[default]
    Flat,
    /// Square steps of random heights, from 0 to this, m.
    Steps {
        /// Height of the highest, m.
        height_m: f64,
    },
    /// A ramp up to a plateau.
    Slope {
        /// Its inclination, rad.
        rad: f64,
    },
}

/// Where rough ground begins ahead of the robot, how far it goes, and how far to either side, m.
const FROM_M: f64 = 0.5;
const LENGTH_M: f64 = 2.5;
const HALF_WIDTH_M: f64 = 1.0;
/// Edge of a step, m: about the length of a foot's stride.
const STEP_M: f64 = 0.25;
/// The plateau behind a ramp, m.
const PLATEAU_M: f64 = 2.0;

impl Terrain {
    /// How far ahead of its start the robot has crossed rough ground, m.
    pub const CROSSED_AT_M: f64 = FROM_M + LENGTH_M;

    /// Its blocks, those with random heights by the seed.
    pub fn blocks(&self, seed: u64) -> Vec<Block> {
        match *self {
            Self::Flat => Vec::new(),
            Self::Steps { height_m } => steps(height_m, seed),
            Self::Slope { rad } => slope(rad).to_vec(),
        }
    }
}

fn steps(height_m: f64, seed: u64) -> Vec<Block> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let count = |length: f64| (length / STEP_M).round() as i32;
    let mut blocks = Vec::new();
    for forward in 0..count(LENGTH_M) {
        for aside in -count(HALF_WIDTH_M)..count(HALF_WIDTH_M) {
            let height = random.random_range(0.0..height_m);
            let at = |place: i32| (f64::from(place) + 0.5) * STEP_M;
            blocks.push(Block {
                center: Vector3::new(FROM_M + at(forward), at(aside), height / 2.0),
                half: Vector3::new(STEP_M / 2.0, STEP_M / 2.0, (height / 2.0).max(1e-4)),
                rotation: UnitQuaternion::identity(),
            });
        }
    }
    blocks
}

/// A ramp over two thirds of the length, whose upper edge begins on the ground, and the plateau behind.
fn slope(rad: f64) -> [Block; 2] {
    const THICK_M: f64 = 0.1;
    let rad = rad.clamp(0.0, FRAC_PI_2 / 2.0);
    let run = LENGTH_M * 2.0 / 3.0;
    let (length, top) = (run / rad.cos(), run * rad.tan());
    let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), -rad);
    let middle = Vector3::new(FROM_M + run / 2.0, 0.0, top / 2.0);
    let ramp = Block {
        center: middle - turn * Vector3::new(0.0, 0.0, THICK_M / 2.0),
        half: Vector3::new(length / 2.0, HALF_WIDTH_M, THICK_M / 2.0),
        rotation: turn.into(),
    };
    let plateau = Block {
        center: Vector3::new(FROM_M + run + PLATEAU_M / 2.0, 0.0, top - THICK_M / 2.0),
        half: Vector3::new(PLATEAU_M / 2.0, HALF_WIDTH_M, THICK_M / 2.0),
        rotation: UnitQuaternion::identity(),
    };
    [ramp, plateau]
}
