//! The robot's side.

pub mod dynamics;
pub mod joints;
pub mod model;
pub mod plant;
pub mod wbc;
