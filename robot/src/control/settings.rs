//! Reads the robot's configuration folder.

use std::path::{Path, PathBuf};

use serde::{Deserialize, de::DeserializeOwned};

use super::CompensationSettings;
use crate::{
    commander::Limits,
    estimator::EstimatorSettings,
    locomotion::LocomotionSettings,
    model::{Model, ModelError},
    modes::{JointGains, MotionSettings, PoseSettings, UprightSettings},
    supervisor::Thresholds,
    wbc::{SettingsError, WbcSettings},
};

/// Everything in `control.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControlSettings {
    /// State estimation.
    pub estimator: EstimatorSettings,
    /// Named postures.
    pub poses: PoseSettings,
    /// Durations of scripted motions.
    pub motions: MotionSettings,
    /// How the robot sits up.
    pub upright: UprightSettings,
    /// Joint-level gains.
    pub gains: JointGains,
    /// What the joints learn.
    pub compensation: CompensationSettings,
}

/// Everything that the controller is made from.
#[derive(Debug, Clone)]
pub struct RobotConfig {
    /// The robot.
    pub model: Model,
    /// `wbc.toml`
    pub wbc: WbcSettings,
    /// `control.toml`
    pub control: ControlSettings,
    /// `locomotion.toml`
    pub locomotion: LocomotionSettings,
    /// `limits.toml`
    pub limits: Limits,
    /// `supervisor.toml`
    pub thresholds: Thresholds,
}

/// Why a configuration was refused.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The whole-body controller's settings.
    #[error(transparent)]
    Wbc(#[from] SettingsError),
    /// A file could not be read.
    #[error("cannot read {file}: {source}; is `--configs` the folder `configs` of this project?")]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A number that makes no sense.
    #[error("{file}: `{key}` must be {expected}")]
    Value {
        /// The file.
        file: PathBuf,
        /// The key.
        key: &'static str,
        /// What it must be.
        expected: &'static str,
    },
    /// A file is not what it should be.
    #[error("{file}: {source}")]
    Parse {
        /// The file.
        file: PathBuf,
        /// What the parser said, with the line.
        source: Box<toml::de::Error>,
    },
}

impl RobotConfig {
    /// Reads the folder `robot` of a configuration folder (`configs`).
    pub fn load(configs: &Path) -> Result<Self, ConfigError> {
        let folder = configs.join("robot");
        let file = folder.join("locomotion.toml");
        let locomotion: LocomotionSettings = read_toml(&file)?;
        if let Some((key, expected)) = locomotion.flaw() {
            return Err(ConfigError::Value { file, key, expected });
        }
        Ok(Self {
            model: Model::load(&folder)?,
            wbc: WbcSettings::load(&folder.join("wbc.toml"))?,
            control: read_toml(&folder.join("control.toml"))?,
            locomotion,
            limits: read_toml(&folder.join("limits.toml"))?,
            thresholds: read_toml(&folder.join("supervisor.toml"))?,
        })
    }
}

/// Reads a file of settings; an error names the file and the line.
pub(crate) fn read_toml<T: DeserializeOwned>(file: &Path) -> Result<T, ConfigError> {
    let text = std::fs::read_to_string(file)
        .map_err(|source| ConfigError::Read { file: file.to_owned(), source })?;
    toml::from_str(&text)
        .map_err(|source| ConfigError::Parse { file: file.to_owned(), source: Box::new(source) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documented_defaults_are_the_compiled_ones() {
        let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
        let config = RobotConfig::load(&configs).unwrap();
        assert_eq!(config.control, ControlSettings::default());
        assert_eq!(config.locomotion, LocomotionSettings::default());
        assert_eq!(config.limits, Limits::default());
        assert_eq!(config.thresholds, Thresholds::default());
    }
}
