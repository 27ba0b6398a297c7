//! Extrinsics: where the cameras of a rig stand, from a board or a worn shell that is waved before them.
//!
//! ```text
//! observations ─► poses before each camera ─► clocks ─► graph of pairs ─► motion ─► bundle adjustment ─► rig
//!                 (one image at a time)       (turning   (spanning        (instants
//!                                              speeds)    tree)            or a path)
//! ```
//!
//! The first camera keeps the place that its rig file gives it; [`World`] moves everything afterwards.

mod align;
mod clocks;
mod graph;
mod poses;
mod solve;
mod world;

pub use align::align;
pub use solve::{Freedom, Solved, solve};
pub use world::World;

/// Why cameras could not be placed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExtrinsicsError {
    /// Nothing was seen.
    #[error(
        "nothing of the board or shell was seen\n  hint: check its file, the light, and that the recording shows it"
    )]
    Nothing,
    /// A camera sees the body too rarely.
    #[error(
        "camera `{camera}` tells the pose of the board or shell in {images} images, {least} are needed\n  hint: wave it before \
         this camera too, near enough that tags are 20 pixels wide"
    )]
    HardlySeen {
        /// The camera.
        camera: String,
        /// Images with a pose.
        images: usize,
        /// Fewest.
        least: usize,
    },
    /// The cameras fall into groups.
    #[error(
        "{apart}: never see the board or shell together with {together} (fewer than {least} moments)\n  hint: wave it where \
         one of each sees it at the same time; a worn shell is seen from two sides"
    )]
    NeverTogether {
        /// Cameras without a tie to the first.
        apart: String,
        /// The first, and those tied to it.
        together: String,
        /// Fewest moments.
        least: usize,
    },
    /// Most of what was seen contradicts the rest.
    #[error(
        "{:.0} % of the tags that were seen do not fit the rest ({rms_px:.2} px)\n  hint: check the board's or shells' file \
         against the print (sizes, numbers), the intrinsics, and which cameras are exposed together (`sync`)", 100.0 * share
    )]
    NothingAgrees {
        /// Share that was set aside.
        share: f64,
        /// RMS of the rest.
        rms_px: f64,
    },
}

#[cfg(test)]
mod tests;
