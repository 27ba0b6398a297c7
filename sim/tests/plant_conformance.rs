//! What every plant must do, run over each of them: in lockstep, and over the real robot's wires in real time.
#![expect(clippy::unwrap_used, clippy::panic, reason = "in a test a panic is the report")]

mod wires;

use locoman_robot::joints::JointVector;
use locoman_robot::plant::{JointCommand, Plant, PlantError, Sensors};
use locoman_sim::robot::{LockstepPlant, Options, Truth};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use wires::{Wires, configs, stand};

/// A plant, and what really goes on behind it.
trait Sut: Plant {
    fn truth(&mut self) -> Truth;
}

impl Sut for LockstepPlant {
    fn truth(&mut self) -> Truth {
        Self::truth(self)
    }
}

impl Plant for Wires {
    fn exchange(&mut self, command: &JointCommand) -> Result<Sensors, PlantError> {
        self.plant.exchange(command)
    }
}

impl Sut for Wires {
    fn truth(&mut self) -> Truth {
        self.robot.truth().unwrap()
    }
}

fn each(posture: &str, law: impl Fn(&mut dyn Sut)) {
    let options = Options { posture: posture.into(), ..Options::default() };
    law(&mut LockstepPlant::new(&configs(), &options).unwrap());
    law(&mut Wires::new(posture));
}

/// The samples of so much of the plant's own time. A sample that does not come is asked for again.
fn run(sut: &mut dyn Sut, command: &JointCommand, seconds: f64) -> Vec<Sensors> {
    let mut samples: Vec<Sensors> = Vec::new();
    let mut silences = 0;
    loop {
        match sut.exchange(command) {
            Ok(sensors) => samples.push(sensors),
            Err(PlantError::Silent { .. }) => silences += 1,
            Err(error) => panic!("{error}"),
        }
        assert!(silences < 1000, "the plant says nothing");
        let times = samples.first().zip(samples.last());
        if times.is_some_and(|(first, last)| (last.time_ns - first.time_ns) as f64 * 1e-9 >= seconds) {
            return samples;
        }
    }
}

#[test]
fn it_stands_by_joint_control_alone_and_tells_what_is_so() {
    each("standing", |sut| {
        let samples = run(sut, &stand(), 1.5);
        let (last, truth) = (samples.last().unwrap(), sut.truth());
        assert!(!truth.fallen);
        assert!((0.25..0.30).contains(&truth.world_from_torso.translation.z));
        // Noise of 0.0002 rad, and what moves within the age of a sample.
        let legs = (last.position - truth.joint_position).rows(0, 12).amax();
        assert!(legs < 0.005, "{legs} rad");
        let weight = |of: &dyn Fn(&Sensors) -> f64| {
            let tail = &samples[samples.len() - 100..];
            tail.iter().map(of).sum::<f64>() / tail.len() as f64
        };
        let felt = weight(&|sample| sample.foot_force.iter().sum());
        let real: f64 = truth.foot_force_n.iter().sum();
        assert!((felt - real).abs() < 0.1 * real, "{felt} N felt, {real} N real");
        let gravity = weight(&|sample| sample.accelerometer[2]);
        assert!((gravity - 9.81).abs() < 0.2, "{gravity} m/s2");
        let [w, x, y, z] = last.attitude;
        let attitude = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        assert!((attitude * Vector3::z()).z > 0.999 && (w * w + x * x + y * y + z * z - 1.0).abs() < 1e-6);
    });
}

#[test]
fn its_clock_goes_forwards_by_the_time_of_a_sample() {
    each("standing", |sut| {
        let samples = run(sut, &stand(), 0.5);
        for pair in samples.windows(2) {
            assert!(pair[1].time_ns > pair[0].time_ns, "{} then {}", pair[0].time_ns, pair[1].time_ns);
        }
        let span_s = (samples[samples.len() - 1].time_ns - samples[0].time_ns) as f64 * 1e-9;
        let period_s = span_s / (samples.len() - 1) as f64;
        assert!((0.0015..0.004).contains(&period_s), "{period_s} s a sample");
    });
}

#[test]
fn a_command_that_is_no_number_moves_nothing() {
    each("standing", |sut| {
        run(sut, &stand(), 0.3);
        let mut broken = stand();
        broken.position[4] = f64::NAN;
        let samples = run(sut, &broken, 0.1);
        let speed = samples.iter().map(|sample| sample.velocity.rows(0, 12).amax()).fold(0.0, f64::max);
        assert!(speed < 3.0, "{speed} rad/s");
        run(sut, &stand(), 0.3);
        assert!(!sut.truth().fallen);
    });
}

#[test]
fn damping_lets_it_down_softly() {
    each("standing", |sut| {
        run(sut, &stand(), 0.3);
        let samples = run(sut, &JointCommand::damping(), 1.5);
        assert!(sut.truth().world_from_torso.translation.z < 0.16);
        let speed = samples.iter().map(|sample| sample.velocity.rows(0, 12).amax()).fold(0.0, f64::max);
        assert!(speed < 8.0, "{speed} rad/s");
        assert!(samples.iter().all(Sensors::is_finite));
    });
}

#[test]
fn arms_and_jaws_go_where_they_are_told() {
    each("standing", |sut| {
        let mut wish = stand();
        run(sut, &wish, 0.3);
        wish.position[12] = -2.6;
        wish.position[15] = -2.7;
        wish.opening = [1.0, 0.5];
        let last = *run(sut, &wish, 1.5).last().unwrap();
        let truth = sut.truth();
        // Servos have no integral part: what gravity bends a stiffness of 5 N m/rad by, and the play of the gears.
        for (joint, goal) in [(12, -2.6), (15, -2.7)] {
            let (told, real) = (last.position[joint], truth.joint_position[joint]);
            assert!((real - goal).abs() < 0.06, "joint {joint}: {real} rad");
            assert!((told - real).abs() < 0.005, "joint {joint}: {told} rad told, {real} rad real");
        }
        for side in 0..2 {
            assert!((last.opening[side] - wish.opening[side]).abs() < 0.05, "{:?}", last.opening);
            assert!((truth.opening[side] - wish.opening[side]).abs() < 0.05, "{:?}", truth.opening);
        }
    });
}

#[test]
fn torques_that_are_asked_for_arrive() {
    each("standing", |sut| {
        run(sut, &stand(), 0.5);
        let mut kick = stand();
        kick.torque[3] = 4.0;
        let before = run(sut, &stand(), 0.05).last().unwrap().torque;
        let after: Vec<JointVector> = run(sut, &kick, 0.02).iter().map(|sample| sample.torque).collect();
        let rise = after.iter().map(|torque| torque[3] - before[3]).fold(f64::MIN, f64::max);
        assert!(rise > 2.0, "{rise} N m");
    });
}
