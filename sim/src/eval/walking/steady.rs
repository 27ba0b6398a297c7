//! Walking at a steady pace.

use std::path::Path;

use locoman_robot::control::RobotConfig;
use locoman_robot::locomotion::Velocity;
use locoman_robot::modes::Mode;
use nalgebra::{Vector2, Vector3};

use crate::eval::lockstep::{Lockstep, ticks};
use crate::robot::{EXCHANGE_S, Options};

/// Until the pace is steady, and how long it is measured, s: whole cycles of the gait.
const UNTIL_STEADY_S: f64 = 3.0;
const MEASURED_S: f64 = 6.0;

/// A steady pace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    name: &'static str,
    velocity: [f64; 3],
}

impl Pace {
    /// Those that are tried.
    pub fn all() -> Vec<Self> {
        let of = |name, x, y, turn| Self { name, velocity: [x, y, turn] };
        vec![
            of("in_place", 0.0, 0.0, 0.0),
            of("forward_0.15", 0.15, 0.0, 0.0),
            of("forward_0.3", 0.3, 0.0, 0.0),
            of("forward_0.5", 0.5, 0.0, 0.0),
            of("forward_0.6", 0.6, 0.0, 0.0),
            of("sideways_0.2", 0.0, 0.2, 0.0),
            of("turn_1", 0.0, 0.0, 1.0),
        ]
    }

    /// In figures.
    pub const fn name(&self) -> &'static str {
        self.name
    }
}

/// How it went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// The robot lies.
    pub fallen: bool,
    /// Mean along the command, m/s or rad/s.
    pub speed: f64,
    /// By how much of the command it is wrong.
    pub speed_error: f64,
    /// Mean tilt, and the greatest, rad.
    pub tilt_rad: f64,
    /// rad
    pub greatest_tilt_rad: f64,
    /// Mean height above the ground, m.
    pub height_m: f64,
    /// RMS of the estimated velocity's error, m/s.
    pub velocity_error: f64,
    /// How far the estimate is off after the way, for each metre of it.
    pub drift: f64,
}

/// Walks.
pub fn walk(configs: &Path, profile: &str, pace: &Pace, seed: u64) -> anyhow::Result<Outcome> {
    let options = Options { profile: profile.into(), posture: "standing".into(), seed };
    let mut sut = Lockstep::with_config(configs, RobotConfig::load(configs)?, &options)?;
    sut.go_to(Mode::Locomotion)?;
    sut.run(0.3)?;
    let [x, y, turn] = pace.velocity;
    sut.walk(Some(Velocity { linear: Vector2::new(x, y), turn }));
    let trace = std::env::var_os("TRACE").is_some();
    let (mut tilt, mut greatest, mut height, mut velocity_error) = (0.0, 0.0_f64, 0.0, 0.0);
    let mut start = None;
    let (mut turned, mut last) = (0.0, sut.truth().world_from_torso);
    let count = ticks(MEASURED_S);
    for tick in 0..ticks(UNTIL_STEADY_S) + count {
        sut.tick()?;
        let truth = *sut.truth();
        let torso = truth.world_from_torso;
        let lean = (torso.rotation * Vector3::z()).z.clamp(-1.0, 1.0).acos();
        if trace && tick % 8 == 0 {
            let s = sut.snapshot();
            println!(
                "{:6.3} {:?} true {:.3?} est {:.3?} ref {:.3?} tilt {:.3} f {:.0?} cmd {:.3?}",
                tick as f64 * EXCHANGE_S,
                s.phase,
                torso.translation.vector.as_slice(),
                s.torso.pose.translation.vector.as_slice(),
                s.torso.target.translation.vector.as_slice(),
                lean,
                truth.foot_force_n,
                truth.feet_in_world.map(|f| f.z),
            );
        }
        if truth.fallen {
            return Ok(Outcome {
                fallen: true,
                speed: f64::NAN,
                speed_error: f64::NAN,
                tilt_rad: f64::NAN,
                greatest_tilt_rad: f64::NAN,
                height_m: f64::NAN,
                velocity_error: f64::NAN,
                drift: f64::NAN,
            });
        }
        if tick >= ticks(UNTIL_STEADY_S) {
            let (from, _) = *start.get_or_insert((last, sut.snapshot().torso.pose));
            let _ = from;
            turned += (torso.rotation * last.rotation.inverse()).scaled_axis().z;
            tilt += lean;
            greatest = greatest.max(lean);
            height += torso.translation.z;
            let true_velocity = (torso.translation.vector - last.translation.vector) / EXCHANGE_S;
            let true_velocity = torso.rotation.inverse() * true_velocity;
            let dynamics = sut.controller().wbc().dynamics();
            let frame = dynamics.frame(locoman_robot::model::Frame::Torso);
            let estimated = frame.world_from_frame.rotation.inverse()
                * frame.velocity.fixed_rows::<3>(0).into_owned();
            velocity_error += (estimated - true_velocity).norm_squared();
        }
        last = torso;
    }
    let (from, estimated_from) = start.unwrap_or((last, sut.snapshot().torso.pose));
    let true_way = from.inv_mul(&last).translation.vector;
    let estimated_way = estimated_from.inv_mul(&sut.snapshot().torso.pose).translation.vector;
    let samples = count as f64;
    let (speed, wanted) = if turn == 0.0 {
        let along = Vector3::new(x, y, 0.0).try_normalize(1e-9).unwrap_or_default();
        (true_way.dot(&along) / MEASURED_S, x.hypot(y))
    } else {
        (turned / MEASURED_S, turn)
    };
    Ok(Outcome {
        fallen: false,
        speed,
        speed_error: if wanted > 0.0 { (speed / wanted - 1.0).abs() } else { 0.0 },
        tilt_rad: tilt / samples,
        greatest_tilt_rad: greatest,
        height_m: height / samples,
        velocity_error: (velocity_error / samples).sqrt(),
        drift: (estimated_way - true_way).norm() / true_way.norm().max(1e-3),
    })
}
