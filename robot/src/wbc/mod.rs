//! Whole-body impulse control, after the paper's appendix.
//!
//! ```text
//! state ──► dynamics ──► hierarchy of objectives ──► contact-force QP ──► torques
//!            J, J̇q̇,       q̄, dq̄, ddq̄ by exact         f_r, δ_t            A q̈ + b + g - J_cᵀ f_r
//!            A, b, g       nested null spaces
//! ```
//! What an operation mode controls is a list of [`Objective`]s, most important first: data, not code.
//! The world's z axis is up: its gravity points along -z.

mod barrier;
mod contact;
mod controller;
pub mod force;
mod ground;
mod hierarchy;
mod inertia;
mod objective;
mod output;
mod settings;
mod status;
mod stops;
mod task;
mod tracking;

pub use contact::{ContactPoint, ContactSet};
pub use controller::{StepPart, Tracked, WholeBodyController};
pub use objective::{Objective, ObjectiveKind, PointReference, RotationReference};
pub use output::WbcOutput;
pub use settings::{ContactForceSettings, Gains, ObjectiveGains, SettingsError, StopSettings, WbcSettings};
pub use status::{ForceFailure, ForceSource, WbcFault, WbcStatus};
