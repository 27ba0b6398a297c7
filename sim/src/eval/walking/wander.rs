//! Random commands: speeds, turns, heights and tilts that change every few seconds, and stops between them.

use std::path::Path;

use locoman_robot::modes::Mode;
use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::start::{ready, velocity};
use crate::eval::lockstep::ticks;
use crate::robot::Terrain;

/// Greatest speeds forward, left, turning that are asked for, m/s and rad/s.
const FASTEST: [f64; 3] = [0.6, 0.3, 1.0];
/// Greatest change of height and tilt, m and rad.
const HEIGHT_M: (f64, f64) = (-0.1, 0.05);
const TILT_RAD: f64 = 0.15;
/// A command lasts from this to that long, s.
const LASTS_S: (f64, f64) = (1.0, 5.0);
/// Share of commands that ask to stand.
const REST_SHARE: f64 = 0.2;

/// When the robot fell, if it did, s.
pub fn falls_at(configs: &Path, profile: &str, seconds: f64, seed: u64) -> anyhow::Result<Option<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut sut = ready(configs, profile, Mode::Locomotion, Terrain::Flat, seed)?;
    let start_ns = sut.truth().time_ns;
    let elapsed_s = |now_ns: u64| (now_ns - start_ns) as f64 * 1e-9;
    while elapsed_s(sut.truth().time_ns) < seconds {
        let rests = random.random_range(0.0..1.0) < REST_SHARE;
        let speeds = FASTEST.map(|most| if rests { 0.0 } else { random.random_range(-most..most) });
        let mut tilt = || random.random_range(-TILT_RAD..TILT_RAD);
        let turn = Vector3::new(tilt(), tilt(), 0.0);
        let height = random.random_range(HEIGHT_M.0..HEIGHT_M.1);
        sut.walk(Some(velocity(speeds)));
        sut.operator_mut().torso = Some(Isometry3::new(Vector3::new(0.0, 0.0, height), turn));
        for _ in 0..ticks(random.random_range(LASTS_S.0..LASTS_S.1)) {
            sut.tick()?;
            if sut.truth().fallen {
                let at_s = elapsed_s(sut.truth().time_ns);
                tracing::info!(
                    "seed {seed}: fell after {at_s:.1} s at {speeds:.2?}, {height:.2} m, {turn:.2?}"
                );
                return Ok(Some(at_s));
            }
        }
    }
    Ok(None)
}
