//! The imperfections of the simulated robot: `ideal` has none, `hw` has all, each can be switched by itself and
//! does what it says.
#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::{Path, PathBuf};

use locoman_robot::dynamics::{Dynamics, State};
use locoman_robot::joints::{JointVector, Side};
use locoman_robot::model::Model;
use locoman_robot::plant::{JointCommand, Sensors};
use locoman_sim::robot::body::built;
use locoman_sim::robot::scene::Scene;
use locoman_sim::robot::{Disturbance, EXCHANGE_S, Options, SimRobot, Target, Truth};
use nalgebra::Vector3;
use toml::{Table, Value};

/// Keys that do something only with another one.
const WITH: [(&str, &str); 1] = [("feet.damping_n_s_m", "feet.stiffness_n_m")];
const COUNT_RAD: f64 = std::f64::consts::TAU / 4096.0;
const JOINT_3: usize = 14;

fn configs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs")
}

fn scene_file() -> Table {
    std::fs::read_to_string(configs().join("scenes/robot.toml")).unwrap().parse().unwrap()
}

/// `section.key` and value of everything in a profile.
fn keys(scene: &Table, profile: &str) -> Vec<(String, Value)> {
    let sections = scene["profile"][profile].as_table().unwrap();
    let all = sections.iter().flat_map(|(section, keys)| {
        let keys = keys.as_table().unwrap().iter();
        keys.map(move |(key, value)| (format!("{section}.{key}"), value.clone()))
    });
    all.collect()
}

/// A robot with the imperfections of `ideal` but for these keys, which are as in `hw`.
fn robot(switched_on: &[&str], seed: u64) -> SimRobot {
    let mut scene = scene_file();
    let hw = keys(&scene, "hw");
    for name in switched_on {
        let (_, value) = hw.iter().find(|(key, _)| key == name).unwrap();
        let (section, key) = name.split_once('.').unwrap();
        scene["profile"]["ideal"][section][key] = value.clone();
    }
    let scene: Scene = scene.try_into().unwrap();
    let model = Model::load(&configs().join("robot")).unwrap();
    let options = Options { profile: "ideal".into(), posture: "standing".into(), seed, ..Options::default() };
    SimRobot::with_model(&model, scene, &options).unwrap()
}

/// Stand by joint position control alone, arms stretched forward.
fn stand() -> JointCommand {
    let mut command = JointCommand::damping();
    for joint in 0..12 {
        command.position[joint] = [0.0, 0.9, -1.8][joint % 3];
        command.kp[joint] = 100.01;
        command.kd[joint] = 2.01;
        command.torque[joint] = 0.001;
    }
    for arm in [12, 15] {
        command.position[arm] = -1.0;
    }
    command.kd.rows_mut(12, 6).fill(0.0);
    command
}

fn run(sut: &mut SimRobot, command: &JointCommand, seconds: f64) -> (Vec<Sensors>, Truth) {
    let exchanges = (seconds / EXCHANGE_S).round() as usize;
    let samples = (0..exchanges).map(|_| {
        sut.send(command, 0);
        sut.advance().unwrap()
    });
    (samples.collect(), sut.truth())
}

#[test]
fn ideal_has_no_imperfection_and_hw_has_all() {
    let off = |value: &Value| value.as_float() == Some(0.0) || value.as_bool() == Some(false);
    let scene = scene_file();
    let (ideal, hw) = (keys(&scene, "ideal"), keys(&scene, "hw"));
    assert_eq!(ideal.len(), hw.len());
    for ((name, ideal), (_, hw)) in ideal.iter().zip(&hw) {
        assert!(off(ideal) && !off(hw), "{name}: {ideal} and {hw}");
    }
}

#[test]
fn each_imperfection_alone_is_felt_in_what_the_robot_measures() {
    let moving = |sut: &mut SimRobot| {
        let mut command = stand();
        let mut samples = run(sut, &command, 0.1).0;
        command.position[0] += 0.02;
        command.position[13] += 0.2;
        command.velocity[13] = 0.1;
        samples.extend(run(sut, &command, 0.2).0);
        samples
    };
    let perfect = moving(&mut robot(&[], 1));
    for (name, _) in keys(&scene_file(), "hw") {
        let with = WITH.iter().find(|(key, _)| *key == name).map(|(_, other)| *other);
        let without = with.map_or_else(|| perfect.clone(), |other| moving(&mut robot(&[other], 1)));
        let names: Vec<&str> = with.into_iter().chain([name.as_str()]).collect();
        assert!(moving(&mut robot(&names, 1)) != without, "{name} changes nothing");
    }
}

#[test]
fn an_ideal_robot_measures_the_truth_and_takes_nothing_from_the_seed() {
    let mut sut = robot(&[], 1);
    let (samples, truth) = run(&mut sut, &stand(), 0.5);
    let sensors = samples.last().unwrap();
    assert_eq!(sensors.position, truth.joint_position);
    assert_eq!(sensors.torque.as_slice(), &sut.applied_torques()[..18]);
    assert_eq!(sensors.foot_force, truth.foot_force_n);
    let [w, i, j, k] = sensors.attitude;
    let attitude = truth.world_from_torso.rotation.coords;
    assert!((attitude - nalgebra::Vector4::new(i, j, k, w)).norm() < 1e-12);
    assert!(samples == run(&mut robot(&[], 2), &stand(), 0.5).0);
}

#[test]
fn rubber_feet_sink_by_force_over_stiffness() {
    let mut sut = robot(&["feet.stiffness_n_m", "feet.damping_n_s_m"], 1);
    let truth = run(&mut sut, &stand(), 3.0).1;
    for (foot, force) in truth.feet_in_world.iter().zip(truth.foot_force_n) {
        let (sinks, expected) = (0.02 - foot.z, force / 40_000.0);
        assert!(force > 20.0 && (sinks / expected - 1.0).abs() < 0.01, "{force} N: {sinks} m");
    }
}

#[test]
fn standing_feet_do_not_creep() {
    for feet in [vec![], vec!["feet.stiffness_n_m", "feet.damping_n_s_m"]] {
        let mut sut = robot(&feet, 1);
        let before = run(&mut sut, &stand(), 2.0).1;
        let after = run(&mut sut, &stand(), 5.0).1;
        for foot in 0..4 {
            let crept = (after.feet_in_world[foot] - before.feet_in_world[foot]).norm();
            // A tenth of what must be tracked in eight seconds with the imperfections off.
            assert!(crept < 2e-5, "{feet:?}: foot {foot} crept by {crept} m");
        }
    }
}

#[test]
fn a_link_has_the_play_of_its_servos_gears() {
    let friction = ["joints.arm_coulomb_nm", "joints.arm_bearing_nm"];
    let turns = |keys: &[&str]| {
        let mut sut = robot(keys, 1);
        run(&mut sut, &stand(), 1.0);
        // More than the bearing's friction, less than that of motor and gears.
        let [one, other] = [0.01, -0.01].map(|torque| {
            let before = sut.truth().world_from_gripper[0].rotation;
            let torque_nm = before * Vector3::new(0.0, 0.0, torque);
            let push = Disturbance::Push {
                target: Target::Gripper(Side::Right),
                force_n: Vector3::zeros(),
                torque_nm,
                duration_s: 0.5,
            };
            sut.disturb(&push).unwrap();
            run(&mut sut, &stand(), 0.5).1.joint_position[JOINT_3]
        });
        one - other
    };
    let play = turns(&[friction[0], friction[1], "servos.backlash_rad"]);
    assert!((play - 0.25_f64.to_radians()).abs() < 2e-4, "{play} rad");
    let without = turns(&friction);
    assert!(without.abs() < 1e-4, "friction holds what has no play: {without} rad");
}

#[test]
fn a_servo_knows_goals_and_angles_in_whole_counts() {
    let mut sut = robot(&["servos.counts_per_turn"], 1);
    let (samples, truth) = run(&mut sut, &stand(), 0.5);
    for joint in 12..18 {
        let counts = samples.last().unwrap().position[joint] / COUNT_RAD;
        assert!((counts - counts.round()).abs() < 1e-6, "{counts}");
        assert!((counts - truth.joint_position[joint] / COUNT_RAD).abs() <= 0.5);
    }
    // A tenth of a count away from the middle of one: the same goal.
    let mut near = stand();
    near.position[13] += 0.1 * COUNT_RAD;
    assert!(samples == run(&mut robot(&["servos.counts_per_turn"], 1), &near, 0.5).0);
    assert!(run(&mut robot(&[], 1), &stand(), 0.5) != run(&mut robot(&[], 1), &near, 0.5));
}

#[test]
fn feed_forward_reaches_a_servo_as_an_offset_of_its_goal() {
    let keys = ["servos.counts_per_turn", "servos.loop_period_s", "servos.bus_period_s"];
    let settled = |torque| {
        let mut command = stand();
        command.torque[13] = torque;
        run(&mut robot(&keys, 1), &command, 2.0).1.joint_position[13]
    };
    // 768 / 128 PWM units a count, 885 for 0.92 N m: 4.07 N m/rad.
    let turned = settled(0.1) - settled(0.0);
    assert!((turned - 0.1 / 4.07).abs() < 1.5 * COUNT_RAD, "{turned} rad");
    // Less than half a count of offset is lost, unless it tips the rounding.
    let step = (settled(0.002) - settled(0.0)).abs();
    assert!(!(1e-9..0.5 * COUNT_RAD).contains(&step), "{step}");
}

#[test]
fn the_servo_bus_runs_at_200_hz() {
    let mut sut = robot(&["servos.bus_period_s"], 1);
    let mut command = stand();
    run(&mut sut, &command, 0.5);
    command.position[14] += 0.5;
    let samples = run(&mut sut, &command, 0.05).0;
    let changes = samples.windows(2).filter(|pair| pair[0].position[14] != pair[1].position[14]).count();
    assert!((9..=10).contains(&changes), "{changes} readings in 20 exchanges");
}

#[test]
fn the_legs_wire_leaves_what_32_bits_hold() {
    let mut sut = robot(&["sensors.go1_wire"], 1);
    let sensors = *run(&mut sut, &stand(), 0.1).0.last().unwrap();
    for joint in 0..12 {
        assert_eq!(sensors.position[joint], f64::from(sensors.position[joint] as f32));
        assert_eq!(sensors.torque[joint] * 256.0, (sensors.torque[joint] * 256.0).trunc());
    }
}

#[test]
fn mass_and_centre_of_mass_are_off_by_what_the_seed_says() {
    let model = Model::load(&configs().join("robot")).unwrap();
    let errors = Scene::load(&configs()).unwrap().profile("hw").unwrap().body;
    let com = |model: &Model| {
        let mut dynamics = Dynamics::new();
        dynamics.update(model, &State::at_rest(JointVector::zeros()));
        *dynamics.com()
    };
    let drawn: Vec<(f64, Vector3<f64>)> = (0..200)
        .map(|seed| {
            let robot = built(&model, &errors, seed);
            (robot.mass() / model.mass() - 1.0, com(&robot) - com(&model))
        })
        .collect();
    let shares = drawn.iter().map(|(share, _)| *share);
    assert!(shares.clone().all(|share| share.abs() <= 0.1));
    assert!(shares.clone().fold(0.0, f64::max) > 0.09 && shares.fold(0.0, f64::min) < -0.09);
    assert!(drawn.iter().all(|(_, offset)| (offset.norm() - 0.005).abs() < 1e-9));
    for axis in 0..3 {
        let positive = drawn.iter().filter(|(_, offset)| offset[axis] > 0.0).count();
        assert!((60..140).contains(&positive), "axis {axis}: {positive} of 200");
    }
    assert_eq!(built(&model, &errors, 7), built(&model, &errors, 7));
}

#[test]
fn friction_holds_a_joint_against_less_than_itself() {
    let moved = |keys: &[&str]| {
        let mut sut = robot(keys, 1);
        let mut command = stand();
        // Without a position gain: friction and feed-forward alone, on a roll joint without gravity.
        command.kp[JOINT_3] = 0.0;
        command.kd[JOINT_3] = 1e-3;
        run(&mut sut, &command, 0.2);
        command.torque[JOINT_3] = 0.02;
        let before = sut.truth().joint_position[JOINT_3];
        run(&mut sut, &command, 0.2).1.joint_position[JOINT_3] - before
    };
    assert!(moved(&["joints.arm_coulomb_nm"]).abs() < 1e-3);
    assert!(moved(&[]).abs() > 0.05);
}
