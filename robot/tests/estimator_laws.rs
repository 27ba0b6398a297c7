//! Laws of the estimator, on a robot without mass: its torso moves as told, its feet roll, sink in and slip by
//! the geometry that the estimator assumes, and its sensors are exact.

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::Path;

use locoman_robot::{
    estimator::{EstimatorSettings, KinematicEstimator},
    joints::{JointVector, Leg, Side},
    kinematics::FootKinematics,
    model::{FOOT_RADIUS_M, GRAVITY, Model},
    plant::Sensors,
    wbc::ContactSet,
};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;

const DT_S: f64 = 0.0025;
/// What the filters' lag and the rectangle rule of the gyroscope leave of exact sensors, m and rad.
const POSITION_M: f64 = 3e-5;
const ROTATION_RAD: f64 = 1e-4;
/// Weight on each foot, N.
const LOAD_N: f64 = 33.0;

/// A smooth motion of the torso that begins at rest.
#[derive(Debug, Clone, Copy)]
struct Motion {
    length: Vector3<f64>,
    angle: Vector3<f64>,
    start: Isometry3<f64>,
}

impl Motion {
    /// Displacement s(t) of an amplitude of one, its velocity and acceleration: (1 - cos ωt) / 2.
    fn course(t: f64) -> [f64; 3] {
        let w = std::f64::consts::TAU * 0.3;
        let (sin, cos) = (w * t).sin_cos();
        [0.5 * (1.0 - cos), 0.5 * w * sin, 0.5 * w * w * cos]
    }

    fn pose(&self, t: f64) -> Isometry3<f64> {
        let s = Self::course(t)[0];
        let turn = UnitQuaternion::from_scaled_axis(self.angle * s);
        let place = self.start.translation.vector + self.length * s;
        Isometry3::from_parts(place.into(), turn * self.start.rotation)
    }
}

/// The robot and its truth.
struct Robot {
    model: Model,
    settings: EstimatorSettings,
    motion: Motion,
    ticks: u64,
    /// In the world, on ground of height zero.
    world_from_torso: Isometry3<f64>,
    feet: [Vector3<f64>; 4],
    load_n: [f64; 4],
    /// Velocity with which a contact point slips, m/s.
    slip: [Vector3<f64>; 4],
    gyro_bias: Vector3<f64>,
    sensors: Sensors,
}

impl Robot {
    /// Stands with a posture about the usual one, so that its torso is at `motion.start`.
    fn standing(motion: Motion) -> Self {
        let model = Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/robot")).unwrap();
        let settings = EstimatorSettings::default();
        let mut position = JointVector::zeros();
        for leg in Leg::ALL {
            position.fixed_rows_mut::<3>(leg.first_joint()).copy_from_slice(&[0.0, 0.9, -1.8]);
        }
        let height = FOOT_RADIUS_M - settings.foot_sink_m_n * LOAD_N;
        let feet = Leg::ALL.map(|leg| {
            let foot = FootKinematics::new(&model, &position, leg).position();
            Vector3::new(foot.x, foot.y, height)
        });
        let sensors = Sensors {
            time_ns: 0,
            position,
            velocity: JointVector::zeros(),
            torque: JointVector::zeros(),
            opening: [0.0; 2],
            attitude: [1.0, 0.0, 0.0, 0.0],
            gyro: [0.0; 3],
            accelerometer: [0.0; 3],
            foot_force: [LOAD_N; 4],
        };
        let mut robot = Self {
            model,
            settings,
            world_from_torso: motion.start,
            motion,
            ticks: 0,
            feet,
            load_n: [LOAD_N; 4],
            slip: [Vector3::zeros(); 4],
            gyro_bias: Vector3::zeros(),
            sensors,
        };
        for leg in Leg::ALL {
            robot.reach(leg);
        }
        robot.sense(&Vector3::zeros());
        robot
    }

    fn kinematics(&self, leg: Leg) -> FootKinematics {
        FootKinematics::new(&self.model, &self.sensors.position, leg)
    }

    /// Newton steps of a leg's joints to where its foot is.
    fn reach(&mut self, leg: Leg) {
        let goal = self.world_from_torso.inverse_transform_point(&self.feet[leg.index()].into()).coords;
        for _ in 0..8 {
            let foot = self.kinematics(leg);
            let step = foot.linear.try_inverse().unwrap() * (goal - foot.position());
            let mut joints = self.sensors.position.fixed_rows_mut::<3>(leg.first_joint());
            joints += step;
        }
    }

    fn depth(&self, leg: Leg) -> f64 {
        self.settings.foot_sink_m_n * self.load_n[leg.index()]
    }

    /// One sample on.
    fn step(&mut self) {
        self.ticks += 1;
        let before = self.world_from_torso;
        self.world_from_torso = self.motion.pose(self.ticks as f64 * DT_S);
        for leg in Leg::ALL {
            let rolling = FOOT_RADIUS_M - 0.5 * self.depth(leg);
            let rotation = before.rotation * self.kinematics(leg).torso_from_foot.rotation;
            let mut place = self.feet[leg.index()] + self.slip[leg.index()] * DT_S;
            place.z = FOOT_RADIUS_M - self.depth(leg);
            self.feet[leg.index()] = place;
            // How far it rolls depends on where it rolls to.
            for _ in 0..3 {
                self.reach(leg);
                let now = self.world_from_torso.rotation * self.kinematics(leg).torso_from_foot.rotation;
                let turned = (now * rotation.inverse()).scaled_axis();
                self.feet[leg.index()] = place + rolling * turned.cross(&Vector3::z());
            }
            self.reach(leg);
        }
        let turn = (before.rotation.inverse() * self.world_from_torso.rotation).scaled_axis();
        self.sense(&(turn / DT_S));
    }

    /// Fills in the sensors; joints are there already.
    fn sense(&mut self, turn_rate: &Vector3<f64>) {
        let rotation = self.world_from_torso.rotation;
        let [_, speed, acceleration] = Motion::course(self.ticks as f64 * DT_S);
        let velocity = self.motion.length * speed;
        for leg in Leg::ALL {
            // v + R (J dq + ω × x) = R (ω + A dq) × ρ n + slip, for dq.
            let foot = self.kinematics(leg);
            let up = (FOOT_RADIUS_M - 0.5 * self.depth(leg)) * Vector3::z();
            let roll = Matrix3::from_columns(&[0, 1, 2].map(|joint| {
                let axis = rotation * foot.angular.column(joint);
                axis.cross(&up) - rotation * foot.linear.column(joint)
            }));
            let rest = velocity - self.slip[leg.index()] + rotation * turn_rate.cross(&foot.position())
                - (rotation * turn_rate).cross(&up);
            let joints = roll.try_inverse().unwrap() * rest;
            self.sensors.velocity.fixed_rows_mut::<3>(leg.first_joint()).copy_from(&joints);
        }
        let force = rotation.inverse() * (self.motion.length * acceleration + GRAVITY * Vector3::z());
        self.sensors.time_ns = self.ticks * 2_500_000;
        self.sensors.attitude = [rotation.w, rotation.i, rotation.j, rotation.k];
        self.sensors.gyro = (turn_rate + self.gyro_bias).into();
        self.sensors.accelerometer = force.into();
        self.sensors.foot_force = self.load_n;
    }
}

/// Robot and estimator, which begin with a reset.
struct Trial {
    robot: Robot,
    sut: KinematicEstimator,
    contacts: ContactSet,
    /// From the estimator's world to the truth's.
    truth_from_world: Isometry3<f64>,
}

impl Trial {
    fn new(motion: Motion, contacts: ContactSet) -> Self {
        let mut robot = Robot::standing(motion);
        for leg in Leg::ALL.into_iter().filter(|leg| !contacts.contains(*leg)) {
            robot.load_n[leg.index()] = 0.0;
        }
        robot.sense(&Vector3::zeros());
        let mut sut = KinematicEstimator::new(robot.settings);
        sut.reset(&robot.model, &robot.sensors, &contacts);
        let truth_from_world = robot.world_from_torso * sut.world_from_torso().inverse();
        Self { robot, sut, contacts, truth_from_world }
    }

    fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds / DT_S).round() as usize {
            self.robot.step();
            self.sut.update(&self.robot.model, &self.robot.sensors, &self.contacts, DT_S);
        }
    }

    /// Distance and angle between estimate and truth.
    fn error(&self) -> (f64, f64) {
        let truth = self.robot.world_from_torso;
        let found = self.truth_from_world * self.sut.world_from_torso();
        let away = (found.translation.vector - truth.translation.vector).norm();
        (away, found.rotation.angle_to(&truth.rotation))
    }

    /// Angle between the estimate of up and up.
    fn tilt_error(&self) -> f64 {
        let found = self.sut.world_from_torso().rotation.inverse() * Vector3::z();
        found.angle(&(self.robot.world_from_torso.rotation.inverse() * Vector3::z()))
    }
}

fn motion(length_m: f64, angle_rad: f64) -> impl Strategy<Value = Motion> {
    prop::collection::vec(-1.0..1.0_f64, 6).prop_map(move |n| Motion {
        length: Vector3::new(n[0], n[1], n[2]) * length_m,
        angle: Vector3::new(n[3], n[4], n[5]) * angle_rad,
        start: Isometry3::translation(0.0, 0.0, 0.285),
    })
}

fn contacts() -> impl Strategy<Value = ContactSet> {
    let three = prop::sample::select(Side::ALL.to_vec()).prop_map(|side| ContactSet::without(side.leg()));
    prop_oneof![Just(ContactSet::STANCE), three]
}

fn leg_of(contacts: &ContactSet, choice: usize) -> Leg {
    let legs: Vec<Leg> = contacts.legs().collect();
    legs[choice % legs.len()]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn feet_that_roll_give_back_the_torsos_motion(motion in motion(0.04, 0.2), contacts in contacts()) {
        let mut trial = Trial::new(motion, contacts);
        for _ in 0..20 {
            trial.run(0.2);
            let (position, rotation) = trial.error();
            prop_assert!(position < POSITION_M && rotation < ROTATION_RAD, "{position} {rotation}");
            let wanted = motion.length * Motion::course(trial.robot.ticks as f64 * DT_S)[1];
            let state = trial.sut.state(&trial.robot.sensors);
            let twist = state.torso_twist.fixed_rows::<3>(0).into_owned();
            let velocity = trial.truth_from_world.rotation * (state.world_from_torso.rotation * twist);
            prop_assert!((velocity - wanted).norm() < 1e-3, "{velocity} {wanted}");
        }
    }

    #[test]
    fn loads_that_move_between_the_feet_do_not_tilt_the_estimate(
        motion in motion(0.02, 0.1), contacts in contacts(), share in prop::array::uniform4(-0.5..0.5_f64),
    ) {
        let mut trial = Trial::new(motion, contacts);
        for _ in 0..800 {
            let s = Motion::course(trial.robot.ticks as f64 * DT_S)[0];
            for leg in contacts.legs() {
                trial.robot.load_n[leg.index()] = LOAD_N * (1.0 + share[leg.index()] * s);
            }
            trial.run(DT_S);
            let (position, rotation) = trial.error();
            // The forces are filtered: 16 ms of the fastest change of load, 16 N in 0.8 s.
            prop_assert!(position < 5e-5 && rotation < 2e-4, "{position} {rotation}");
        }
    }

    #[test]
    fn a_reset_of_a_tilted_torso_knows_where_up_is(
        motion in motion(0.02, 0.1), tilt in prop::array::uniform2(-0.2..0.2_f64), yaw in -3.0..3.0_f64,
        bias in prop::array::uniform3(-2e-3..2e-3_f64),
    ) {
        let turn = UnitQuaternion::from_euler_angles(tilt[0], tilt[1], 0.0);
        let start = Isometry3::from_parts(motion.start.translation, turn);
        let mut trial = Trial::new(Motion { start, ..motion }, ContactSet::STANCE);
        prop_assert!(trial.tilt_error() < 1e-12);
        // What the IMU takes for north is of no account.
        let north = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw);
        trial.robot.gyro_bias = bias.into();
        for _ in 0..2000 {
            trial.robot.step();
            let [w, i, j, k] = trial.robot.sensors.attitude;
            let attitude = north * UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, i, j, k));
            trial.robot.sensors.attitude = [attitude.w, attitude.i, attitude.j, attitude.k];
            trial.sut.update(&trial.robot.model, &trial.robot.sensors, &trial.contacts, DT_S);
            // A gyroscope's bias may turn it by bias times time constant until it is learnt.
            prop_assert!(trial.tilt_error() < 4e-4, "{}", trial.tilt_error());
        }
        trial.run(10.0);
        let (position, rotation) = trial.error();
        prop_assert!(trial.tilt_error() < ROTATION_RAD, "{}", trial.tilt_error());
        prop_assert!(position < 1e-4 && rotation < 3e-4, "{position} {rotation}");
    }

    #[test]
    fn a_foot_that_slips_hardly_moves_the_estimate(
        motion in motion(0.02, 0.1), contacts in contacts(), choice in 0..4_usize,
        direction in -3.1..3.1_f64, speed in 0.03..0.3_f64,
    ) {
        let mut trial = Trial::new(motion, contacts);
        trial.run(1.0);
        let leg = leg_of(&contacts, choice).index();
        trial.robot.slip[leg] = speed * Vector3::new(direction.cos(), direction.sin(), 0.0);
        // 3 cm.
        for _ in 0..20 {
            trial.run(0.03 / speed / 20.0);
            let (position, rotation) = trial.error();
            prop_assert!(position < 7e-4 && rotation < 4e-3, "{position} {rotation}");
        }
        trial.robot.slip[leg] = Vector3::zeros();
        prop_assert_eq!(trial.sut.slips(), 1);
        trial.run(3.0);
        let (position, rotation) = trial.error();
        prop_assert_eq!(trial.sut.slips(), 1);
        prop_assert!(position < 7e-4 && rotation < 3e-3, "{position} {rotation}");
    }

    #[test]
    fn a_foot_is_lifted_and_set_down_elsewhere_in_the_same_world(
        motion in motion(0.02, 0.1), side in prop::sample::select(Side::ALL.to_vec()),
        step in prop::array::uniform2(-0.03..0.03_f64),
    ) {
        let mut trial = Trial::new(motion, ContactSet::STANCE);
        trial.run(0.5);
        let leg = side.leg();
        trial.contacts = ContactSet::without(leg);
        trial.robot.load_n[leg.index()] = 0.0;
        trial.robot.slip[leg.index()] = Vector3::new(step[0], step[1], 0.0);
        trial.run(1.0);
        trial.robot.slip[leg.index()] = Vector3::zeros();
        for percent in 1..=100_u32 {
            let share = 0.01 * f64::from(percent);
            trial.robot.load_n[leg.index()] = LOAD_N * share;
            trial.contacts = ContactSet::STANCE.with_share(leg, share);
            trial.run(DT_S);
        }
        trial.run(2.0);
        let (position, rotation) = trial.error();
        prop_assert!(position < 3.0 * POSITION_M && rotation < 3.0 * ROTATION_RAD, "{position} {rotation}");
        prop_assert_eq!((trial.sut.resets(), trial.sut.slips()), (1, 0));
    }

    #[test]
    fn the_world_may_be_moved_at_any_time(
        motion in motion(0.02, 0.1), place in prop::array::uniform3(-1.0..1.0_f64), yaw in -3.0..3.0_f64,
    ) {
        let mut trial = Trial::new(motion, ContactSet::STANCE);
        trial.run(0.5);
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw);
        let new_from_old = Isometry3::from_parts(Vector3::from(place).into(), turn);
        trial.sut.rebase(&new_from_old);
        trial.truth_from_world *= new_from_old.inverse();
        trial.run(2.0);
        let (position, rotation) = trial.error();
        prop_assert!(position < POSITION_M && rotation < ROTATION_RAD, "{position} {rotation}");
    }
}

#[test]
fn feet_that_feel_nothing_are_believed_when_there_are_no_others() {
    let motion = Motion {
        length: Vector3::new(0.02, -0.02, 0.01),
        angle: Vector3::new(0.05, 0.05, 0.1),
        start: Isometry3::translation(0.0, 0.0, 0.285),
    };
    let mut trial = Trial::new(motion, ContactSet::STANCE);
    trial.robot.load_n = [0.0; 4];
    // The feet are where they are without load, so the torso seems to sink by what they rise.
    trial.run(4.0);
    let (position, rotation) = trial.error();
    assert!(position < 2e-3 && rotation < 2e-3, "{position} {rotation}");
}

#[test]
fn the_same_samples_give_the_same_bits() {
    let motion = Motion {
        length: Vector3::new(0.02, -0.02, 0.01),
        angle: Vector3::new(0.05, 0.05, 0.1),
        start: Isometry3::translation(0.0, 0.0, 0.285),
    };
    let run = || {
        let mut trial = Trial::new(motion, ContactSet::without(Leg::FrontLeft));
        trial.run(1.0);
        trial.sut.state(&trial.robot.sensors)
    };
    assert_eq!(run(), run());
}
