//! Where the torso is and how it moves, from the legs that stand and the IMU.
//!
//! ```text
//! gyroscope ───────► attitude: turns on ──┐
//! IMU's tilt ──────► corrects roll, pitch ┤
//! anchors, joints ─► corrects all axes    ├─► R ─► feet: torso's position and velocity by each ─► slip?
//!                                         │                                                        │
//! accelerometer ─► motion: moves on ──────┴────────────────── corrected by the feet that stand ◄───┘
//! ```
//! It begins as the paper's kinematic estimator (appendix, "State Estimation": the feet stand, so the joints tell
//! where the torso is) and adds what that leaves out: feet that roll, sink in and slip ([`foot`]), the IMU's
//! tilt and turn rate ([`attitude`]), and its acceleration ([`motion`]). With the attitude known each foot gives
//! the torso's position alone, p = c - R x (c: centre of the foot, by its anchor; x: the same in the torso's
//! frame), so one foot that slips is told from the others, also when only three stand.
//!
//! The *world* is the torso's frame at the last reset with its tilt taken out by the IMU: x is the torso's
//! heading, z is up. A reset of a torso that stands level is the paper's.

mod attitude;
mod foot;
mod motion;
mod settings;
mod sighting;

use attitude::AttitudeFilter;
pub use attitude::{heading, tilt, tilt_angle};
use foot::StandingFoot;
use motion::MotionFilter;
use nalgebra::{Isometry3, Vector3, Vector6};
pub use settings::EstimatorSettings;
use sighting::{Sighting, Sightings, for_each_apart, turn_error};

use crate::{
    dynamics::State,
    joints::Leg,
    kinematics::{FootKinematics, of_leg},
    model::Model,
    plant::Sensors,
    wbc::ContactSet,
};

/// Estimates the state of torso and joints. Allocates nothing.
#[derive(Debug, Clone)]
pub struct KinematicEstimator {
    settings: EstimatorSettings,
    attitude: AttitudeFilter,
    motion: MotionFilter,
    feet: [StandingFoot; 4],
    /// In the torso's frame.
    angular_velocity: Vector3<f64>,
    resets: u64,
    slips: u64,
}

impl KinematicEstimator {
    /// An estimator that needs a [`Self::reset`] before it says anything.
    pub fn new(settings: EstimatorSettings) -> Self {
        Self {
            settings,
            attitude: AttitudeFilter::new(),
            motion: MotionFilter::new(&settings),
            feet: [StandingFoot::default(); 4],
            angular_velocity: Vector3::zeros(),
            resets: 0,
            slips: 0,
        }
    }

    /// Makes a new world of the torso's frame as it is now: origin and heading are the torso's, z is up. What was
    /// learnt of the IMU's biases stays.
    pub fn reset(&mut self, model: &Model, sensors: &Sensors, contacts: &ContactSet) {
        self.attitude.world_from_torso = tilt(&sensors.attitude);
        self.motion.reset();
        self.angular_velocity = self.attitude.turn_rate(&sensors.gyro);
        for leg in Leg::ALL {
            self.feet[leg.index()].reset(sensors.foot_force[leg.index()]);
            if contacts.contains(leg) {
                self.anchor(leg, &FootKinematics::new(model, &sensors.position, leg));
            }
        }
        self.resets += 1;
    }

    /// Moves the world: whatever was at x in the old one is at `new_from_old` x in the new one.
    pub fn rebase(&mut self, new_from_old: &Isometry3<f64>) {
        let turn = new_from_old.rotation;
        self.attitude.world_from_torso = turn * self.attitude.world_from_torso;
        self.motion.position = new_from_old.transform_point(&self.motion.position.into()).coords;
        self.motion.velocity = turn * self.motion.velocity;
        for foot in &mut self.feet {
            foot.rebase(new_from_old);
        }
        self.resets += 1;
    }

    /// Takes in one sample. `contacts` are the feet that stand, by plan.
    pub fn update(&mut self, model: &Model, sensors: &Sensors, contacts: &ContactSet, dt_s: f64) {
        let kinematics = Leg::ALL.map(|leg| FootKinematics::new(model, &sensors.position, leg));
        for leg in Leg::ALL {
            let foot = &mut self.feet[leg.index()];
            foot.feel(sensors.foot_force[leg.index()], &self.settings, dt_s);
            if !contacts.contains(leg) {
                foot.lift();
            }
        }
        self.attitude.predict(&sensors.gyro, dt_s);
        self.correct_attitude(sensors, &self.sightings(&kinematics, contacts), dt_s);

        let rotation = self.attitude.world_from_torso;
        self.motion.predict(&rotation, &sensors.accelerometer, dt_s);
        for (foot, kinematics) in self.feet.iter_mut().zip(&kinematics) {
            foot.roll(&rotation, kinematics, &self.settings);
        }
        let velocities = self.velocities(sensors, &kinematics);
        self.find_slips(&self.sightings(&kinematics, contacts), &velocities, dt_s);

        let sightings = self.sightings(&kinematics, contacts);
        self.correct_motion(&sightings, &velocities);
        self.follow_creep(&sightings, dt_s);
        for leg in contacts.legs() {
            let foot = &self.feet[leg.index()];
            if !foot.is_anchored() || foot.slips() {
                self.anchor(leg, &kinematics[leg.index()]);
            }
        }
        let turn_rate = self.attitude.turn_rate(&sensors.gyro);
        self.angular_velocity +=
            low_pass(self.settings.gyro_cutoff_hz, dt_s) * (turn_rate - self.angular_velocity);
    }

    /// Without standing feet: keeps the place, follows tilt and turn rate.
    pub fn follow_tilt(&mut self, sensors: &Sensors) {
        self.attitude.world_from_torso = tilt(&sensors.attitude);
        self.motion.velocity = Vector3::zeros();
        self.angular_velocity = self.attitude.turn_rate(&sensors.gyro);
    }

    /// What each foot with an anchor says, for the attitude as it is.
    fn sightings(&self, kinematics: &[FootKinematics; 4], contacts: &ContactSet) -> Sightings {
        let rotation = &self.attitude.world_from_torso;
        Leg::ALL.map(|leg| {
            let (foot, kinematics) = (&self.feet[leg.index()], &kinematics[leg.index()]);
            Some(Sighting {
                leg,
                weight: foot.trust(contacts.share(leg), &self.settings),
                lever: rotation * kinematics.position(),
                centre: foot.centre(rotation, kinematics, &self.settings)?,
            })
        })
    }

    /// Roll and pitch by the IMU, all axes by the feet.
    fn correct_attitude(&mut self, sensors: &Sensors, sightings: &Sightings, dt_s: f64) {
        let by_imu = self.attitude.tilt_error(&sensors.attitude) * (dt_s / self.settings.imu_tilt_s);
        let by_feet = turn_error(sightings) * (dt_s / self.settings.feet_attitude_s);
        let correction = by_imu + by_feet;
        self.attitude.correct(&correction, 1.0 / self.settings.gyro_bias_s);
    }

    /// Velocity of the torso by each foot, if it rolls without slipping: v = ω_foot × ρ n - R (J dq + ω × x).
    fn velocities(&self, sensors: &Sensors, kinematics: &[FootKinematics; 4]) -> [Vector3<f64>; 4] {
        let turn_rate = self.attitude.turn_rate(&sensors.gyro);
        let rotation = &self.attitude.world_from_torso;
        Leg::ALL.map(|leg| {
            let (foot, kinematics) = (&self.feet[leg.index()], &kinematics[leg.index()]);
            let joints = of_leg(&sensors.velocity, leg);
            let turning = rotation * (turn_rate + kinematics.angular * joints);
            let moving = kinematics.linear * joints + turn_rate.cross(&kinematics.position());
            turning.cross(&foot.rolling_radius(&self.settings)) - rotation * moving
        })
    }

    /// Finds feet that slip, and those that have come to rest.
    ///
    /// A contact point must not move against the filter's velocity, which the accelerometer carries through the
    /// time that it takes to notice. At least two feet must be quiet to blame another.
    fn find_slips(&mut self, sightings: &Sightings, velocities: &[Vector3<f64>; 4], dt_s: f64) {
        let mut moves = [false; 4];
        for sighting in sightings.iter().flatten() {
            let leg = sighting.leg.index();
            // If the torso moves faster than a standing foot would have it, the foot moves by the difference.
            let sliding = self.motion.velocity - velocities[leg];
            moves[leg] = self.feet[leg].slide(&sliding, &self.settings, dt_s);
        }
        let quiet = sightings.iter().flatten().filter(|s| !moves[s.leg.index()]).count();
        for sighting in sightings.iter().flatten() {
            let moves = moves[sighting.leg.index()];
            let foot = &mut self.feet[sighting.leg.index()];
            if foot.slips() {
                foot.settle(moves, &self.settings, dt_s);
            } else if moves && quiet >= 2 {
                foot.begin_slip();
                self.slips += 1;
            }
        }
    }

    /// Position and velocity by the weighted mean of the feet.
    fn correct_motion(&mut self, sightings: &Sightings, velocities: &[Vector3<f64>; 4]) {
        let (mut weight, mut position, mut velocity) = (0.0, Vector3::zeros(), Vector3::zeros());
        for sighting in sightings.iter().flatten() {
            weight += sighting.weight;
            position += sighting.weight * sighting.position();
            velocity += sighting.weight * velocities[sighting.leg.index()];
        }
        if weight > 0.0 {
            let rotation = &self.attitude.world_from_torso;
            let variance = |sigma: f64| sigma * sigma / weight;
            let EstimatorSettings { foot_position_noise_m, foot_velocity_noise_m_s, .. } = self.settings;
            self.motion.see_position(&(position / weight), variance(foot_position_noise_m), rotation);
            self.motion.see_velocity(&(velocity / weight), variance(foot_velocity_noise_m_s), rotation);
        }
    }

    /// Feet that creep apart, or that the IMU sees at another height, are slowly moved to where they are seen.
    fn follow_creep(&mut self, sightings: &Sightings, dt_s: f64) {
        let share = dt_s / self.settings.creep_s;
        for_each_apart(sightings, |leg, apart| self.feet[leg.index()].shift(&(-share * apart)));
    }

    fn anchor(&mut self, leg: Leg, kinematics: &FootKinematics) {
        let seen = self.world_from_torso() * kinematics.torso_from_foot;
        self.feet[leg.index()].anchor(&seen.translation.vector, seen.rotation, &self.settings);
    }

    /// The state of the robot, with joints as measured.
    pub fn state(&self, sensors: &Sensors) -> State {
        let world_from_torso = self.world_from_torso();
        let linear = world_from_torso.inverse_transform_vector(&self.motion.velocity);
        let mut torso_twist = Vector6::zeros();
        torso_twist.fixed_rows_mut::<3>(0).copy_from(&linear);
        torso_twist.fixed_rows_mut::<3>(3).copy_from(&self.angular_velocity);
        State { world_from_torso, torso_twist, position: sensors.position, velocity: sensors.velocity }
    }

    /// Pose of the torso in the world.
    pub fn world_from_torso(&self) -> Isometry3<f64> {
        Isometry3::from_parts(self.motion.position.into(), self.attitude.world_from_torso)
    }

    /// How often the world was set anew.
    pub fn resets(&self) -> u64 {
        self.resets
    }

    /// How often a foot was found to slip.
    pub fn slips(&self) -> u64 {
        self.slips
    }
}

/// Share of the way that a first-order low-pass filter goes in one step.
fn low_pass(cutoff_hz: f64, dt_s: f64) -> f64 {
    1.0 - (-std::f64::consts::TAU * cutoff_hz * dt_s).exp()
}
