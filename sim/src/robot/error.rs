//! Why the simulated robot cannot be built or cannot go on.

use std::path::PathBuf;

use locoman_robot::model::ModelError;

/// Problems of the simulated robot.
#[derive(Debug, thiserror::Error)]
pub enum SimRobotError {
    /// The scene file cannot be read.
    #[error("cannot read {path}: {reason}; is `--configs` the folder `configs` of this project?")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: std::io::Error,
    },
    /// The scene file is not what it should be.
    #[error("{path}: {reason}")]
    Scene {
        /// The file.
        path: PathBuf,
        /// What the parser said, with the line.
        reason: Box<toml::de::Error>,
    },
    /// A value in the scene file makes no sense.
    #[error("{path}: {problem}")]
    Value {
        /// The file.
        path: PathBuf,
        /// The key, its value and what it may be.
        problem: String,
    },
    /// A name that the scene file does not have.
    #[error("no {what} named `{name}` in the scene file; there are: {known}")]
    Unknown {
        /// Profile or posture.
        what: &'static str,
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// The robot's model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// MuJoCo refused the scene.
    #[error("MuJoCo: {0}")]
    MuJoCo(String),
    /// A disturbance that no world can do.
    #[error("{what} must be a finite number that is not negative, not {value}")]
    Disturbance {
        /// Which number of it.
        what: &'static str,
        /// What was asked for.
        value: f64,
    },
    /// The socket for commands.
    #[error("the socket for commands: {0}")]
    Socket(std::io::Error),
    /// The physics blew up.
    #[error("the simulated robot's state is no longer finite after {time_s} s: look at the last commands")]
    Diverged {
        /// Simulated time, s.
        time_s: f64,
    },
}
