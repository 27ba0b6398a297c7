//! Calibration of cameras, rigs and shells.
//!
//! What stands today: [`check`] reads rig and shells files as the tracker does, and says what is in them.
//! Intrinsics, extrinsics, shell geometry, printable boards, import and export come with issues of their own;
//! files that others made (OpenCV's coefficients in a rig file) are used as they are.

pub mod check;
pub mod print;
