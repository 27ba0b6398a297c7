//! `configs/teleop.toml`: how motion of the operator becomes motion of the robot.
//!
//! Every key has a compiled default, which the file shipped with the program repeats; values are checked
//! once, here, and are trusted afterwards.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use serde::Deserialize;

/// Why a configuration was refused.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{path}: {source}; give the folder with `--configs`")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not valid TOML, an unknown key or a wrong type; the message shows the line.
    #[error("{path}: {source}")]
    Parse {
        /// The file.
        path: PathBuf,
        /// What and where.
        source: Box<toml::de::Error>,
    },
    /// A value out of range.
    #[error("{path}: {key} = {value} must lie in {low} to {high}")]
    Range {
        /// The file.
        path: PathBuf,
        /// Section and key.
        key: &'static str,
        /// What was given.
        value: f64,
        /// Smallest value allowed.
        low: f64,
        /// Largest value allowed.
        high: f64,
    },
    /// The two opening angles coincide, so that no angle means anything.
    #[error(
        "{path}: opening.closed_rad and opening.open_rad are both {value}; they must differ by 0.05 or more"
    )]
    Opening {
        /// The file.
        path: PathBuf,
        /// The value of both.
        value: f64,
    },
}

/// The whole file.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Robot motion for each unit of operator motion.
    pub scale: Scale,
    /// From thumb angle to gripper opening.
    pub opening: Opening,
    /// When a tracked body counts.
    pub tracking: Tracking,
    /// Rates and time limits of the command stream.
    pub command: Command,
    /// Speeds and limits of joystick and keyboard.
    pub stick: Stick,
    /// Rates of the browser console.
    pub console: Console,
}

/// Robot motion for each unit of operator motion.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scale {
    /// Torso, metres a metre.
    pub torso_translation: f64,
    /// Torso, radians a radian.
    pub torso_rotation: f64,
    /// Palms, metres a metre.
    pub hand_translation: f64,
    /// Palms, radians a radian.
    pub hand_rotation: f64,
}

impl Default for Scale {
    fn default() -> Self {
        Self { torso_translation: 0.5, torso_rotation: 1.0, hand_translation: 1.0, hand_rotation: 1.0 }
    }
}

/// From the angle between thumb and palm to the opening of the gripper.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Opening {
    /// Angle at which the gripper is closed.
    pub closed_rad: f64,
    /// Angle at which it is open.
    pub open_rad: f64,
    /// Fastest change of the opening, 1/s.
    pub max_rate_per_s: f64,
}

impl Default for Opening {
    fn default() -> Self {
        Self { closed_rad: 0.1, open_rad: 0.8, max_rate_per_s: 3.0 }
    }
}

/// When a tracked body counts.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tracking {
    /// Longest time for which a prediction stands in for a measurement.
    pub predicted_max_ms: u64,
    /// Farthest that a pose is predicted beyond its capture, to the time of sending.
    pub ahead_max_ms: u64,
    /// How long the first reading of an instant waits for cameras that are exposed together with it.
    pub straggler_ms: u64,
    /// Oldest result that moves anything.
    pub stale_ms: u64,
    /// A larger step between two sightings, beyond what the speeds below allow, starts a new engagement.
    pub jump_m: f64,
    /// The same for rotation.
    pub jump_rad: f64,
    /// Fastest translation of an operator.
    pub speed_m_s: f64,
    /// Fastest rotation of an operator.
    pub speed_rad_s: f64,
    /// Longest time between two sightings for which speed excuses a step.
    pub jump_gap_ms: u64,
}

impl Default for Tracking {
    fn default() -> Self {
        Self {
            predicted_max_ms: 100,
            ahead_max_ms: 80,
            straggler_ms: 5,
            stale_ms: 400,
            jump_m: 0.06,
            jump_rad: 0.15,
            speed_m_s: 0.5,
            speed_rad_s: 2.0,
            jump_gap_ms: 250,
        }
    }
}

/// Rates and time limits of the command stream.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Command {
    /// Commands each second.
    pub rate_hz: f64,
    /// Robot state silent for longer ends the engagement.
    pub robot_silent_ms: u64,
    /// A browser silent for longer has released its dead-man.
    pub browser_silent_ms: u64,
}

impl Default for Command {
    fn default() -> Self {
        Self { rate_hz: 60.0, robot_silent_ms: 500, browser_silent_ms: 150 }
    }
}

/// Speeds at full deflection, and limits of the displacement within one engagement.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the shipped file documents each key; the names carry the units")]
pub struct Stick {
    pub deadband: f64,
    pub torso_xy_m_s: f64,
    pub torso_z_m_s: f64,
    pub torso_rad_s: f64,
    pub walk_m_s: f64,
    pub walk_rad_s: f64,
    pub gripper_m_s: f64,
    pub gripper_rad_s: f64,
    pub opening_per_s: f64,
    pub torso_xy_limit_m: f64,
    pub torso_z_limit_m: f64,
    pub torso_tilt_limit_rad: f64,
    pub torso_yaw_limit_rad: f64,
    pub gripper_limit_m: f64,
    pub gripper_limit_rad: f64,
}

impl Default for Stick {
    fn default() -> Self {
        Self {
            deadband: 0.1,
            torso_xy_m_s: 0.015,
            torso_z_m_s: 0.060,
            torso_rad_s: 0.3,
            walk_m_s: 0.4,
            walk_rad_s: 0.8,
            gripper_m_s: 0.03,
            gripper_rad_s: 0.15,
            opening_per_s: 0.9,
            torso_xy_limit_m: 0.06,
            torso_z_limit_m: 0.2,
            torso_tilt_limit_rad: 0.3,
            torso_yaw_limit_rad: 0.4,
            gripper_limit_m: 0.5,
            gripper_limit_rad: 1.5,
        }
    }
}

/// Rates of the browser console.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Console {
    /// Camera previews each second, for each camera.
    pub preview_hz: f64,
    /// Status messages each second.
    pub status_hz: f64,
}

impl Default for Console {
    fn default() -> Self {
        Self { preview_hz: 8.0, status_hz: 20.0 }
    }
}

impl Config {
    /// Reads and checks `teleop.toml` in the configuration folder.
    pub fn read(configs: &Path) -> Result<Self, ConfigError> {
        let path = configs.join("teleop.toml");
        let text = std::fs::read_to_string(&path)
            .map_err(|source| ConfigError::Read { path: path.clone(), source })?;
        Self::parse(&text, &path)
    }

    /// Parses and checks the text of the file; `path` is for messages.
    pub fn parse(text: &str, path: &Path) -> Result<Self, ConfigError> {
        let config: Self = toml::from_str(text)
            .map_err(|source| ConfigError::Parse { path: path.to_owned(), source: Box::new(source) })?;
        config.check(path)?;
        Ok(config)
    }

    fn check(&self, path: &Path) -> Result<(), ConfigError> {
        /// Scales and speeds must be positive: zero would silently freeze an axis.
        const TINY: f64 = 1e-3;
        let (s, o, t, c, k, p) =
            (&self.scale, &self.opening, &self.tracking, &self.command, &self.stick, &self.console);
        let ranges: [(&'static str, f64, RangeInclusive<f64>); 27] = [
            ("scale.torso_translation", s.torso_translation, TINY..=2.0),
            ("scale.torso_rotation", s.torso_rotation, TINY..=2.0),
            ("scale.hand_translation", s.hand_translation, TINY..=2.0),
            ("scale.hand_rotation", s.hand_rotation, TINY..=2.0),
            ("opening.closed_rad", o.closed_rad, 0.0..=std::f64::consts::PI),
            ("opening.open_rad", o.open_rad, 0.0..=std::f64::consts::PI),
            ("opening.max_rate_per_s", o.max_rate_per_s, 0.1..=20.0),
            ("tracking.predicted_max_ms", t.predicted_max_ms as f64, 0.0..=500.0),
            ("tracking.stale_ms", t.stale_ms as f64, 50.0..=1000.0),
            ("tracking.jump_m", t.jump_m, 0.02..=1.0),
            ("tracking.jump_rad", t.jump_rad, 0.02..=1.0),
            ("command.rate_hz", c.rate_hz, 20.0..=200.0),
            ("command.robot_silent_ms", c.robot_silent_ms as f64, 100.0..=2000.0),
            ("command.browser_silent_ms", c.browser_silent_ms as f64, 100.0..=1000.0),
            ("stick.deadband", k.deadband, 0.0..=0.5),
            ("stick.torso_xy_m_s", k.torso_xy_m_s, TINY..=0.5),
            ("stick.torso_z_m_s", k.torso_z_m_s, TINY..=0.5),
            ("stick.torso_rad_s", k.torso_rad_s, TINY..=2.0),
            ("stick.gripper_m_s", k.gripper_m_s, TINY..=0.5),
            ("stick.gripper_rad_s", k.gripper_rad_s, TINY..=2.0),
            ("stick.opening_per_s", k.opening_per_s, TINY..=20.0),
            ("stick.torso_xy_limit_m", k.torso_xy_limit_m, TINY..=0.5),
            ("stick.torso_z_limit_m", k.torso_z_limit_m, TINY..=0.5),
            ("stick.torso_tilt_limit_rad", k.torso_tilt_limit_rad, TINY..=1.0),
            ("stick.torso_yaw_limit_rad", k.torso_yaw_limit_rad, TINY..=1.0),
            ("stick.gripper_limit_m", k.gripper_limit_m, TINY..=2.0),
            ("stick.gripper_limit_rad", k.gripper_limit_rad, TINY..=3.0),
        ];
        let more = [
            ("tracking.ahead_max_ms", t.ahead_max_ms as f64, 0.0..=200.0),
            ("tracking.straggler_ms", t.straggler_ms as f64, 0.0..=100.0),
            ("tracking.speed_m_s", t.speed_m_s, 0.0..=5.0),
            ("tracking.speed_rad_s", t.speed_rad_s, 0.0..=5.0),
            ("tracking.jump_gap_ms", t.jump_gap_ms as f64, 0.0..=1000.0),
            ("console.preview_hz", p.preview_hz, 1.0..=30.0),
            ("console.status_hz", p.status_hz, 5.0..=60.0),
        ];
        for (key, value, range) in ranges.into_iter().chain(more) {
            // `contains` is false for NaN as well.
            if !range.contains(&value) {
                let (low, high) = range.into_inner();
                return Err(ConfigError::Range { path: path.to_owned(), key, value, low, high });
            }
        }
        if (o.closed_rad - o.open_rad).abs() < 0.05 {
            return Err(ConfigError::Opening { path: path.to_owned(), value: o.closed_rad });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHIPPED: &str = include_str!("../../configs/teleop.toml");

    #[test]
    fn the_shipped_file_repeats_the_compiled_defaults() {
        let config = Config::parse(SHIPPED, Path::new("teleop.toml")).unwrap();
        assert_eq!(config, Config::default());
        // Every key is there: without any of its lines the file would still equal the defaults.
        let keys = SHIPPED.lines().filter(|l| l.contains(" = ") && !l.starts_with('#')).count();
        assert_eq!(keys, 36);
    }

    #[test]
    fn a_typo_names_file_line_and_key() {
        let text = "[scale]\nhand_transaltion = 1.0\n";
        let error = Config::parse(text, Path::new("x/teleop.toml")).unwrap_err().to_string();
        assert!(error.contains("x/teleop.toml") && error.contains("line 2"), "{error}");
        assert!(error.contains("hand_transaltion"), "{error}");
    }

    #[test]
    fn values_that_are_not_finite_or_out_of_range_are_refused() {
        for text in
            ["[scale]\nhand_translation = nan", "[scale]\nhand_translation = 0", "[command]\nrate_hz = inf"]
        {
            let error = Config::parse(text, Path::new("teleop.toml")).unwrap_err();
            assert!(matches!(error, ConfigError::Range { .. }), "{error}");
        }
        let same = Config::parse("[opening]\nclosed_rad = 0.8", Path::new("teleop.toml")).unwrap_err();
        assert!(matches!(same, ConfigError::Opening { .. }), "{same}");
    }
}
