//! From images to 6D poses of tag-covered shells.

pub mod camera;
pub mod config;
pub mod rig;
pub mod shells;
