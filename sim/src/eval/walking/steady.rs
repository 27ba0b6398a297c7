//! Walking at a steady pace.

use std::path::Path;

use locoman_robot::model::Frame;
use locoman_robot::modes::Mode;
use nalgebra::{Isometry3, Vector3};

use super::start::{ready, tilt, velocity};
use crate::eval::lockstep::ticks;
use crate::robot::{EXCHANGE_S, Terrain};

/// Until the pace is steady, and how long it is measured, s: whole cycles of the gait.
const UNTIL_STEADY_S: f64 = 3.0;
const MEASURED_S: f64 = 6.0;
/// Height of the torso above the ground in which walking begins, m.
const NOMINAL_HEIGHT_M: f64 = 0.285;

/// A steady pace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    name: &'static str,
    velocity: [f64; 3],
    height_m: Option<f64>,
}

impl Pace {
    /// Those that are tried.
    pub fn all() -> Vec<Self> {
        let of = |name, x, y, turn| Self { name, velocity: [x, y, turn], height_m: None };
        let at = |name, height_m| Self { name, velocity: [0.3, 0.0, 0.0], height_m: Some(height_m) };
        vec![
            of("rest", 0.0, 0.0, 0.0),
            of("forward_0.15", 0.15, 0.0, 0.0),
            of("forward_0.3", 0.3, 0.0, 0.0),
            of("forward_0.4", 0.4, 0.0, 0.0),
            of("forward_0.5", 0.5, 0.0, 0.0),
            of("forward_0.6", 0.6, 0.0, 0.0),
            of("forward_0.8", 0.8, 0.0, 0.0),
            of("backward_0.3", -0.3, 0.0, 0.0),
            of("sideways_0.2", 0.0, 0.2, 0.0),
            of("turn_1", 0.0, 0.0, 1.0),
            at("height_0.15", 0.15),
            at("height_0.20", 0.20),
            at("height_0.35", 0.35),
        ]
    }

    /// In figures.
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// Whether it goes anywhere.
    pub fn is_moving(&self) -> bool {
        self.velocity != [0.0; 3]
    }

    /// Whether it turns on the spot.
    pub fn is_turning(&self) -> bool {
        self.velocity[2] != 0.0
    }

    /// Whether the limits are for it.
    pub fn must(&self) -> bool {
        let [x, y, turn] = self.velocity;
        x.hypot(y) <= 0.5 && (turn == 0.0 || turn == 1.0)
    }

    /// Of its speed.
    pub fn unit(&self) -> &'static str {
        if self.is_turning() { "rad/s" } else { "m/s" }
    }
}

/// How it went.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Outcome {
    /// The robot lies.
    pub fallen: bool,
    /// Mean along the command, m/s or rad/s.
    pub speed: f64,
    /// By what share of the command it is wrong.
    pub speed_error: f64,
    /// Mean tilt, rad.
    pub tilt_rad: f64,
    /// Greatest tilt, rad.
    pub greatest_tilt_rad: f64,
    /// By how much the mean height above the ground is wrong, m.
    pub height_error_m: f64,
    /// RMS of the estimated velocity's error, m/s.
    pub velocity_error: f64,
    /// How far the estimate is off after the way, for each metre of it.
    pub drift: f64,
}

/// Walks.
pub fn walk(configs: &Path, profile: &str, pace: &Pace, seed: u64) -> anyhow::Result<Outcome> {
    let mut sut = ready(configs, profile, Mode::Locomotion, Terrain::Flat, seed)?;
    sut.walk(Some(velocity(pace.velocity)));
    let height_m = pace.height_m.unwrap_or(NOMINAL_HEIGHT_M);
    if pace.height_m.is_some() {
        let rise = Vector3::new(0.0, 0.0, height_m - NOMINAL_HEIGHT_M);
        sut.operator_mut().torso = Some(Isometry3::from(rise));
    }
    let mut outcome = Outcome::default();
    let (mut mean_height, mut turned) = (0.0, 0.0);
    let mut last = sut.truth().world_from_torso;
    let (mut from, mut estimated_from) = (last, sut.snapshot().torso.pose);
    let samples = ticks(MEASURED_S) as f64;
    for tick in 0..ticks(UNTIL_STEADY_S + MEASURED_S) {
        sut.tick()?;
        if sut.truth().fallen {
            return Ok(Outcome { fallen: true, ..Outcome::default() });
        }
        let torso = sut.truth().world_from_torso;
        if tick < ticks(UNTIL_STEADY_S) {
            (from, estimated_from) = (torso, sut.snapshot().torso.pose);
        } else {
            let lean = tilt(sut.truth());
            outcome.tilt_rad += lean / samples;
            outcome.greatest_tilt_rad = outcome.greatest_tilt_rad.max(lean);
            mean_height += torso.translation.z / samples;
            turned += (torso.rotation * last.rotation.inverse()).scaled_axis().z;
            let moved = (torso.translation.vector - last.translation.vector) / EXCHANGE_S;
            let frame = sut.controller().wbc().dynamics().frame(Frame::Torso);
            let estimated = frame.velocity.fixed_rows::<3>(0).into_owned();
            let error =
                frame.world_from_frame.rotation.inverse() * estimated - torso.rotation.inverse() * moved;
            outcome.velocity_error += error.norm_squared() / samples;
        }
        last = torso;
    }
    let way = from.inv_mul(&last).translation.vector;
    let estimated_way = estimated_from.inv_mul(&sut.snapshot().torso.pose).translation.vector;
    let [x, y, turn] = pace.velocity;
    let along = Vector3::new(x, y, 0.0).try_normalize(1e-9).unwrap_or_default();
    let (speed, wanted) = if pace.is_turning() {
        (turned / MEASURED_S, turn)
    } else {
        (way.dot(&along) / MEASURED_S, x.hypot(y))
    };
    outcome.speed = speed;
    outcome.speed_error = if pace.is_moving() { (speed / wanted - 1.0).abs() } else { 0.0 };
    outcome.height_error_m = (mean_height - height_m).abs();
    outcome.velocity_error = outcome.velocity_error.sqrt();
    outcome.drift = (estimated_way - way).norm() / way.norm().max(1e-3);
    Ok(outcome)
}
