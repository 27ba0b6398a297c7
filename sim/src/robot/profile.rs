//! The imperfections of the simulated robot, each a key of a profile in `configs/scenes/robot.toml`.
//!
//! Zero (or `false`) switches an imperfection off; the profile `ideal` has all of them off. Each key is
//! explained in the scene file, with its unit and source.
#![expect(missing_docs, reason = "each key is documented in the scene file and named by quantity and unit")]

use serde::Deserialize;

use super::MAX_LATENCY_S;

/// All imperfections.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    pub commands: CommandPath,
    pub joints: JointFriction,
    pub servos: ServoErrors,
    pub feet: FootCompliance,
    pub body: BodyErrors,
    pub sensors: SensorErrors,
}

/// What becomes of a command on its way to the drives.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandPath {
    pub latency_s: f64,
    pub go1_wire: bool,
}

/// Friction in the joints.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointFriction {
    pub leg_coulomb_nm: f64,
    pub leg_viscous_nm_s: f64,
    pub arm_coulomb_nm: f64,
    pub arm_bearing_nm: f64,
}

/// What the arms' servos and their bus do to a goal and to a reading.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoErrors {
    pub counts_per_turn: f64,
    pub encoder_noise_rad: f64,
    pub velocity_noise_rad_s: f64,
    pub velocity_step_rad_s: f64,
    pub loop_period_s: f64,
    pub bus_period_s: f64,
    pub backlash_rad: f64,
}

/// The rubber of the feet.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FootCompliance {
    pub stiffness_n_m: f64,
    pub damping_n_s_m: f64,
}

/// Bounds of what the controller's model has wrong; drawn from the seed.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyErrors {
    pub mass_share: f64,
    pub com_m: f64,
}

/// What the sensors add: standard deviations unless the name says otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorErrors {
    pub go1_wire: bool,
    pub leg_position_noise_rad: f64,
    pub leg_position_step_rad: f64,
    pub leg_velocity_noise_rad_s: f64,
    pub torque_noise_nm: f64,
    pub gyro_noise_rad_s: f64,
    pub gyro_bias_rad_s: f64,
    pub accelerometer_noise_m_s2: f64,
    pub accelerometer_bias_m_s2: f64,
    pub tilt_bias_rad: f64,
    pub attitude_noise_rad: f64,
    pub yaw_drift_rad_s: f64,
    pub foot_force_noise_n: f64,
    pub foot_force_scale_error: f64,
}

impl Profile {
    /// What is out of range, with the key as it stands in the file.
    pub(super) fn problem(&self, timestep_s: f64) -> Option<String> {
        let Self { commands, joints, servos, feet, body, .. } = self;
        let ranges = [
            ("commands.latency_s", commands.latency_s, MAX_LATENCY_S),
            ("joints.leg_coulomb_nm", joints.leg_coulomb_nm, 5.0),
            ("joints.leg_viscous_nm_s", joints.leg_viscous_nm_s, 5.0),
            ("joints.arm_coulomb_nm", joints.arm_coulomb_nm, 0.5),
            ("joints.arm_bearing_nm", joints.arm_bearing_nm, 0.1),
            ("servos.counts_per_turn", servos.counts_per_turn, 1e6),
            ("servos.encoder_noise_rad", servos.encoder_noise_rad, 0.1),
            ("servos.velocity_noise_rad_s", servos.velocity_noise_rad_s, 1.0),
            ("servos.velocity_step_rad_s", servos.velocity_step_rad_s, 1.0),
            ("servos.loop_period_s", servos.loop_period_s, 0.005),
            ("servos.bus_period_s", servos.bus_period_s, 0.05),
            ("servos.backlash_rad", servos.backlash_rad, 0.1),
            ("feet.stiffness_n_m", feet.stiffness_n_m, 1e6),
            ("feet.damping_n_s_m", feet.damping_n_s_m, 1e4),
            ("body.mass_share", body.mass_share, 0.5),
            ("body.com_m", body.com_m, 0.05),
        ];
        let outside = ranges.into_iter().find(|(_, value, most)| !(0.0..=*most).contains(value));
        if let Some((key, value, most)) = outside {
            return Some(format!("{key} = {value} is not within 0 to {most}"));
        }
        let periods =
            [("servos.loop_period_s", servos.loop_period_s), ("servos.bus_period_s", servos.bus_period_s)];
        let uneven = periods.into_iter().find(|(_, period)| {
            let steps = period / timestep_s;
            (steps - steps.round()).abs() > 1e-9
        });
        uneven.map(|(key, period)| format!("{key} = {period} is no multiple of physics.timestep_s"))
    }
}
