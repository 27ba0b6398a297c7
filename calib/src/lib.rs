//! Calibration of cameras, rigs and shells.

pub mod board;
pub mod bundle;
pub mod check;
pub mod chessboard;
pub mod exchange;
pub mod file;
pub mod intrinsics;
pub mod pnp;
pub mod print;
pub mod projection;
pub mod rehearsal;
