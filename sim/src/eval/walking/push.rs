//! Pushes on the trunk of a trotting robot, from eight directions at ten phases of the gait.

use std::f64::consts::TAU;
use std::path::Path;

use locoman_robot::modes::Mode;
use nalgebra::Vector3;

use super::start::{ready, velocity};
use crate::robot::{Disturbance, Terrain};

/// What is tried, N, and what the issue asks for.
pub const FORCES_N: [f64; 3] = [130.0, 180.0, 220.0];
/// The force of the issue, N.
pub const MUST_N: f64 = 180.0;
/// Directions times phases.
pub const TRIALS: usize = DIRECTIONS * PHASES;
const DIRECTIONS: usize = 8;
/// The directions to the left and to the right.
pub const SIDEWAYS: [usize; 2] = [2, 6];
const PHASES: usize = 10;
/// How long it is pushed, and how long it may take to be itself again, s.
const PUSH_S: f64 = 0.2;
const RECOVERY_S: f64 = 4.0;
/// A cycle of the gait, s.
const CYCLE_S: f64 = 0.5;

/// Whether the robot still walks after a push; with the direction's number, 0 forward, counter-clockwise.
pub fn survives(
    configs: &Path,
    profile: &str,
    force_n: f64,
    trial: usize,
    seed: u64,
) -> anyhow::Result<(usize, bool)> {
    let (direction, phase) = (trial % DIRECTIONS, trial / DIRECTIONS);
    let mut sut = ready(configs, profile, Mode::Locomotion, Terrain::Flat, seed + phase as u64)?;
    sut.walk(Some(velocity([0.2, 0.0, 0.0])));
    sut.run(1.5 + CYCLE_S * phase as f64 / PHASES as f64)?;
    let angle = TAU * direction as f64 / DIRECTIONS as f64;
    let force = Vector3::new(angle.cos(), angle.sin(), 0.0) * force_n;
    sut.plant_mut().disturb(&Disturbance::push_torso(force, PUSH_S))?;
    let end = sut.truth().time_ns + ((PUSH_S + RECOVERY_S) * 1e9) as u64;
    while sut.truth().time_ns < end {
        sut.tick()?;
        if sut.truth().fallen {
            tracing::debug!("pushed with {force_n} N from {direction}/{DIRECTIONS} at phase {phase}: fell");
            return Ok((direction, false));
        }
    }
    Ok((direction, sut.snapshot().mode == Mode::Locomotion))
}
