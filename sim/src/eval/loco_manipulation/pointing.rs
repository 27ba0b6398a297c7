//! Pointing with a gripper while trotting.

use std::path::Path;

use locoman_robot::joints::Side;
use locoman_robot::modes::{Arms, Mode};
use locoman_robot::trajectory::{Trajectory, Waypoint};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::eval::body::{Body, align};
use crate::eval::lockstep::ticks;
use crate::eval::walking::{ready, velocity};
use crate::robot::{EXCHANGE_S, Terrain};

/// How the robot walks meanwhile: forward, left, turning.
const VELOCITY: [f64; 3] = [0.15, 0.05, 0.0];
/// Greatest angle about each axis, rad, and how often it goes there and back, Hz.
const SWING_RAD: f64 = 0.5;
const SWING_HZ: f64 = 0.2;
/// How long it points, s, and how long it walks before, s.
const POINTS_S: f64 = 10.0;
const BEFORE_S: f64 = 2.0;
const ALIGN_S: f64 = 0.25;

/// Who keeps the grippers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// Loco-manipulation with these arms; the grippers turn.
    Held(Arms),
    /// Locomotion; the arms hold their joints, the grippers should stay as they are.
    Vanilla,
}

/// How it went.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// The robot lies.
    pub fallen: bool,
    /// Angle between where the gripper should point and where it does, over time, the worse of two grippers, rad.
    pub errors_rad: Vec<f64>,
    /// Mean of its part about the vertical, which is that of the estimated heading too, rad.
    pub about_vertical_rad: f64,
}

impl Outcome {
    /// rad
    pub fn mean_rad(&self) -> f64 {
        self.errors_rad.iter().sum::<f64>() / self.errors_rad.len() as f64
    }

    /// rad
    pub fn greatest_rad(&self) -> f64 {
        self.errors_rad.iter().copied().fold(0.0, f64::max)
    }
}

/// The time axis of [`Outcome::errors_rad`], s.
pub fn seconds(tick: usize) -> f64 {
    tick as f64 * EXCHANGE_S
}

/// Walks and points.
pub fn point(configs: &Path, profile: &str, task: Task, seed: u64) -> anyhow::Result<Outcome> {
    let (mode, sides): (Mode, &[Side]) = match task {
        Task::Held(Arms::One(Side::Right)) => {
            (Mode::LocoManipulation(Arms::One(Side::Right)), &[Side::Right])
        }
        Task::Held(Arms::One(Side::Left)) => (Mode::LocoManipulation(Arms::One(Side::Left)), &[Side::Left]),
        Task::Held(Arms::Both) => (Mode::LocoManipulation(Arms::Both), &Side::ALL),
        Task::Vanilla => (Mode::Locomotion, &[Side::Right]),
    };
    let mut sut = ready(configs, profile, mode, Terrain::Flat, seed)?;
    let sim_from_world = align(&mut sut, ALIGN_S)?;
    let held =
        sides.iter().map(|side| truth(*side, sut.truth(), &sim_from_world).rotation).collect::<Vec<_>>();
    sut.walk(Some(velocity(VELOCITY)));
    sut.run(BEFORE_S)?;
    if task != Task::Vanilla
        && let Some(trajectory) = swinging()
    {
        sut.engage(&trajectory)?;
    }
    let mut outcome = Outcome::default();
    for _ in 0..ticks(POINTS_S) {
        sut.tick()?;
        if sut.truth().fallen {
            outcome.fallen = true;
            break;
        }
        let error = |(side, held): (&Side, &UnitQuaternion<f64>)| {
            let wanted = match task {
                Task::Held(_) => Body::Gripper(*side).reference(&sut).rotation,
                Task::Vanilla => *held,
            };
            let error =
                (truth(*side, sut.truth(), &sim_from_world).rotation * wanted.inverse()).scaled_axis();
            (error.norm(), error.z.abs())
        };
        let worse = |a: (f64, f64), b: (f64, f64)| if a.0 > b.0 { a } else { b };
        let (error, about_vertical) = sides.iter().zip(&held).map(error).fold((0.0, 0.0), worse);
        outcome.errors_rad.push(error);
        outcome.about_vertical_rad += about_vertical / ticks(POINTS_S) as f64;
    }
    Ok(outcome)
}

fn truth(side: Side, truth: &crate::robot::Truth, sim_from_world: &Isometry3<f64>) -> Isometry3<f64> {
    Body::Gripper(side).truth(truth, sim_from_world)
}

/// About one axis after the other, there and back.
fn swinging() -> Option<Trajectory> {
    let quarter_s = 0.25 / SWING_HZ;
    let turn = |axis: Vector3<f64>, angle: f64| Isometry3::new(Vector3::zeros(), axis * angle);
    let mut time_s = 0.0;
    let mut waypoint = |pose: Isometry3<f64>, quarters: f64| {
        time_s += quarters * quarter_s;
        let mut waypoint = Waypoint::still(time_s);
        waypoint.limbs = [pose; 2];
        waypoint
    };
    Trajectory::new([
        waypoint(turn(Vector3::y(), SWING_RAD), 1.0),
        waypoint(turn(Vector3::y(), -SWING_RAD), 2.0),
        waypoint(turn(Vector3::x(), SWING_RAD), 2.0),
        waypoint(turn(Vector3::x(), -SWING_RAD), 2.0),
        waypoint(Isometry3::identity(), 1.0),
    ])
}
