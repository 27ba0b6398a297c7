//! The rig: the calibrated cameras of a room, as a rig file (TOML) describes them.

use crate::camera::Camera;

/// The cameras of a room.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    /// In the order of the file; an index into it names a camera within the program.
    pub cameras: Vec<Camera>,
}
