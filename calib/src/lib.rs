//! Calibration of cameras, rigs and shells.
//!
//! ```text
//! recording, pictures ─► reading ─► observations ─┬─► intrinsics ─┐
//!                        (our detector)           ├─► extrinsics ─┼─► bundle ─► rig and shells files,
//! board, shells files ────────────────────────────┼─► layout ─────┤  (one       verdicts in words
//!                                                 └─► inspect ────┘   solver)
//! ```
//!
//! [`check`] says what is in rig and shells files as the tracker reads them. Conventions: those of
//! [`locoman_vision`]; rotations are perturbed on the right.

pub mod board;
pub mod bundle;
pub mod check;
pub mod chessboard;
pub mod exchange;
pub mod extrinsics;
pub mod file;
pub mod inspect;
pub mod intrinsics;
pub mod layout;
pub mod pnp;
pub mod print;
pub mod projection;
pub mod reading;
pub mod rehearsal;
pub mod toml_out;
