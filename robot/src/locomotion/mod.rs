//! Walking: where the torso goes, when which foot lifts, and where it lands.
//!
//! ```text
//! velocity ──► Course ──► torso's reference ─────────────────────────────┐
//!                │                                                       ├──► Setpoint ──► whole-body controller
//! Gait ──► which feet stand ──► landing, Swing ──► feet's references ────┘
//!   ▲ feet that feel the ground
//! ```

mod course;
mod gait;
mod ground;
mod placement;
mod settings;
mod swing;
mod walker;

pub use course::{Course, Velocity};
pub use gait::{Gait, LegPhase};
pub use ground::GroundPlane;
pub use placement::{Motion, landing};
pub use settings::{
    ContactEvents, CourseSettings, GaitSettings, HoldingSettings, LocomotionSettings, PlacementSettings,
    SwingSettings, TrimSettings,
};
pub use swing::Swing;
pub use walker::{Steps, Walker};
