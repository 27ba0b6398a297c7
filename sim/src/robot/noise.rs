//! What the sensors add to the truth. Deterministic from the seed.

use locoman_robot::joints::JointVector;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::scene::Profile;

/// Noise generator and the constants drawn once: biases, scale errors, drift.
#[derive(Debug, Clone)]
pub struct SensorNoise {
    random: ChaCha8Rng,
    profile: Profile,
    gyro_bias: Vector3<f64>,
    accelerometer_bias: Vector3<f64>,
    tilt_bias: Vector3<f64>,
    yaw_rate: f64,
    foot_scale: [f64; 4],
}

impl SensorNoise {
    /// Draws the constants.
    pub fn new(profile: &Profile, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let gyro_bias = profile.gyro_bias_rad_s * normal3(&mut random);
        let accelerometer_bias = profile.accelerometer_bias_m_s2 * normal3(&mut random);
        let tilt_bias =
            profile.tilt_bias_rad * normal3(&mut random).component_mul(&Vector3::new(1.0, 1.0, 0.0));
        let yaw_rate = profile.yaw_drift_rad_s * normal(&mut random);
        let foot_scale = std::array::from_fn(|_| 1.0 + profile.foot_force_scale_error * normal(&mut random));
        Self {
            random,
            profile: profile.clone(),
            gyro_bias,
            accelerometer_bias,
            tilt_bias,
            yaw_rate,
            foot_scale,
        }
    }

    /// Joint angles as the encoders give them.
    pub fn position(&mut self, truth: &JointVector) -> JointVector {
        let (leg, arm) = (self.profile.leg_position_noise_rad, self.profile.arm_position_noise_rad);
        self.noisy(truth, |joint| if joint < 12 { leg } else { arm })
    }

    /// Joint speeds.
    pub fn velocity(&mut self, truth: &JointVector) -> JointVector {
        let sigma = self.profile.velocity_noise_rad_s;
        self.noisy(truth, |_| sigma)
    }

    /// Joint torques of the legs as the drives estimate them; the servos' are a tenth as noisy.
    pub fn torque(&mut self, truth: &JointVector) -> JointVector {
        let sigma = self.profile.torque_noise_nm;
        self.noisy(truth, |joint| if joint < 12 { sigma } else { 0.1 * sigma })
    }

    /// Gyroscope.
    pub fn gyro(&mut self, truth: Vector3<f64>) -> Vector3<f64> {
        truth + self.gyro_bias + self.profile.gyro_noise_rad_s * normal3(&mut self.random)
    }

    /// Accelerometer.
    pub fn accelerometer(&mut self, truth: Vector3<f64>) -> Vector3<f64> {
        truth + self.accelerometer_bias + self.profile.accelerometer_noise_m_s2 * normal3(&mut self.random)
    }

    /// Attitude at a time: tilted by the bias, turned by the yaw's drift, shaken by noise.
    pub fn attitude(&mut self, truth: UnitQuaternion<f64>, time_s: f64) -> UnitQuaternion<f64> {
        let shake = self.tilt_bias + self.profile.attitude_noise_rad * normal3(&mut self.random);
        let drift = Vector3::z() * (self.yaw_rate * time_s);
        UnitQuaternion::from_scaled_axis(drift) * truth * UnitQuaternion::from_scaled_axis(shake)
    }

    /// Foot forces, N.
    pub fn foot_force(&mut self, truth: [f64; 4]) -> [f64; 4] {
        let sigma = self.profile.foot_force_noise_n;
        std::array::from_fn(|foot| self.foot_scale[foot] * truth[foot] + sigma * normal(&mut self.random))
    }

    fn noisy(&mut self, truth: &JointVector, sigma: impl Fn(usize) -> f64) -> JointVector {
        JointVector::from_fn(|joint, _| truth[joint] + sigma(joint) * normal(&mut self.random))
    }
}

fn normal3(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| normal(random))
}

/// Standard normal by Box and Muller (1958).
fn normal(random: &mut ChaCha8Rng) -> f64 {
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
