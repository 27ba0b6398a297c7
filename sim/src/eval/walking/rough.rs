//! Rough ground, crossed at 0.2 m/s.

use std::path::Path;

use locoman_robot::modes::Mode;

use super::start::{ready, velocity};
use crate::robot::{Disturbance, Terrain};

const SPEED_M_S: f64 = 0.2;
/// Time to cross it, against that of a straight walk.
const PATIENCE: f64 = 1.5;

/// A ground, and the coefficient of friction on it if that is not the usual one.
pub type Ground = (Terrain, Option<f64>);

/// The grounds by their names.
pub fn grounds() -> [(&'static str, Ground); 3] {
    [
        ("steps_40mm", (Terrain::Steps { height_m: 0.04 }, None)),
        ("slope_10deg", (Terrain::Slope { rad: 10_f64.to_radians() }, None)),
        ("friction_0.4", (Terrain::Flat, Some(0.4))),
    ]
}

/// Whether the robot gets to the other end.
pub fn crosses(configs: &Path, profile: &str, ground: Ground, seed: u64) -> anyhow::Result<bool> {
    let (terrain, friction) = ground;
    let mut sut = ready(configs, profile, Mode::Locomotion, terrain, seed)?;
    if let Some(coefficient) = friction {
        sut.plant_mut().disturb(&Disturbance::Friction { foot: None, coefficient })?;
    }
    let way_m = Terrain::CROSSED_AT_M;
    let start = sut.truth().world_from_torso;
    sut.walk(Some(velocity([SPEED_M_S, 0.0, 0.0])));
    let end = sut.truth().time_ns + (PATIENCE * way_m / SPEED_M_S * 1e9) as u64;
    while sut.truth().time_ns < end {
        sut.tick()?;
        let truth = sut.truth();
        if truth.fallen {
            let gone_m = start.inv_mul(&truth.world_from_torso).translation.x;
            tracing::debug!("{terrain:?}, seed {seed}: fell after {gone_m:.2} m");
            return Ok(false);
        }
        if start.inv_mul(&truth.world_from_torso).translation.x >= way_m {
            return Ok(true);
        }
    }
    tracing::debug!("{terrain:?}, seed {seed}: not there in time");
    Ok(false)
}
