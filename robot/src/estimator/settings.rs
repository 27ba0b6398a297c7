//! Numbers of the estimator.

use serde::Deserialize;

/// `configs/robot/control.toml` says what they mean and where they come from.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EstimatorSettings {
    /// A foot sinks in by so much for each newton, m/N.
    pub foot_sink_m_n: f64,
    /// Force from which a foot is trusted fully, N.
    pub full_trust_n: f64,
    /// Time constant with which the tilt follows the IMU's attitude, s.
    pub imu_tilt_s: f64,
    /// Time constant with which the attitude follows the feet, s.
    pub feet_attitude_s: f64,
    /// Time constant of the gyroscope's bias, s.
    pub gyro_bias_s: f64,
    /// Time constant with which feet that disagree are moved to where they are seen, s.
    pub creep_s: f64,
    /// Cut-off of the gyroscope's low-pass filter, Hz.
    pub gyro_cutoff_hz: f64,
    /// Cut-off of the low-pass filter of the feet's forces, Hz.
    pub force_cutoff_hz: f64,
    /// Standard deviation of a foot's place, m.
    pub foot_position_noise_m: f64,
    /// Standard deviation of a foot's velocity, m/s.
    pub foot_velocity_noise_m_s: f64,
    /// Standard deviation of the accelerometer, m/s².
    pub accelerometer_noise_m_s2: f64,
    /// Standard deviation of the accelerometer's bias before anything is known of it, m/s².
    pub accelerometer_bias_m_s2: f64,
    /// A foot slips when it moves faster than this, m/s.
    pub slip_m_s: f64,
    /// A foot that was quiet for so long stands again, s.
    pub quiet_s: f64,
}

impl Default for EstimatorSettings {
    fn default() -> Self {
        Self {
            foot_sink_m_n: 1.75e-5,
            full_trust_n: 15.0,
            imu_tilt_s: 0.1,
            feet_attitude_s: 0.1,
            gyro_bias_s: 5.0,
            creep_s: 5.0,
            gyro_cutoff_hz: 80.0,
            force_cutoff_hz: 10.0,
            foot_position_noise_m: 0.0001,
            foot_velocity_noise_m_s: 0.02,
            accelerometer_noise_m_s2: 0.1,
            accelerometer_bias_m_s2: 0.1,
            slip_m_s: 0.015,
            quiet_s: 0.1,
        }
    }
}
