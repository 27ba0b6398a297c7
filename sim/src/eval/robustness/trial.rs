//! Disturbances, each on several robots: does it fall, how hard does it move, when is it at rest again?

use std::path::Path;

use locoman_robot::control::RobotConfig;
use locoman_robot::joints::{Leg, Side};
use locoman_robot::modes::Mode;
use locoman_robot::trajectory::{Trajectory, Waypoint};
use nalgebra::{Isometry3, Vector3};

use super::monitor::{Findings, Monitor};
use crate::eval::body::align;
use crate::eval::lockstep::{Lockstep, ticks};
use crate::robot::disturbance::{Disturbance, Target};
use crate::robot::{EXCHANGE_S, Options};

/// A push lasts so long, as those that the authors' controller was measured with; then the robot has so long to
/// come to rest, s.
const PUSH_S: f64 = 0.2;
const REST_S: f64 = 3.0;
const ALIGN_S: f64 = 0.25;
/// At rest: within this of where it ends, m.
const SETTLED_M: f64 = 1e-3;
/// Coefficient under a slipping foot (rubber on wet ice), and the push on the torso that makes it slip, N.
const ICE: f64 = 0.02;
const SLIP_N: f64 = 10.0;

/// What happens to the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Case {
    /// At rest: the torso is pushed along x and y, there and back, N.
    PushTorso(f64),
    /// At rest: the gripper is pushed along x, y and z, there and back, N.
    PushGripper(f64),
    /// A mass hangs in the gripper, kg: put in at rest, then moved, taken out at rest.
    Load(f64),
    /// In motion: one standing foot after the other stands on ice for a while, and the torso is pushed sideways.
    SlippingFoot,
    /// In motion: all feet have this coefficient of friction.
    Friction(f64),
    /// In motion: commands to the joints are lost for so long, twice a second, s.
    Stall(f64),
}

impl Case {
    /// Those of the issue.
    pub const ALL: [Self; 8] = [
        Self::PushTorso(10.0),
        Self::PushTorso(20.0),
        Self::PushGripper(10.0),
        Self::PushGripper(20.0),
        Self::Load(0.5),
        Self::SlippingFoot,
        Self::Friction(0.4),
        Self::Stall(0.02),
    ];

    /// In figures.
    pub fn name(&self) -> String {
        match self {
            Self::PushTorso(force_n) => format!("push_torso_{force_n:.0}n"),
            Self::PushGripper(force_n) => format!("push_gripper_{force_n:.0}n"),
            Self::Load(mass_kg) => format!("load_{:.0}g", 1e3 * mass_kg),
            Self::SlippingFoot => "slipping_foot".into(),
            Self::Friction(coefficient) => format!("friction_{coefficient}"),
            Self::Stall(duration_s) => format!("stall_{:.0}ms", 1e3 * duration_s),
        }
    }
}

/// How a case went on one robot.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// What must never happen.
    pub findings: Findings,
    /// Greatest jerk of torso and gripper, m/s³.
    pub jerk: [f64; 2],
    /// Greatest distance of torso and gripper from their references, mm.
    pub error_mm: [f64; 2],
    /// Longest time until torso and gripper were at rest after a disturbance, s.
    pub settling_s: [f64; 2],
    /// Fastest that the gripper still moved at the end of a rest, mm/s.
    pub last_speed_mm_s: f64,
    /// Errors of torso and gripper over time, mm, for the plot.
    pub errors_mm: [Vec<f64>; 2],
}

/// Runs a case on a robot with imperfections of this seed; odd seeds use the right gripper, even ones the left.
pub fn run(configs: &Path, profile: &str, case: Case, seed: u64) -> anyhow::Result<Outcome> {
    let side = if seed % 2 == 1 { Side::Right } else { Side::Left };
    let config = RobotConfig::load(configs)?;
    let model = config.model.clone();
    let options = Options { profile: profile.into(), posture: "standing".into(), seed, ..Options::default() };
    let mut sut = Lockstep::with_config(configs, config, &options)?;
    sut.go_to(Mode::Gripper(side))?;
    sut.run(0.5)?;
    let mut outcome = Outcome::default();
    for (number, act) in acts(case, side).into_iter().enumerate() {
        let sim_from_world = align(&mut sut, ALIGN_S)?;
        let mut monitor = Monitor::new(side, sim_from_world, sut.truth());
        let still = Trajectory::new([Waypoint::still(0.1)]);
        if let Some(trajectory) = act.motion.or(still) {
            sut.engage(&trajectory)?;
        }
        let total = ticks(act.seconds + REST_S);
        for tick in 0..total {
            for (at_s, disturbance) in &act.events {
                if tick == ticks(*at_s) {
                    sut.plant_mut().disturb(disturbance)?;
                }
            }
            sut.tick()?;
            if !monitor.watch(&mut sut, &model) {
                monitor.see_off(&mut sut)?;
                break;
            }
        }
        outcome.take(&monitor, ticks(act.seconds) as usize);
        if let Some(end) = &monitor.end {
            tracing::warn!("{}, seed {seed}, act {number}: {end}", case.name());
            break;
        }
        sut.release();
        sut.run(0.05)?;
    }
    Ok(outcome)
}

impl Outcome {
    fn take(&mut self, monitor: &Monitor, disturbed_ticks: usize) {
        self.findings.add(&monitor.findings);
        for (body, track) in monitor.tracks.iter().enumerate() {
            let errors = track.errors_mm();
            self.jerk[body] = self.jerk[body].max(track.peak_jerk());
            self.error_mm[body] = errors.iter().copied().fold(self.error_mm[body], f64::max);
            self.settling_s[body] = self.settling_s[body].max(track.settling_s(disturbed_ticks, SETTLED_M));
            self.errors_mm[body].extend(errors);
        }
        self.last_speed_mm_s = self.last_speed_mm_s.max(monitor.tracks[1].last_speed_mm_s());
    }
}

/// A disturbance from begin to end, with the motion meanwhile; then the robot rests.
struct Act {
    motion: Option<Trajectory>,
    seconds: f64,
    events: Vec<(f64, Disturbance)>,
}

fn acts(case: Case, side: Side) -> Vec<Act> {
    let push = |target: Target, axes: &[Vector3<f64>], force_n: f64| {
        let both = axes.iter().flat_map(|axis| [*axis, -axis]);
        both.map(|axis| {
            let force_n = force_n * axis;
            let torque_nm = Vector3::zeros();
            let push = Disturbance::Push { target, force_n, torque_nm, duration_s: PUSH_S };
            Act { motion: None, seconds: PUSH_S, events: vec![(0.0, push)] }
        })
        .collect()
    };
    let moving = |events: Vec<(f64, Disturbance)>| {
        let motion = motion(side);
        let seconds = motion.as_ref().map_or(0.0, Trajectory::duration_s);
        vec![Act { motion, seconds, events }]
    };
    let on_ice = |foot, coefficient| Disturbance::Friction { foot, coefficient };
    match case {
        Case::PushTorso(force_n) => push(Target::Torso, &[Vector3::x(), Vector3::y()], force_n),
        Case::PushGripper(force_n) => {
            push(Target::Gripper(side), &[Vector3::x(), Vector3::y(), Vector3::z()], force_n)
        }
        Case::Load(mass_kg) => {
            let load = |mass_kg| {
                let events = vec![(0.0, Disturbance::Load { side, mass_kg })];
                Act { motion: None, seconds: 0.0, events }
            };
            let mut acts = moving(Vec::new());
            acts.insert(0, load(mass_kg));
            acts.push(load(0.0));
            acts
        }
        Case::SlippingFoot => {
            let standing = Leg::ALL.into_iter().filter(|leg| *leg != side.leg());
            // One after the other for 2 s, with rubber on a usual floor (the scene's 0.8) again after.
            let events = standing.enumerate().flat_map(|(place, leg)| {
                let at_s = 0.5 + 2.5 * place as f64;
                let push = Disturbance::push_torso(SLIP_N * Vector3::y(), PUSH_S);
                [(at_s, on_ice(Some(leg), ICE)), (at_s + 1.0, push), (at_s + 2.0, on_ice(Some(leg), 0.8))]
            });
            moving(events.collect())
        }
        Case::Friction(coefficient) => moving(vec![(0.0, on_ice(None, coefficient))]),
        Case::Stall(duration_s) => {
            let silence = |number: u32| (0.5 * f64::from(number), Disturbance::Silence { duration_s });
            moving((1..16).map(silence).collect())
        }
    }
}

/// Gripper and torso through four poses in 8 s, y mirrored for the right side.
fn motion(side: Side) -> Option<Trajectory> {
    let out = if side == Side::Left { 1.0 } else { -1.0 };
    let waypoint = |time_s: f64, limb: [f64; 6], torso: [f64; 6]| {
        let pose = |[x, y, z, rx, ry, rz]: [f64; 6]| {
            Isometry3::new(Vector3::new(x, out * y, z), Vector3::new(out * rx, ry, out * rz))
        };
        let mut waypoint = Waypoint::still(time_s);
        waypoint.torso = pose(torso);
        waypoint.limbs[side.index()] = pose(limb);
        waypoint
    };
    Trajectory::new([
        waypoint(2.0, [0.05, 0.03, 0.05, 0.1, -0.2, 0.1], [0.01, 0.0, -0.01, 0.05, -0.05, 0.06]),
        waypoint(4.0, [-0.03, 0.05, 0.02, -0.2, 0.1, 0.2], [-0.01, 0.01, 0.01, -0.05, 0.06, 0.02]),
        waypoint(6.0, [-0.04, -0.04, -0.03, 0.2, 0.2, -0.1], [0.0, -0.01, 0.01, 0.06, 0.02, -0.06]),
        waypoint(8.0, [0.0; 6], [0.0; 6]),
    ])
}

/// The time axis of [`Outcome::errors_mm`], s.
pub fn seconds(tick: usize) -> f64 {
    tick as f64 * EXCHANGE_S
}
