//! `configs/robot/go1.toml`: the line to the Go1's motor board, and what may go out on it.
//!
//! The file says what each number means and where it comes from; its numbers are the compiled defaults.

use std::{net::SocketAddr, path::Path};

use serde::Deserialize;

use super::{Checksum, Feet, Limits, WatchdogSettings};
use crate::control::{ConfigError, read_toml};

/// Everything in `go1.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Go1Settings {
    /// Where the motor board listens.
    pub board: SocketAddr,
    /// From where we speak; port 0 takes any free one.
    pub local: SocketAddr,
    /// How a command's checksum is written.
    pub checksum: Checksum,
    /// The controller's time to answer a state, before the next command goes out, µs.
    pub answer_us: u64,
    /// What is sent when the controller does not answer.
    pub watchdog: WatchdogSettings,
    /// What a command may ask for.
    pub limits: Limits,
    /// From pressure to force.
    pub feet: Feet,
}

impl Default for Go1Settings {
    fn default() -> Self {
        Self {
            board: SocketAddr::from(([192, 168, 123, 10], 8007)),
            local: SocketAddr::from(([0, 0, 0, 0], 8091)),
            checksum: Checksum::Plain,
            answer_us: 700,
            watchdog: WatchdogSettings::default(),
            limits: Limits::default(),
            feet: Feet::default(),
        }
    }
}

impl Go1Settings {
    /// Reads the file within a configuration folder (`configs`), and refuses what is out of range.
    pub fn load(configs: &Path) -> Result<Self, ConfigError> {
        let file = configs.join("robot/go1.toml");
        let settings: Self = read_toml(&file)?;
        match settings.flaw() {
            Some((key, expected)) => Err(ConfigError::Value { file, key, expected }),
            None => Ok(settings),
        }
    }

    /// The first key that is out of range, and what it must be.
    pub fn flaw(&self) -> Option<(&'static str, &'static str)> {
        let Self { answer_us, watchdog, limits, feet, .. } = self;
        let within = |value: f64, low: f64, high: f64| (low..=high).contains(&value);
        let positive = |values: &[f64]| values.iter().all(|value| value.is_finite() && *value > 0.0);
        let ordered = (0..3).all(|joint| limits.lower_rad[joint] < limits.upper_rad[joint]);
        [
            ((200..=1800).contains(answer_us), "answer_us", "within 200 to 1800"),
            (within(watchdog.hold_ms, 4.0, 30.0), "watchdog.hold_ms", "within 4 to 30"),
            (within(watchdog.damp_ms, 10.0, 48.0), "watchdog.damp_ms", "within 10 to 48"),
            (watchdog.hold_ms < watchdog.damp_ms, "watchdog.hold_ms", "below watchdog.damp_ms"),
            (within(watchdog.linger_ms, 500.0, 60_000.0), "watchdog.linger_ms", "within 500 to 60000"),
            (within(watchdog.damping_kd, 1.0, 8.0), "watchdog.damping_kd", "within 1 to 8"),
            (ordered, "limits.lower_rad", "below limits.upper_rad, joint by joint"),
            (positive(&limits.speed_rad_s), "limits.speed_rad_s", "above 0"),
            (positive(&limits.torque_nm), "limits.torque_nm", "above 0"),
            (within(limits.kp, 0.0, 1023.0), "limits.kp", "within 0 to 1023, all that the line carries"),
            (within(limits.kd, 0.0, 2047.0), "limits.kd", "within 0 to 2047, all that the line carries"),
            (positive(&feet.newton_per_count), "feet.newton_per_count", "above 0"),
        ]
        .into_iter()
        .find_map(|(holds, key, expected)| (!holds).then_some((key, expected)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn configs() -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs")
    }

    #[test]
    fn the_documented_defaults_are_the_compiled_ones() {
        assert_eq!(Go1Settings::load(&configs()).unwrap(), Go1Settings::default());
    }

    #[test]
    fn numbers_that_would_be_dangerous_are_refused_by_name() {
        let mut sut = Go1Settings::default();
        assert_eq!(sut.flaw(), None);
        sut.watchdog.damp_ms = 60.0;
        assert_eq!(sut.flaw().unwrap().0, "watchdog.damp_ms");
        sut = Go1Settings::default();
        sut.limits.torque_nm[2] = f64::NAN;
        assert_eq!(sut.flaw().unwrap().0, "limits.torque_nm");
    }
}
