//! Where the torso is and how fast it moves: a Kalman filter of the accelerometer, and of what the standing feet
//! say of position and velocity.
//!
//! Each axis of the world has the state (p, v, b), b the accelerometer's bias:
//! ```text
//! p ← p + v dt + ½ a dt²,  v ← v + a dt,  a = R (f - b) + g       f: the accelerometer
//! ```
//! Nothing in it knows one axis from another, so the three have one covariance. The bias belongs to the sensor
//! and is kept in the torso's frame; it turns with the torso, the covariance does not, which is exact for equal
//! axes.

use nalgebra::{Matrix3, RowVector3, UnitQuaternion, Vector3};

use super::EstimatorSettings;
use crate::model::GRAVITY;

/// How fast the accelerometer's bias may wander, m/s² in a root of a second: it is one of temperature.
const BIAS_WALK: f64 = 0.002;
/// Standard deviation of the velocity at a reset, m/s: the torso rests.
const FIRST_VELOCITY_M_S: f64 = 0.05;

/// Position and velocity of the torso's origin in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MotionFilter {
    pub(super) position: Vector3<f64>,
    pub(super) velocity: Vector3<f64>,
    /// Of the accelerometer, in the torso's frame, m/s².
    accelerometer_bias: Vector3<f64>,
    /// Of (p, v, b) of each axis.
    covariance: Matrix3<f64>,
    acceleration_variance: f64,
}

impl MotionFilter {
    pub(super) fn new(settings: &EstimatorSettings) -> Self {
        let mut covariance = Matrix3::zeros();
        covariance[(2, 2)] = settings.accelerometer_bias_m_s2.powi(2);
        Self {
            position: Vector3::zeros(),
            velocity: Vector3::zeros(),
            accelerometer_bias: Vector3::zeros(),
            covariance,
            acceleration_variance: settings.accelerometer_noise_m_s2.powi(2),
        }
    }

    /// At rest in the origin. What was learnt of the accelerometer stays.
    pub(super) fn reset(&mut self) {
        self.position = Vector3::zeros();
        self.velocity = Vector3::zeros();
        let bias = self.covariance[(2, 2)];
        self.covariance = Matrix3::from_diagonal(&Vector3::new(0.0, FIRST_VELOCITY_M_S.powi(2), bias));
    }

    /// Moves on with the accelerometer.
    pub(super) fn predict(
        &mut self,
        world_from_torso: &UnitQuaternion<f64>,
        accelerometer: &[f64; 3],
        dt_s: f64,
    ) {
        let specific_force = Vector3::from(*accelerometer) - self.accelerometer_bias;
        let acceleration = world_from_torso * specific_force - GRAVITY * Vector3::z();
        let half = 0.5 * dt_s * dt_s;
        self.position += self.velocity * dt_s + acceleration * half;
        self.velocity += acceleration * dt_s;
        let step = Matrix3::new(1.0, dt_s, -half, 0.0, 1.0, -dt_s, 0.0, 0.0, 1.0);
        let by_noise = Vector3::new(half, dt_s, 0.0);
        self.covariance = step * self.covariance * step.transpose()
            + self.acceleration_variance * by_noise * by_noise.transpose();
        self.covariance[(2, 2)] += BIAS_WALK * BIAS_WALK * dt_s;
    }

    /// Takes in a measured position.
    pub(super) fn see_position(
        &mut self,
        position: &Vector3<f64>,
        variance: f64,
        rotation: &UnitQuaternion<f64>,
    ) {
        let innovation = position - self.position;
        self.correct(0, &innovation, variance, rotation);
    }

    /// Takes in a measured velocity.
    pub(super) fn see_velocity(
        &mut self,
        velocity: &Vector3<f64>,
        variance: f64,
        rotation: &UnitQuaternion<f64>,
    ) {
        let innovation = velocity - self.velocity;
        self.correct(1, &innovation, variance, rotation);
    }

    /// The Kalman update by a measurement of the state's component `which`.
    fn correct(
        &mut self,
        which: usize,
        innovation: &Vector3<f64>,
        variance: f64,
        world_from_torso: &UnitQuaternion<f64>,
    ) {
        let column: Vector3<f64> = self.covariance.column(which).into_owned();
        let row: RowVector3<f64> = column.transpose();
        let gain = column / (column[which] + variance);
        self.position += gain[0] * innovation;
        self.velocity += gain[1] * innovation;
        self.accelerometer_bias += gain[2] * world_from_torso.inverse_transform_vector(innovation);
        self.covariance -= gain * row;
        self.covariance = 0.5 * (self.covariance + self.covariance.transpose());
    }
}
