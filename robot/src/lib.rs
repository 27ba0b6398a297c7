//! The robot's side.

pub mod joints;
pub mod plant;
