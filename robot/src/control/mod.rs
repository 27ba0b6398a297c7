//! The control loop, without its I/O.
//!
//! ```text
//! Sensors ──► estimator ──► supervisor ──► machine ──► choreography ──► WBC ──► compensation ──► JointCommand
//! Command ────────────────────▲──────────────▲──────────────▲                                └──► Snapshot
//! ```
//! [`Controller`] is the same in the real loop, in lockstep tests and in replay: it has no clock, takes no
//! lock, does no I/O and allocates nothing.

mod compensation;
mod controller;
mod posture;
mod report;
mod requests;
mod run;
mod settings;
mod snapshot;
mod timing;
mod watch;

pub use compensation::{Compensation, CompensationSettings, LearningSettings};
pub use controller::{Controller, Inputs, Options};
pub use run::{Wish, run};
pub(crate) use settings::read_toml;
pub use settings::{ConfigError, ControlSettings, RobotConfig};
pub use snapshot::{BodyState, CommandTrace, Snapshot};
pub use timing::{Percentiles, SecondHistogram};
