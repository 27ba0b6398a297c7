//! The estimate of the torso's state against the simulator's truth, in the closed loop.
//!
//! Both worlds are tied together by the torso's pose at the start of a trajectory of 8 s; what the estimator
//! loses from there on is its error. All figures are with the sensors' imperfections on (profile `hw`).
//! `cargo test -p locoman-sim --test estimator -- --nocapture` prints them.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic in a test is the report")]

mod session;

use locoman_robot::{
    joints::Side,
    model::Frame,
    modes::{Mode, Phase},
    supervisor::Stop,
};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use session::Session;

/// Ticks of a trajectory: 8 s, as the paper's.
const TICKS: usize = 3200;
const DT_S: f64 = 0.0025;

/// A motion of the torso and of a gripper.
#[derive(Clone, Copy)]
struct Script {
    name: &'static str,
    side: Option<Side>,
    torso_m: f64,
    torso_rad: f64,
}

const STANDING: Script = Script { name: "standing", side: None, torso_m: 0.04, torso_rad: 0.2 };
const THREE_LEGGED: Script =
    Script { name: "three-legged", side: Some(Side::Right), torso_m: 0.015, torso_rad: 0.08 };

/// Mean and 95th percentile.
#[derive(Debug, Clone, Copy)]
struct Spread {
    mean: f64,
    p95: f64,
}

/// Errors over trajectories.
#[derive(Default)]
struct Errors {
    position_m: Vec<f64>,
    rotation_rad: Vec<f64>,
    tilt_rad: Vec<f64>,
    velocity_m_s: Vec<f64>,
    turn_rad_s: Vec<f64>,
}

fn spread(values: &[f64]) -> Spread {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    Spread {
        mean: values.iter().sum::<f64>() / values.len() as f64,
        p95: sorted[(0.95 * (sorted.len() - 1) as f64) as usize],
    }
}

impl Errors {
    fn print(&self, name: &str) {
        let line = |what: &str, values: &[f64], scale: f64, unit: &str| {
            let Spread { mean, p95 } = spread(values);
            println!("{name:>14} {what:<10} mean {:8.4}  p95 {:8.4} {unit}", mean * scale, p95 * scale);
        };
        line("position", &self.position_m, 1e3, "mm");
        line("rotation", &self.rotation_rad, 1e3, "mrad");
        line("tilt", &self.tilt_rad, 1e3, "mrad");
        line("velocity", &self.velocity_m_s, 1e3, "mm/s");
        line("turn rate", &self.turn_rad_s, 1e3, "mrad/s");
    }

    /// A tenth of what the whole robot may be off by (1 mm, 4 mrad), and the IMU's own bias of tilt.
    fn check(&self) {
        assert!(spread(&self.position_m).mean < 0.1e-3);
        assert!(spread(&self.rotation_rad).mean < 0.4e-3);
        assert!(spread(&self.tilt_rad).mean < 1.5e-3);
        assert!(spread(&self.velocity_m_s).mean < 2e-3);
    }
}

/// Sums of sines from zero, within the amplitudes: different for each seed.
fn motion(t: f64, seed: u64, length: f64, angle: f64) -> Isometry3<f64> {
    let soft = 1.0 - (-t / 1.0).exp();
    let wave = |axis: u64| {
        let phase = 1.7 * seed as f64 + 2.1 * axis as f64;
        let f = 0.13 + 0.02 * ((seed * 5 + axis * 3) % 7) as f64;
        soft * (std::f64::consts::TAU * f * t + phase).sin()
    };
    let p = Vector3::new(wave(0), wave(1), wave(2)) * length;
    let r = Vector3::new(wave(3), wave(4), wave(5)) * angle;
    Isometry3::from_parts(p.into(), UnitQuaternion::from_scaled_axis(r))
}

/// Plays a script, adds to the errors.
fn play(script: &Script, seed: u64, errors: &mut Errors) {
    let mut sut = Session::new("standing", "hw", seed);
    sut.run_until("stance", 10.0, |s| s.phase == Phase::Stance);
    sut.join();
    if let Some(side) = script.side {
        sut.request(Mode::Gripper(side));
    }
    sut.operator().engagement += 1;
    sut.run(1.0);
    let resets = sut.snapshot().world_resets;
    let slips = sut.snapshot().slips;
    let sim_from_world = sut.truth.world_from_torso * sut.snapshot().torso.pose.inverse();
    let mut before = sut.truth;
    for tick in 0..TICKS {
        let t = tick as f64 * DT_S;
        let torso = motion(t, seed, script.torso_m, script.torso_rad);
        let hand = motion(t, seed + 3, 0.05, 0.2);
        let operator = sut.operator();
        operator.torso = Some(torso);
        if let Some(side) = script.side {
            operator.palms[side.index()] = Some(hand);
        }
        sut.tick(Stop::None);
        let pose = sim_from_world * sut.snapshot().torso.pose;
        let truth = sut.truth.world_from_torso;
        errors.position_m.push((pose.translation.vector - truth.translation.vector).norm());
        errors.rotation_rad.push(pose.rotation.angle_to(&truth.rotation));
        // The world's own tilt counts here: gravity must be right.
        let up = sut.snapshot().torso.pose.rotation.inverse() * Vector3::z();
        errors.tilt_rad.push(up.angle(&(truth.rotation.inverse() * Vector3::z())));
        if tick > 0 {
            // The estimate of a tick stands beside the truth of the same sample; a central difference of
            // truth has an error of microns a second.
            let twist = sut.controller.wbc().dynamics().frame(Frame::Torso).velocity;
            let velocity = (truth.translation.vector - before.world_from_torso.translation.vector) / DT_S;
            let turn = (truth.rotation * before.world_from_torso.rotation.inverse()).scaled_axis() / DT_S;
            let of = |first: usize| sim_from_world.rotation * twist.fixed_rows::<3>(first).into_owned();
            errors.velocity_m_s.push((of(0) - velocity).norm());
            errors.turn_rad_s.push((of(3) - turn).norm());
        }
        before = sut.truth;
    }
    assert_eq!(resets, sut.snapshot().world_resets);
    assert_eq!(slips, sut.snapshot().slips);
}

fn play_seeds(script: &Script) -> Errors {
    let mut errors = Errors::default();
    for seed in 1..=10 {
        let mut of_seed = Errors::default();
        play(script, seed, &mut of_seed);
        if std::env::var_os("TRACE").is_some() {
            of_seed.print(&format!("{} {seed}", script.name));
        }
        errors.position_m.extend(of_seed.position_m);
        errors.rotation_rad.extend(of_seed.rotation_rad);
        errors.tilt_rad.extend(of_seed.tilt_rad);
        errors.velocity_m_s.extend(of_seed.velocity_m_s);
        errors.turn_rad_s.extend(of_seed.turn_rad_s);
    }
    errors.print(script.name);
    errors
}

#[test]
fn the_estimate_of_a_standing_robot_stays_with_the_truth() {
    play_seeds(&STANDING).check();
}

#[test]
fn the_estimate_of_a_robot_on_three_feet_stays_with_the_truth() {
    play_seeds(&THREE_LEGGED).check();
}
