//! The whole robot side in lockstep with physics: stands up, goes to a gripper or foot, follows, comes back.
//!
//! Errors are against the simulator's truth, with the sensors' imperfections on (profile `hw`).

#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic in a test is the report")]

mod session;

use locoman_robot::{
    joints::Side,
    modes::{Effector, Mode, Phase},
    supervisor::Stop,
};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use session::{COMMAND_PERIOD_NS, Session};

/// A smooth motion about zero: sums of sines with a soft start.
fn motion(t: f64, length: Vector3<f64>, angle: Vector3<f64>) -> Isometry3<f64> {
    let soft = 1.0 - (-t / 1.0).exp();
    let wave = |f: f64, p: f64| soft * ((std::f64::consts::TAU * f * t + p).sin() - p.sin());
    let p = Vector3::new(wave(0.21, 0.0), wave(0.17, 1.0), wave(0.26, 2.0)).component_mul(&length);
    let r = Vector3::new(wave(0.19, 2.0), wave(0.23, 0.5), wave(0.15, 1.0)).component_mul(&angle);
    Isometry3::from_parts(p.into(), UnitQuaternion::from_scaled_axis(r))
}

/// Mean errors of a body's motion since the start against the commanded one `delay` samples before.
struct Errors {
    delay_s: f64,
    position_m: f64,
    rotation_rad: f64,
    worst_m: f64,
}

/// Finds the fixed delay with the least mean error. Motion is taken relative to the first sample, in the axes
/// of the robot's world (`truth_from_world`).
fn errors(wanted: &[Isometry3<f64>], truth: &[Isometry3<f64>], axes: &UnitQuaternion<f64>) -> Errors {
    let score = |delay: usize| {
        let (mut position, mut rotation, mut worst, mut count) = (0.0, 0.0, 0.0_f64, 0.0);
        for i in delay.max(400)..truth.len() {
            let w = &wanted[i - delay];
            let p = axes.inverse() * (truth[i].translation.vector - truth[0].translation.vector);
            let r = axes.inverse() * (truth[i].rotation * truth[0].rotation.inverse()) * axes;
            let e = (p - w.translation.vector).norm();
            position += e;
            worst = worst.max(e);
            rotation += r.angle_to(&w.rotation);
            count += 1.0;
        }
        (position / count, rotation / count, worst)
    };
    let delay = (0..80).min_by(|a, b| score(*a).0.total_cmp(&score(*b).0)).unwrap();
    let (position_m, rotation_rad, worst_m) = score(delay);
    Errors { delay_s: delay as f64 * 0.0025, position_m, rotation_rad, worst_m }
}

fn print(name: &str, e: &Errors) {
    println!(
        "{name}: {:.2} mm mean, {:.2} mm worst, {:.4} rad mean, delay {:.1} ms",
        e.position_m * 1e3,
        e.worst_m * 1e3,
        e.rotation_rad,
        e.delay_s * 1e3
    );
}

/// Engages and moves; returns errors of torso and, on three feet, of the end effector.
fn follow(sut: &mut Session, effector: Option<Effector>, seconds: f64) -> (Errors, Option<Errors>) {
    sut.operator().engagement += 1;
    sut.run(1.0);
    let axes = {
        // Axes of the robot's world in the simulator's: by the torso, known in both.
        let estimated = sut.snapshot().torso.pose.rotation;
        sut.truth.world_from_torso.rotation * estimated.inverse()
    };
    let side = effector.map(Effector::side);
    let (mut wanted, mut torso, mut wanted_hand, mut hand) = (vec![], vec![], vec![], vec![]);
    let start_ns = sut.time_ns;
    let point = matches!(effector, Some(Effector::Foot(_)));
    for _ in 0..(seconds * 400.0) as usize {
        let t = (sut.time_ns - start_ns) as f64 * 1e-9;
        let (torso_length, torso_angle) = if side.is_some() {
            (Vector3::new(0.012, 0.012, 0.012), Vector3::new(0.05, 0.05, 0.08))
        } else {
            (Vector3::new(0.02, 0.02, 0.02), Vector3::new(0.1, 0.1, 0.15))
        };
        let of_torso = motion(t, torso_length, torso_angle);
        let of_hand = motion(t, Vector3::new(0.05, 0.05, 0.035), Vector3::new(0.2, 0.2, 0.2));
        let fresh = sut.time_ns.saturating_sub(sut.operator().received_ns) + 2_500_000 >= COMMAND_PERIOD_NS;
        if fresh {
            sut.operator().torso = Some(of_torso);
            if let Some(side) = side {
                sut.operator().palms[side.index()] = Some(of_hand);
            }
        }
        sut.tick(Stop::None);
        wanted.push(of_torso);
        wanted_hand.push(if point { Isometry3::from(of_hand.translation) } else { of_hand });
        torso.push(sut.truth.world_from_torso);
        hand.push(match effector {
            None => Isometry3::identity(),
            Some(Effector::Gripper(side)) => sut.truth.world_from_gripper[side.index()],
            Some(Effector::Foot(side)) => Isometry3::from(sut.truth.feet_in_world[side.leg().index()].coords),
        });
    }
    let hand_errors = side.map(|_| errors(&wanted_hand, &hand, &axes));
    sut.operator().engagement = 0;
    sut.operator().torso = None;
    sut.operator().palms = [None; 2];
    sut.run(0.3);
    (errors(&wanted, &torso, &axes), hand_errors)
}

#[test]
fn a_lying_robot_stands_up_and_its_torso_follows() {
    let mut sut = Session::new("lying", "hw", 1);
    sut.run_until("stance", 10.0, |s| s.phase == Phase::Stance);
    sut.join();
    let (torso, _) = follow(&mut sut, None, 12.0);
    print("torso in stance", &torso);
    assert!(torso.position_m < 0.005 && torso.rotation_rad < 0.03);
    assert!(sut.worst_tilt < 0.5);
}

fn there_and_back(effector: Effector, profile: &str) {
    let mut sut = Session::new("lying", profile, 1);
    sut.run_until("stance", 10.0, |s| s.phase == Phase::Stance);
    sut.join();
    sut.request(effector.mode());
    let (torso, hand) = follow(&mut sut, Some(effector), 12.0);
    let hand = hand.unwrap();
    print(&format!("{effector:?} {profile}, torso"), &torso);
    print(&format!("{effector:?} {profile}, end effector"), &hand);
    sut.request(Mode::Stance);
    sut.run(1.0);
    let forces = sut.truth.foot_force_n;
    assert!(forces.iter().all(|force| *force > 15.0), "stands on four feet: {forces:?}");
    assert!(hand.position_m < 0.005 && hand.rotation_rad < 0.08);
    assert!(torso.position_m < 0.005 && torso.rotation_rad < 0.03);
    assert!(sut.worst_tilt < 0.3, "{}", sut.worst_tilt);
}

#[test]
fn the_right_gripper_follows_the_palm_and_the_foot_comes_back() {
    there_and_back(Effector::Gripper(Side::Right), "hw");
}

#[test]
fn the_left_gripper_follows_the_palm_and_the_foot_comes_back() {
    there_and_back(Effector::Gripper(Side::Left), "hw");
}

#[test]
fn the_right_foot_follows_the_palm_and_comes_back() {
    there_and_back(Effector::Foot(Side::Right), "hw");
}

#[test]
fn the_left_foot_follows_the_palm_and_comes_back() {
    there_and_back(Effector::Foot(Side::Left), "hw");
}
