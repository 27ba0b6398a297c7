//! When the supervisor acts: `configs/robot/supervisor.toml`, which says where each number comes from.

use serde::Deserialize;

/// Everything in `supervisor.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thresholds {
    /// Without a command for this long: hold.
    pub command_hold_ms: f64,
    /// Without a command for this long: disengage.
    pub command_disengage_ms: f64,
    /// Without a command for this long while a foot is in the air: back to four feet.
    pub command_stand_ms: f64,
    /// Without a sample for this long: tell.
    pub sensors_late_ms: f64,
    /// Without a sample for this long: lost; start anew when they return.
    pub sensors_lost_ms: f64,
    /// Leaning so far: back to four feet, no other mode.
    pub tilt_hold_rad: f64,
    /// Leaning so far: damp.
    pub tilt_damp_rad: f64,
    /// A standing foot without load for this long: tell.
    pub foot_unloaded_ms: f64,
    /// Less than this is no load, N.
    pub foot_unloaded_n: f64,
    /// A source that has been silent for so long may be followed by another.
    pub source_stale_ms: f64,
    /// A leg's motor as hot as this, °C: tell.
    pub motor_warm_c: f64,
    /// ... : lie down.
    pub motor_hot_c: f64,
    /// ... : damp.
    pub motor_damp_c: f64,
    /// Charge at or below this: tell.
    pub battery_low_percent: f64,
    /// ... : lie down.
    pub battery_empty_percent: f64,
    /// The weakest cell at or below this, V: tell.
    pub cell_low_v: f64,
    /// ... : lie down.
    pub cell_empty_v: f64,
    /// The battery as hot as this, °C: lie down.
    pub battery_hot_c: f64,
    /// The legs' motors at this power for six samples, W: damp.
    pub leg_power_w: f64,
    /// A servo as hot as this, °C: tell.
    pub servo_warm_c: f64,
    /// ... : back to four feet.
    pub servo_hot_c: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            command_hold_ms: 100.0,
            command_disengage_ms: 500.0,
            command_stand_ms: 5_000.0,
            sensors_late_ms: 50.0,
            sensors_lost_ms: 500.0,
            tilt_hold_rad: 0.5,
            tilt_damp_rad: 0.9,
            foot_unloaded_ms: 200.0,
            foot_unloaded_n: 3.0,
            source_stale_ms: 1_000.0,
            motor_warm_c: 60.0,
            motor_hot_c: 70.0,
            motor_damp_c: 80.0,
            battery_low_percent: 20.0,
            battery_empty_percent: 10.0,
            cell_low_v: 3.3,
            cell_empty_v: 3.1,
            battery_hot_c: 60.0,
            leg_power_w: 1_000.0,
            servo_warm_c: 60.0,
            servo_hot_c: 68.0,
        }
    }
}
