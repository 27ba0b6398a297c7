//! The requirements of `SAFETY.md` that need a whole robot: each test names the id that it proves.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic in a test is the report")]

mod session;

use locoman_robot::{
    control::Inputs,
    joints::Side,
    modes::{Mode, Phase, Refusal},
    plant::{JointCommand, Plant},
    supervisor::{Reason, Severity, Stop},
};
use nalgebra::{Isometry3, Vector3};
use session::Session;

/// Greatest step of a joint's set-point against where the joint is, when a robot is taken up: the stiffest
/// gain (200 N m/rad) then asks for a fifth of the torque limit at most.
const NO_JUMP_RAD: f64 = 0.03;

fn in_gripper(side: Side) -> Session {
    let mut session = Session::new("lying", "hw", 3);
    session.run_until("stance", 10.0, |s| s.phase == Phase::Stance);
    session.join();
    session.request(Mode::Gripper(side));
    session
}

fn farthest_leg_setpoint(session: &Session, measured: &[f64]) -> f64 {
    (0..12).map(|i| (session.command.position[i] - measured[i]).abs()).fold(0.0, f64::max)
}

#[test]
fn r_safe_002_and_003_without_its_station_a_robot_on_three_feet_holds_then_stands_on_four() {
    let mut sut = in_gripper(Side::Right);
    sut.operator().engagement = 1;
    sut.operator().palms[0] = Some(Isometry3::translation(0.05, 0.0, 0.03));
    sut.run(2.0);
    assert_eq!(sut.snapshot().engagement, 1);
    sut.speaks = false;
    sut.run(0.15);
    assert_eq!(sut.snapshot().assessment.severity, Severity::Hold);
    let held = sut.snapshot().grippers[0].target;
    sut.run(0.4);
    assert_eq!(sut.snapshot().assessment.severity, Severity::Disengage);
    sut.run(3.5);
    let now = sut.snapshot().grippers[0].target;
    assert!((now.translation.vector - held.translation.vector).norm() < 1e-3, "it holds");
    sut.run_until("four feet", 12.0, |s| s.phase == Phase::Stance);
    sut.run(0.5);
    assert!(sut.truth.foot_force_n.iter().all(|force| *force > 15.0));
    // The station is back, with the engagement that was ended.
    sut.speaks = true;
    sut.run(0.5);
    assert_eq!(sut.snapshot().engagement, 0);
    sut.operator().engagement = 2;
    sut.run(0.1);
    assert_eq!(sut.snapshot().engagement, 2);
}

#[test]
fn r_safe_005_a_simulator_that_returns_is_met_anew() {
    for posture in ["lying", "standing"] {
        let mut sut = in_gripper(Side::Left);
        let start_ns = sut.time_ns;
        let inputs = Inputs::default();
        for silent_ms in (20..1_000).step_by(20) {
            let silent_ns = silent_ms * 1_000_000;
            sut.command = sut.controller.silent(start_ns + silent_ns, silent_ns, &inputs);
            let reasons = sut.snapshot().assessment.reasons;
            assert_eq!(reasons.contains(Reason::SensorsLate), silent_ms >= 50);
            assert_eq!(reasons.contains(Reason::SensorsLost), silent_ms >= 500);
        }
        assert_eq!(sut.command, JointCommand::damping(), "nothing stale reaches a robot that returns");
        sut.plant.reset(posture).unwrap();
        sut.operator = None;
        let sensors = sut.plant.exchange(&sut.command).unwrap();
        sut.command = sut.controller.tick(sensors.time_ns, &sensors, &inputs);
        let step = farthest_leg_setpoint(&sut, sensors.position.as_slice());
        assert!(step < NO_JUMP_RAD, "{posture}: {step}");
        sut.run_until("stance", 10.0, |s| s.phase == Phase::Stance);
    }
}

#[test]
fn r_safe_005_and_015_a_robot_program_that_restarts_takes_the_posture_up_and_lowers_the_foot() {
    let mut sut = in_gripper(Side::Right);
    sut.operator().engagement = 5;
    sut.operator().palms[0] = Some(Isometry3::translation(0.04, -0.04, 0.05));
    sut.run(1.5);
    let before = sut.truth.world_from_torso.translation.vector;
    sut.restart_robot();
    sut.tick(Stop::None);
    sut.tick(Stop::None);
    assert_eq!(sut.snapshot().phase, Phase::Stow(Side::Right), "it sees that a foot is up");
    let measured = sut.truth.joint_position;
    let step = farthest_leg_setpoint(&sut, measured.as_slice());
    assert!(step < NO_JUMP_RAD, "{step}");
    sut.run(0.3);
    let after = sut.truth.world_from_torso.translation.vector;
    assert!((after - before).norm() < 0.01, "{}", (after - before).norm());
    sut.run_until("stance", 15.0, |s| s.phase == Phase::Stance);
    // The station went on with its engagement and its request all the while: neither is taken up.
    sut.run(1.0);
    assert_eq!(sut.snapshot().engagement, 0);
    assert_eq!(sut.snapshot().phase, Phase::Stance);
}

#[test]
fn r_safe_006_a_sample_that_is_no_number_damps_at_once() {
    let mut sut = Session::new("standing", "hw", 1);
    sut.run_until("stance", 10.0, |s| s.phase == Phase::Stance);
    let mut sensors = sut.plant.exchange(&sut.command).unwrap();
    sensors.gyro[1] = f64::NAN;
    let command = sut.controller.tick(sut.time_ns, &sensors, &Default::default());
    assert_eq!(command, JointCommand::damping());
    assert!(sut.snapshot().assessment.reasons.contains(Reason::SensorsNotFinite));
}

#[test]
fn r_safe_007_and_013_a_stop_settles_lies_down_and_stays_until_it_is_taken_back() {
    let mut sut = in_gripper(Side::Right);
    sut.tick(Stop::Settle);
    sut.run(1.0);
    assert_eq!(sut.snapshot().phase, Phase::Stow(Side::Right), "a foot that is up comes down first");
    sut.run_until("damped", 20.0, |s| s.phase == Phase::Damped);
    sut.run(1.0);
    assert!(sut.truth.world_from_torso.translation.z < 0.15);
    assert_eq!(sut.snapshot().phase, Phase::Damped);
    let ask = |sut: &mut Session| {
        sut.operator().mode = Some(Mode::Stance);
        sut.operator().mode_request += 1;
        sut.run(0.1);
    };
    ask(&mut sut);
    assert_eq!(sut.snapshot().phase, Phase::Damped);
    assert_eq!(sut.snapshot().refusal, Some(Refusal::StopReleased));
    ask(&mut sut);
    assert_eq!(sut.snapshot().phase, Phase::StandUp);
    sut.run_until("stance", 10.0, |s| s.phase == Phase::Stance);
}

#[test]
fn r_safe_007_the_stronger_stop_damps_in_the_same_step() {
    let mut sut = in_gripper(Side::Left);
    sut.tick(Stop::Damp);
    assert_eq!(sut.snapshot().phase, Phase::Damped);
    let opening = sut.command.opening;
    assert_eq!(sut.command, JointCommand { opening, ..JointCommand::damping() });
}

#[test]
fn a_mind_changed_at_any_instant_ends_on_four_feet() {
    // In each phase on the way to a gripper and a little beyond.
    for tenths in [2, 8, 12, 14, 18, 25, 38, 50] {
        let mut sut = Session::new("standing", "hw", 1);
        sut.run_until("stance", 10.0, |s| s.phase == Phase::Stance);
        sut.join();
        sut.operator().mode = Some(Mode::Gripper(Side::Left));
        sut.operator().mode_request += 1;
        sut.run(f64::from(tenths) * 0.1);
        sut.request(Mode::Stance);
        sut.run(0.5);
        assert!(sut.truth.foot_force_n.iter().all(|force| *force > 15.0), "after {tenths} tenths");
        assert!(sut.worst_tilt < 0.15, "after {tenths} tenths: {}", sut.worst_tilt);
    }
}

#[test]
fn r_safe_017_a_foot_that_feels_no_ground_takes_no_load() {
    let mut sut = in_gripper(Side::Right);
    sut.operator().mode = Some(Mode::Stance);
    sut.operator().mode_request += 1;
    let mut pressed_n: f64 = 0.0;
    for _ in 0..(10.0 * 400.0) as usize {
        let mut sensors = sut.plant.exchange(&sut.command).unwrap();
        // The ground is there, but the foot's sensor is dumb.
        sensors.foot_force[0] = 0.0;
        if sut.snapshot().phase == Phase::LowerFoot(Side::Right) {
            pressed_n = pressed_n.max(sut.plant.truth().foot_force_n[0]);
        }
        sut.operator().received_ns = sensors.time_ns;
        sut.operator().sequence += 1;
        let inputs = Inputs { command: sut.operator, ..Inputs::default() };
        sut.command = sut.controller.tick(sensors.time_ns, &sensors, &inputs);
    }
    assert_eq!(sut.snapshot().phase, Phase::LowerFoot(Side::Right));
    // Less than what would lift the foot opposite.
    assert!(pressed_n < 28.0, "{pressed_n}");
    assert!(sut.snapshot().assessment.reasons.contains(Reason::NoGround));
    sut.run_until("four feet", 5.0, |s| s.phase == Phase::Stance);
}

/// Targets that jump all over, far beyond reach, four times a second.
fn wild(side: Side, seed: u32) {
    let mut sut = in_gripper(side);
    sut.operator().engagement = 1;
    for step in 0..60_u32 {
        let wild = |n: u32| f64::from((step * n + seed) % 17) / 8.0 - 1.0;
        let jump = |scale: f64| {
            let p = Vector3::new(wild(5), wild(7), wild(11)) * scale;
            Isometry3::new(p, Vector3::new(wild(3), wild(13), wild(6)) * 1.5)
        };
        sut.operator().palms[side.index()] = Some(jump(1.0));
        sut.operator().torso = Some(jump(0.5));
        sut.run(0.25);
    }
    assert!(sut.worst_tilt < 0.6, "{side:?} {seed}: {}", sut.worst_tilt);
    sut.operator().engagement = 0;
    sut.request(Mode::Stance);
    sut.run(0.5);
    assert!(sut.truth.foot_force_n.iter().all(|force| *force > 15.0), "{side:?} {seed}");
}

#[test]
fn r_safe_016_a_wild_operator_does_not_make_the_robot_fall() {
    for seed in [0, 1, 2] {
        for side in Side::ALL {
            wild(side, seed);
        }
    }
}
