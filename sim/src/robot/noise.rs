//! What the sensors add to the truth. Deterministic from the seed.

use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::go1_wire::{self, float32};
use super::profile::SensorErrors;
use super::servo::rounded;

/// Noise generator and the constants drawn once: biases, scale errors, drift.
#[derive(Debug, Clone)]
pub struct SensorNoise {
    random: ChaCha8Rng,
    errors: SensorErrors,
    gyro_bias: Vector3<f64>,
    accelerometer_bias: Vector3<f64>,
    tilt_bias: Vector3<f64>,
    yaw_rate: f64,
    foot_scale: [f64; 4],
}

impl SensorNoise {
    /// Draws the constants.
    pub fn new(errors: &SensorErrors, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let gyro_bias = errors.gyro_bias_rad_s * normal3(&mut random);
        let accelerometer_bias = errors.accelerometer_bias_m_s2 * normal3(&mut random);
        let tilt_bias =
            errors.tilt_bias_rad * normal3(&mut random).component_mul(&Vector3::new(1.0, 1.0, 0.0));
        let yaw_rate = errors.yaw_drift_rad_s * normal(&mut random);
        let foot_scale = std::array::from_fn(|_| 1.0 + errors.foot_force_scale_error * normal(&mut random));
        Self { random, errors: *errors, gyro_bias, accelerometer_bias, tilt_bias, yaw_rate, foot_scale }
    }

    /// Leg joint angles as the encoders give them.
    pub fn leg_position(&mut self, truth: f64) -> f64 {
        let noisy = truth + self.errors.leg_position_noise_rad * normal(&mut self.random);
        self.wire(rounded(noisy, self.errors.leg_position_step_rad))
    }

    /// Leg joint speeds.
    pub fn leg_velocity(&mut self, truth: f64) -> f64 {
        let noisy = truth + self.errors.leg_velocity_noise_rad_s * normal(&mut self.random);
        self.wire(noisy)
    }

    /// Joint torques of the legs as the drives estimate them.
    pub fn leg_torque(&mut self, truth: f64) -> f64 {
        let noisy = truth + self.errors.torque_noise_nm * normal(&mut self.random);
        if self.errors.go1_wire { go1_wire::torque(noisy) } else { noisy }
    }

    /// Torques of the servos, by their currents: a tenth as noisy as the legs'.
    pub fn arm_torque(&mut self, truth: f64) -> f64 {
        truth + 0.1 * self.errors.torque_noise_nm * normal(&mut self.random)
    }

    /// Gyroscope.
    pub fn gyro(&mut self, truth: Vector3<f64>) -> Vector3<f64> {
        let noise = self.errors.gyro_noise_rad_s * normal3(&mut self.random);
        (truth + self.gyro_bias + noise).map(|value| self.wire(value))
    }

    /// Accelerometer.
    pub fn accelerometer(&mut self, truth: Vector3<f64>) -> Vector3<f64> {
        let noise = self.errors.accelerometer_noise_m_s2 * normal3(&mut self.random);
        (truth + self.accelerometer_bias + noise).map(|value| self.wire(value))
    }

    /// Attitude at a time, w, x, y, z: tilted by the bias, turned by the yaw's drift, shaken by noise.
    pub fn attitude(&mut self, truth: UnitQuaternion<f64>, time_s: f64) -> [f64; 4] {
        let shake = self.tilt_bias + self.errors.attitude_noise_rad * normal3(&mut self.random);
        let drift = Vector3::z() * (self.yaw_rate * time_s);
        let attitude =
            UnitQuaternion::from_scaled_axis(drift) * truth * UnitQuaternion::from_scaled_axis(shake);
        [attitude.w, attitude.i, attitude.j, attitude.k].map(|value| self.wire(value))
    }

    /// Foot forces, N.
    pub fn foot_force(&mut self, truth: [f64; 4]) -> [f64; 4] {
        let sigma = self.errors.foot_force_noise_n;
        std::array::from_fn(|foot| self.foot_scale[foot] * truth[foot] + sigma * normal(&mut self.random))
    }

    fn wire(&self, value: f64) -> f64 {
        if self.errors.go1_wire { float32(value) } else { value }
    }
}

fn normal3(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| normal(random))
}

/// Standard normal by Box and Muller (1958).
pub(super) fn normal(random: &mut ChaCha8Rng) -> f64 {
    let u: f64 = random.random();
    let v: f64 = random.random();
    // `1 - u` is in (0, 1], so the logarithm is finite.
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_distribution_is_standard() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let draws: Vec<f64> = (0..20_000).map(|_| normal(&mut random)).collect();
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let variance = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / draws.len() as f64;
        // Five standard errors of 20 000 draws.
        assert!(mean.abs() < 0.036 && (variance - 1.0).abs() < 0.05, "{mean} {variance}");
    }
}
