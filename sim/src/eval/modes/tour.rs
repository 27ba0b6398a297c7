//! A tour through the modes.

use std::path::Path;

use locoman_robot::control::RobotConfig;
use locoman_robot::joints::Side::{Left, Right};
use locoman_robot::modes::{Arms, Mode};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::eval::lockstep::{Lockstep, ticks};
use crate::eval::robustness::monitor::Findings;
use crate::eval::walking::tilt;
use crate::robot::{EXCHANGE_S, Options};

/// The modes.
const MODES: [Mode; 11] = [
    Mode::Stance,
    Mode::Foot(Right),
    Mode::Foot(Left),
    Mode::Gripper(Right),
    Mode::Gripper(Left),
    Mode::Locomotion,
    Mode::LocoManipulation(Arms::One(Right)),
    Mode::LocoManipulation(Arms::One(Left)),
    Mode::LocoManipulation(Arms::Both),
    Mode::Bimanual,
    Mode::LieDown,
];
/// Longest time on the way from one to another, s.
const PATIENCE_S: f64 = 30.0;
/// How long the robot stays in a mode, and how long at most before the next random request, s.
const STAY_S: f64 = 0.3;
const INTERRUPTED_S: f64 = 4.0;

/// A robot that lies leans less than this, rad.
const LYING_TILT_RAD: f64 = 0.5;

/// Two modes, in order.
pub type Pair = (Mode, Mode);

/// How it went on one robot.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Pairs.
    pub tried: u64,
    /// Those that did not arrive.
    pub failed: u64,
    /// Requests at random instants.
    pub interruptions: u64,
    /// What must never happen.
    pub findings: Findings,
    /// How long each pair took, s.
    pub times_s: Vec<(Pair, f64)>,
}

/// All ordered pairs.
pub fn pairs() -> impl Iterator<Item = Pair> {
    MODES
        .into_iter()
        .flat_map(|from| MODES.into_iter().map(move |to| (from, to)))
        .filter(|(from, to)| from != to)
}

/// In figures, as on the console: `right_gripper`.
pub fn name(mode: Mode) -> String {
    mode.to_message().as_str_name().trim_start_matches("MODE_").to_ascii_lowercase()
}

/// The order in which every pair comes once: each mode with all those before it, there and back.
fn stops() -> Vec<Mode> {
    let mut stops = vec![MODES[0]];
    for (place, mode) in MODES.iter().enumerate().skip(1) {
        // 0 n 1 n 2 n … n-1 n 0: with n all of those before it, in both directions.
        for before in &MODES[..place] {
            if stops.last() != Some(before) {
                stops.push(*before);
            }
            stops.push(*mode);
        }
        stops.push(MODES[0]);
    }
    stops
}

/// Visits all of them, then changes its mind.
pub fn travel(configs: &Path, profile: &str, interruptions: u64, seed: u64) -> anyhow::Result<Outcome> {
    let options = Options { profile: profile.into(), posture: "standing".into(), seed, ..Options::default() };
    let config = RobotConfig::load(configs)?;
    let model = config.model.clone();
    let mut sut = Lockstep::with_config(configs, config, &options)?;
    sut.go_to(Mode::Stance)?;
    let mut outcome = Outcome::default();
    let watch = |sut: &mut Lockstep, outcome: &mut Outcome| -> anyhow::Result<bool> {
        sut.tick()?;
        outcome.findings.watch_limits(sut, &model, |_| {});
        // One that lies down, or gets up, touches the ground; it does not lean.
        let lies = !sut.snapshot().phase.is_balanced();
        let fell = if lies { tilt(sut.truth()) > LYING_TILT_RAD } else { sut.truth().fallen };
        outcome.findings.falls = u64::from(fell);
        Ok(outcome.findings.falls == 0)
    };
    for pair in stops().windows(2) {
        let &[from, to] = pair else { continue };
        outcome.tried += 1;
        sut.request(to);
        let mut elapsed = 0;
        let arrived = loop {
            if !watch(&mut sut, &mut outcome)? {
                tracing::warn!(
                    "seed {seed}: fell on the way from {from:?} to {to:?}, in {:?}",
                    sut.snapshot().phase
                );
                outcome.failed += 1;
                return Ok(outcome);
            }
            elapsed += 1;
            let snapshot = sut.snapshot();
            if snapshot.mode == to && snapshot.goal == to {
                break true;
            }
            if elapsed > ticks(PATIENCE_S) {
                break false;
            }
        };
        if arrived {
            outcome.times_s.push(((from, to), elapsed as f64 * EXCHANGE_S));
        } else {
            tracing::warn!("seed {seed}: from {from:?} to {to:?} not in time: {:?}", sut.snapshot().phase);
            outcome.failed += 1;
        }
        for _ in 0..ticks(STAY_S) {
            watch(&mut sut, &mut outcome)?;
        }
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for _ in 0..interruptions {
        let goal = MODES[random.random_range(0..MODES.len())];
        outcome.interruptions += 1;
        sut.request(goal);
        for _ in 0..ticks(random.random_range(0.0..INTERRUPTED_S)) {
            if !watch(&mut sut, &mut outcome)? {
                tracing::warn!(
                    "seed {seed}: fell on an interrupted way to {goal:?}, in {:?}",
                    sut.snapshot().phase
                );
                return Ok(outcome);
            }
        }
    }
    Ok(outcome)
}
