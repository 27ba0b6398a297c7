//! The robot's side.
//!
//! ```text
//! plant ─► estimator ─► supervisor ─► modes ─► commander ─► wbc ─► plant        (control: one step of it)
//!                            ▲          ▲          ▲      model, dynamics
//! link ──────────────────────┴──────────┴──────────┘
//! ```

pub mod collision;
pub mod commander;
pub mod control;
pub mod dynamics;
pub mod estimator;
pub mod go1;
pub mod joints;
pub mod kinematics;
pub mod link;
pub mod locomotion;
pub mod model;
pub mod modes;
pub mod plant;
mod polyhedron;
pub mod servo;
pub mod supervisor;
pub mod trajectory;
pub mod wbc;
