//! A robot that is ready to walk.

use std::path::Path;

use locoman_robot::control::RobotConfig;
use locoman_robot::locomotion::Velocity;
use locoman_robot::modes::Mode;
use nalgebra::{Vector2, Vector3};

use crate::eval::lockstep::Lockstep;
use crate::robot::{Options, Terrain, Truth};

/// Stands, in a mode that walks.
pub fn ready(
    configs: &Path,
    profile: &str,
    mode: Mode,
    terrain: Terrain,
    seed: u64,
) -> anyhow::Result<Lockstep> {
    let options = Options { profile: profile.into(), posture: "standing".into(), seed, terrain };
    let mut sut = Lockstep::with_config(configs, RobotConfig::load(configs)?, &options)?;
    sut.go_to(mode)?;
    sut.run(0.3)?;
    Ok(sut)
}

/// Forward, left, turning.
pub fn velocity([forward, left, turn]: [f64; 3]) -> Velocity {
    Velocity { linear: Vector2::new(forward, left), turn }
}

/// Angle between the torso's z axis and up, rad.
pub fn tilt(truth: &Truth) -> f64 {
    (truth.world_from_torso.rotation * Vector3::z()).z.clamp(-1.0, 1.0).acos()
}
