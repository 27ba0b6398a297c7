//! The simulated robot in lockstep: stands, is deterministic, respects its motors.
#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::{Path, PathBuf};

use locoman_robot::joints::JointVector;
use locoman_robot::model::Model;
use locoman_robot::plant::{JointCommand, Plant, Sensors};
use locoman_sim::robot::{Disturbance, LockstepPlant, Options};
use nalgebra::Vector3;

fn configs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs")
}

fn plant(profile: &str, posture: &str, seed: u64) -> LockstepPlant {
    let options = Options { profile: profile.into(), posture: posture.into(), seed, ..Options::default() };
    LockstepPlant::new(&configs(), &options).unwrap()
}

/// Stand by joint position control alone, arms stowed, grippers at `opening`.
fn stand(opening: f64) -> JointCommand {
    let mut command = JointCommand::damping();
    for joint in 0..12 {
        command.position[joint] = [0.0, 0.9, -1.8][joint % 3];
        command.kp[joint] = 60.0;
        command.kd[joint] = 2.0;
    }
    for (side, sign) in [(0, -1.0), (1, 1.0)] {
        command.position[12 + 3 * side] = -std::f64::consts::PI;
        command.position[13 + 3 * side] = 0.05 * sign;
    }
    command.kd.rows_mut(12, 6).fill(0.0);
    command.opening = [opening; 2];
    command
}

fn run(plant: &mut LockstepPlant, command: &JointCommand, seconds: f64) -> Sensors {
    let exchanges = (seconds / 0.0025) as usize;
    let mut last = None;
    for _ in 0..exchanges {
        last = Some(plant.exchange(command).unwrap());
    }
    last.unwrap()
}

/// Of the simulated robot, kg.
fn mass(sut: &mut LockstepPlant) -> f64 {
    sut.robot_mut().world_mut().data_mut().model().body_mass().iter().sum()
}

#[test]
fn the_robot_stands_by_joint_control_alone() {
    let mut sut = plant("hw", "standing", 1);
    let sensors = run(&mut sut, &stand(0.0), 2.0);
    let truth = sut.truth();
    assert!(!truth.fallen);
    let height = truth.world_from_torso.translation.z;
    assert!((0.25..0.30).contains(&height), "{height}");
    let weight: f64 = truth.foot_force_n.iter().sum();
    let expected = mass(&mut sut) * 9.81;
    assert!((weight - expected).abs() < 0.02 * expected, "{weight} N on the feet, {expected} N expected");
    assert!((Vector3::from(sensors.accelerometer).norm() - 9.81).abs() < 0.3);
    assert_eq!(sensors.time_ns, 2_000_000_000);
}

#[test]
fn a_lying_robot_rests_on_folded_legs_and_can_be_stood_up_by_a_ramp() {
    let mut sut = plant("hw", "lying", 1);
    let rest = run(&mut sut, &JointCommand::damping(), 0.5);
    let height = sut.truth().world_from_torso.translation.z;
    assert!((0.06..0.11).contains(&height) && !sut.truth().fallen, "{height} m");
    let drift = (run(&mut sut, &JointCommand::damping(), 0.5).position - rest.position).rows(0, 12).amax();
    assert!(drift < 0.02, "still moving by {drift} rad in 0.5 s");

    let goal = stand(0.0);
    let seconds = 2.0;
    for exchange in 0..800 {
        let share = f64::from(exchange) * 0.0025 / seconds;
        let mut command = goal;
        command.position = rest.position.lerp(&goal.position, share);
        command.kp.rows_mut(0, 12).fill(150.0);
        sut.exchange(&command).unwrap();
    }
    run(&mut sut, &goal, 1.0);
    let truth = sut.truth();
    assert!(!truth.fallen && truth.world_from_torso.translation.z > 0.24, "{truth:?}");
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_does_not() {
    let trace = |mut sut: LockstepPlant| {
        let samples: Vec<Sensors> = (0..200).map(|_| sut.exchange(&stand(0.5)).unwrap()).collect();
        (samples, sut.truth())
    };
    let first = trace(plant("hw", "standing", 7));
    assert!(first == trace(plant("hw", "standing", 7)));
    assert!(first.0 != trace(plant("hw", "standing", 8)).0);

    let mut again = plant("hw", "standing", 7);
    run(&mut again, &stand(1.0), 0.3);
    again.reset("standing").unwrap();
    assert!(first == trace(again), "a reset robot is as good as new");
}

#[test]
fn torques_stay_within_the_motors_limits() {
    let mut sut = plant("ideal", "standing", 1);
    let mut wild = stand(0.0);
    wild.kp = JointVector::repeat(3000.0);
    wild.position += JointVector::repeat(0.5);
    for _ in 0..40 {
        sut.exchange(&wild).unwrap();
        let applied = *sut.robot_mut().applied_torques();
        for (motor, torque) in applied.iter().enumerate() {
            let limit = match motor {
                0..12 => [23.7, 23.7, 35.55][motor % 3],
                _ => 0.92,
            };
            assert!(torque.abs() <= limit + 1e-12, "motor {motor}: {torque} N m");
        }
    }
}

#[test]
fn a_command_takes_effect_after_the_latency_of_the_profile() {
    let mut kick = stand(0.0);
    kick.torque[3] = 10.0;
    let acts = |profile: &str, sent_after_ns: u64| {
        let mut sut = plant(profile, "standing", 1);
        run(&mut sut, &stand(0.0), 0.5);
        let robot = sut.robot_mut();
        robot.send(&kick, sent_after_ns);
        robot.advance().unwrap();
        robot.applied_torques()[3] > 5.0
    };
    // An exchange lasts 2.5 ms, its last step begins at 2 ms.
    assert!(acts("ideal", 2_000_000));
    assert!(acts("hw", 0), "2 ms late");
    assert!(!acts("hw", 1), "later than the last step");
}

#[test]
fn the_grippers_follow_their_opening_at_a_servos_pace() {
    let mut sut = plant("hw", "standing", 1);
    run(&mut sut, &stand(1.0), 0.05);
    let early = sut.truth().opening;
    run(&mut sut, &stand(1.0), 0.6);
    let open = sut.truth().opening;
    run(&mut sut, &stand(0.0), 0.6);
    let closed = sut.truth().opening;
    for side in 0..2 {
        assert!(early[side] < 0.6, "{early:?}");
        assert!(open[side] > 0.97, "{open:?}");
        assert!(closed[side] < 0.03, "{closed:?}");
    }
}

#[test]
fn a_command_that_is_no_number_is_dropped() {
    let mut sut = plant("hw", "standing", 1);
    let mut broken = stand(0.0);
    broken.position[4] = f64::NAN;
    for _ in 0..20 {
        sut.exchange(&broken).unwrap();
    }
    assert_eq!(sut.robot_mut().rejected_commands(), 20);
    assert!(!sut.truth().fallen);
}

#[test]
fn a_hard_push_topples_the_robot_and_a_soft_one_does_not() {
    let mut sut = plant("hw", "standing", 1);
    sut.disturb(&Disturbance::push_torso(Vector3::new(0.0, 30.0, 0.0), 0.1)).unwrap();
    run(&mut sut, &stand(0.0), 1.0);
    assert!(!sut.truth().fallen);
    sut.disturb(&Disturbance::push_torso(Vector3::new(0.0, 400.0, 0.0), 0.3)).unwrap();
    run(&mut sut, &stand(0.0), 1.5);
    assert!(sut.truth().fallen);
}

#[test]
fn the_ideal_robot_weighs_what_the_model_says() {
    let model = Model::load(&configs().join("robot")).unwrap();
    let mut sut = plant("ideal", "standing", 1);
    let mass = mass(&mut sut);
    assert!((mass - model.mass()).abs() < 1e-9 * mass, "{mass} and {}", model.mass());
}
