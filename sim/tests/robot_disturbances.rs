//! Disturbances of the simulated robot do what they say, and a reset ends them.
#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::Path;

use locoman_robot::joints::{Leg, Side};
use locoman_robot::plant::{JointCommand, Plant, Sensors};
use locoman_sim::robot::{Disturbance, EXCHANGE_S, LockstepPlant, Options, Target, Truth};
use nalgebra::Vector3;

const GRAVITY: f64 = 9.81;

fn standing() -> LockstepPlant {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    let options =
        Options { profile: "ideal".into(), posture: "standing".into(), seed: 1, ..Options::default() };
    LockstepPlant::new(&configs, &options).unwrap()
}

/// Stand by joint position control alone, arms stowed.
fn stand() -> JointCommand {
    let mut command = JointCommand::damping();
    for joint in 0..12 {
        command.position[joint] = [0.0, 0.9, -1.8][joint % 3];
        command.kp[joint] = 200.0;
        command.kd[joint] = 4.0;
    }
    for (side, sign) in [(0, -1.0), (1, 1.0)] {
        command.position[12 + 3 * side] = -std::f64::consts::PI;
        command.position[13 + 3 * side] = 0.05 * sign;
    }
    command.kd.rows_mut(12, 6).fill(0.0);
    command
}

fn run(sut: &mut LockstepPlant, command: &JointCommand, seconds: f64) -> (Sensors, Truth) {
    let mut last = None;
    for _ in 0..(seconds / EXCHANGE_S).round() as usize {
        last = Some(sut.exchange(command).unwrap());
    }
    (last.unwrap(), sut.truth())
}

fn weight(truth: &Truth) -> f64 {
    truth.foot_force_n.iter().sum()
}

fn place(truth: &Truth) -> Vector3<f64> {
    truth.world_from_torso.translation.vector
}

#[test]
fn a_push_on_the_torso_lasts_its_time_and_is_felt_by_the_feet() {
    let mut sut = standing();
    let before = run(&mut sut, &stand(), 1.0).1;
    sut.disturb(&Disturbance::push_torso(Vector3::new(0.0, 0.0, -20.0), 0.5)).unwrap();
    let during = run(&mut sut, &stand(), 0.4975).1;
    assert!((weight(&during) - weight(&before) - 20.0).abs() < 0.2, "{} N", weight(&during));
    let after = run(&mut sut, &stand(), 0.5).1;
    assert!((weight(&after) - weight(&before)).abs() < 0.2, "{} N", weight(&after));
    // Feet under load keep a little of the creep that the push gave them.
    assert!((place(&after) - place(&before)).norm() < 1e-3);
}

#[test]
fn a_push_on_a_gripper_acts_at_the_grasp_centre() {
    let mut sut = standing();
    let command = stand();
    run(&mut sut, &command, 1.0);
    sut.disturb(&Disturbance::Push {
        target: Target::Gripper(Side::Left),
        force_n: Vector3::new(0.0, 0.0, -2.0),
        torque_nm: Vector3::zeros(),
        duration_s: 10.0,
    })
    .unwrap();
    run(&mut sut, &command, 2.0);
    let pressed = run(&mut sut, &command, 0.0025).1;
    sut.reset("standing").unwrap();
    let free = run(&mut sut, &command, 3.0025).1;
    let moment = |truth: &Truth| {
        let forces = truth.feet_in_world.iter().zip(truth.foot_force_n);
        forces.map(|(foot, force)| foot.coords * force).sum::<Vector3<f64>>()
    };
    // What the feet bear more is the push, and its line of action goes through the grasp centre.
    assert!((weight(&pressed) - weight(&free) - 2.0).abs() < 0.02, "{} N", weight(&pressed) - weight(&free));
    let arm = (moment(&pressed) - moment(&free)) / 2.0 - pressed.world_from_gripper[1].translation.vector;
    // The body sags by millimetres under the push, which moves the robot's own weight with it.
    assert!(arm.xy().norm() < 0.03, "{arm}");
}

#[test]
fn a_load_is_borne_by_the_feet_until_it_is_taken_out() {
    let mut sut = standing();
    let before = run(&mut sut, &stand(), 1.0).1;
    let load = |mass_kg| Disturbance::Load { side: Side::Right, mass_kg };
    sut.disturb(&load(0.5)).unwrap();
    let laden = run(&mut sut, &stand(), 2.0).1;
    assert!((weight(&laden) - weight(&before) - 0.5 * GRAVITY).abs() < 0.05, "{}", weight(&laden));
    assert!(laden.foot_force_n[0] > before.foot_force_n[0] + 2.0, "it is on the right in front");
    sut.disturb(&load(0.0)).unwrap();
    let after = run(&mut sut, &stand(), 2.0).1;
    assert!((weight(&after) - weight(&before)).abs() < 0.05);
}

#[test]
fn a_foot_without_friction_slides_and_the_others_stay() {
    let mut sut = standing();
    let mut command = stand();
    run(&mut sut, &command, 1.0);
    sut.disturb(&Disturbance::Friction { foot: Some(Leg::FrontLeft), coefficient: 0.02 }).unwrap();
    let before = sut.truth();
    // The front left foot is asked outward: friction would hold it.
    command.position[3] += 0.1;
    let after = run(&mut sut, &command, 1.0).1;
    let moved = |leg: Leg| (after.feet_in_world[leg.index()] - before.feet_in_world[leg.index()]).norm();
    assert!(moved(Leg::FrontLeft) > 0.015, "{}", moved(Leg::FrontLeft));
    for leg in [Leg::FrontRight, Leg::RearRight, Leg::RearLeft] {
        assert!(moved(leg) < 0.004, "{leg:?}: {}", moved(leg));
    }
}

#[test]
fn on_ice_a_sideways_push_moves_the_robot_and_on_rubber_it_does_not() {
    let slides = |coefficient| {
        let mut sut = standing();
        run(&mut sut, &stand(), 0.5);
        sut.disturb(&Disturbance::Friction { foot: None, coefficient }).unwrap();
        let before = sut.truth();
        sut.disturb(&Disturbance::push_torso(Vector3::new(20.0, 0.0, 0.0), 0.5)).unwrap();
        (run(&mut sut, &stand(), 1.5).1.feet_in_world[0] - before.feet_in_world[0]).norm()
    };
    assert!(slides(0.05) > 0.02, "20 N are more than 0.05 of 130 N");
    assert!(slides(0.4) < 0.002);
}

#[test]
fn commands_sent_in_a_silence_are_lost() {
    let mut sut = standing();
    let mut kick = stand();
    kick.torque[3] = 10.0;
    run(&mut sut, &stand(), 0.5);
    sut.disturb(&Disturbance::Silence { duration_s: 0.02 }).unwrap();
    let felt: Vec<bool> = (0..10)
        .map(|_| {
            sut.exchange(&kick).unwrap();
            sut.robot_mut().applied_torques()[3] > 5.0
        })
        .collect();
    assert_eq!(felt, [false, false, false, false, false, false, false, false, true, true]);
}

#[test]
fn a_reset_ends_all_disturbances() {
    let trace = |sut: &mut LockstepPlant| -> Vec<Sensors> {
        (0..100).map(|_| sut.exchange(&stand()).unwrap()).collect()
    };
    let undisturbed = trace(&mut standing());
    let mut sut = standing();
    for disturbance in [
        Disturbance::push_torso(Vector3::new(0.0, 50.0, 0.0), 10.0),
        Disturbance::push_gripper(Side::Right, Vector3::new(0.0, 5.0, 0.0), 10.0),
        Disturbance::Load { side: Side::Left, mass_kg: 0.5 },
        Disturbance::Friction { foot: None, coefficient: 0.1 },
        Disturbance::Silence { duration_s: 10.0 },
    ] {
        sut.disturb(&disturbance).unwrap();
    }
    trace(&mut sut);
    sut.reset("standing").unwrap();
    assert!(undisturbed == trace(&mut sut));
}
