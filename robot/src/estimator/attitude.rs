//! Which way is up, and how the torso has turned since the last reset: a complementary filter on SO(3).
//!
//! ```text
//! R ← R exp((ω - b) dt)          the gyroscope, without its bias
//! R ← exp(k e) R, b ← b - k_b Rᵀ k e    corrected by an error e in the world's axes
//! ```
//! (Mahony, Hamel, Pflimlin 2008, with the correction in the world's axes.) The IMU's own attitude corrects the
//! tilt alone, because its heading drifts; the standing feet correct all three axes.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Attitude of the torso in the world, and the gyroscope's bias.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AttitudeFilter {
    pub(super) world_from_torso: UnitQuaternion<f64>,
    /// In the torso's frame, rad/s.
    pub(super) gyro_bias: Vector3<f64>,
}

impl AttitudeFilter {
    pub(super) fn new() -> Self {
        Self { world_from_torso: UnitQuaternion::identity(), gyro_bias: Vector3::zeros() }
    }

    /// Angular velocity of the torso in its own frame.
    pub(super) fn turn_rate(&self, gyro: &[f64; 3]) -> Vector3<f64> {
        Vector3::from(*gyro) - self.gyro_bias
    }

    /// Turns on with the gyroscope.
    pub(super) fn predict(&mut self, gyro: &[f64; 3], dt_s: f64) {
        self.world_from_torso *= UnitQuaternion::from_scaled_axis(self.turn_rate(gyro) * dt_s);
    }

    /// Turns by a rotation vector in the world, and takes `bias_share` (1/s) of it for the gyroscope's bias.
    pub(super) fn correct(&mut self, turn: &Vector3<f64>, bias_share: f64) {
        self.gyro_bias -= bias_share * self.world_from_torso.inverse_transform_vector(turn);
        self.world_from_torso = UnitQuaternion::from_scaled_axis(*turn) * self.world_from_torso;
    }

    /// The rotation about a level axis that takes this filter's vertical to the one of the IMU's attitude.
    pub(super) fn tilt_error(&self, attitude: &[f64; 4]) -> Vector3<f64> {
        let up_by_imu = tilt(attitude).inverse_transform_vector(&Vector3::z());
        let error = (self.world_from_torso * up_by_imu).cross(&Vector3::z());
        // The sine of the angle, which is the angle for the milliradians that this ever is.
        Vector3::new(error.x, error.y, 0.0)
    }
}

/// Roll and pitch of an attitude, without its heading: takes the torso's axes to axes with z up.
pub fn tilt(attitude: &[f64; 4]) -> UnitQuaternion<f64> {
    let [w, x, y, z] = *attitude;
    let attitude = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6).unwrap_or_default();
    heading(&attitude).inverse() * attitude
}

/// The rotation about z by which an attitude's x axis points aside.
pub fn heading(attitude: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let forward = attitude * Vector3::x();
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), forward.y.atan2(forward.x))
}

/// Angle between the torso's z axis and up, rad.
pub fn tilt_angle(attitude: &[f64; 4]) -> f64 {
    (tilt(attitude) * Vector3::z()).z.clamp(-1.0, 1.0).acos()
}
