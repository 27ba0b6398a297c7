//! Random trajectories one after the other: four poses, back to the start, rest; then the next.

use std::path::Path;

use locoman_robot::control::RobotConfig;
use locoman_robot::joints::Side;
use locoman_robot::model::Model;
use locoman_robot::modes::Mode;

use super::monitor::{Findings, Monitor};
use super::targets::{Kind, Start, trajectory};
use crate::eval::body::{Body, align};
use crate::eval::lockstep::{Lockstep, ticks};
use crate::eval::statistics::mean;
use crate::robot::Options;

/// Rest at the start after each trajectory, s; over the end of it, recovery is judged.
const REST_S: f64 = 1.5;
const ALIGN_S: f64 = 0.25;

/// How a trajectory went.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// What was difficult about it.
    pub kind: Kind,
    /// What must never happen.
    pub findings: Findings,
    /// Farthest that the limits kept the reference from the trajectory, mm.
    pub withheld_mm: f64,
    /// Mean and greatest distance of the true gripper from its reference, mm.
    pub error_mm: [f64; 2],
    /// What of it shakes: greatest, mm.
    pub tremor_mm: f64,
    /// Greatest jerk of the true gripper, m/s³.
    pub jerk: f64,
    /// Distance and angle of the true gripper from its start at the end, mm and rad; none if it did not get there.
    pub recovery: Option<(f64, f64)>,
}

impl Outcome {
    /// Whether the true gripper is back at its start, to 5 mm and 0.05 rad: not in another posture of the limb,
    /// from which the limits bar the way.
    pub fn has_recovered(&self) -> bool {
        self.recovery.is_some_and(|(mm, rad)| mm < 5.0 && rad < 0.05)
    }
}

/// Plays the trajectories of some seeds on one robot; after a fall on another one.
pub fn wander(configs: &Path, profile: &str, seeds: &[u64]) -> anyhow::Result<Vec<Outcome>> {
    let config = RobotConfig::load(configs)?;
    let model = config.model.clone();
    let mut outcomes: Vec<Outcome> = Vec::new();
    let mut sut: Option<Lockstep> = None;
    let side = seeds.first().map_or(Side::Right, |seed| if seed % 2 == 1 { Side::Right } else { Side::Left });
    for &seed in seeds {
        let mut robot = match sut.take() {
            Some(robot) => robot,
            None => {
                let options = Options {
                    profile: profile.into(),
                    posture: "standing".into(),
                    seed,
                    ..Options::default()
                };
                let mut robot = Lockstep::with_config(configs, config.clone(), &options)?;
                robot.go_to(Mode::Gripper(side))?;
                robot.run(0.5)?;
                robot
            }
        };
        let kind = Kind::ALL[(seed / 2 % 4) as usize];
        let outcome = play(&mut robot, &model, side, kind, seed)?;
        if !outcome.findings.is_over() {
            sut = Some(robot);
        }
        outcomes.push(outcome);
    }
    Ok(outcomes)
}

fn play(sut: &mut Lockstep, model: &Model, side: Side, kind: Kind, seed: u64) -> anyhow::Result<Outcome> {
    let sim_from_world = align(sut, ALIGN_S)?;
    let body = Body::Gripper(side);
    let (torso, gripper) = (Body::Torso.reference(sut), body.reference(sut));
    let start = Start { model, side, joints: sut.command().position, torso, gripper };
    let Some(trajectory) = trajectory(kind, seed, &start) else {
        anyhow::bail!("no trajectory of seed {seed}")
    };
    let mut monitor = Monitor::new(side, sim_from_world, sut.truth());
    sut.engage(&trajectory)?;
    let mut withheld_mm: f64 = 0.0;
    for tick in 1..=ticks(trajectory.duration_s() + REST_S) {
        sut.tick()?;
        let wanted = trajectory.at(tick as f64 * crate::robot::EXCHANGE_S);
        let wanted = wanted.limbs[side.index()].displacing(&gripper).pose();
        let apart = wanted.translation.vector - body.reference(sut).translation.vector;
        withheld_mm = withheld_mm.max(1e3 * apart.norm());
        if !monitor.watch(sut, model) {
            monitor.see_off(sut)?;
            break;
        }
    }
    if let Some(end) = &monitor.end {
        tracing::warn!("trajectory {seed}, {}: {end}", kind.name());
    }
    if let Some(broken) = monitor.findings.broken() {
        tracing::warn!("trajectory {seed}, {}: {broken}", kind.name());
    }
    if !monitor.touched.is_empty() {
        tracing::warn!("trajectory {seed}, {}: touched {:?}", kind.name(), monitor.touched);
    }
    sut.release();
    sut.run(0.05)?;
    let [_, track] = &monitor.tracks;
    let errors = track.errors_mm();
    let recovery = track.truth.last().filter(|_| !monitor.findings.is_over()).map(|end| {
        let moved = end.translation.vector - gripper.translation.vector;
        (1e3 * moved.norm(), end.rotation.angle_to(&gripper.rotation))
    });
    Ok(Outcome {
        kind,
        findings: monitor.findings,
        withheld_mm,
        error_mm: [mean(&errors), errors.iter().copied().fold(0.0, f64::max)],
        tremor_mm: track.tremor_mm(),
        jerk: track.peak_jerk(),
        recovery,
    })
}
