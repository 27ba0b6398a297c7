//! Intrinsics: focal lengths, centre and distortion of one camera, from views of a flat target.
//!
//! ```text
//! images ─► views (points of the target) ─► choose ─► start: focal lengths × PnP ─► adjust ─► verdict, plot, rig file
//! ```

mod fit;
mod model;
pub mod plot;
mod verdict;
mod view;

pub use fit::{Calibration, Settings, ViewResult, calibrate};
pub use model::Model;
pub use verdict::{GOOD_PX, SUPPORTED_PX, parameters, verdict};
pub use view::{PartView, View, choose};

/// Why there are no intrinsics.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IntrinsicsError {
    /// Too few views with enough points.
    #[error(
        "only {usable} of {given} views show enough of the board, {needed} are needed\n  hint: take 20 or more, near and \
         far, tilted by 30 to 45 degrees, in all parts of the image"
    )]
    TooFewViews {
        /// Views with enough points.
        usable: usize,
        /// Views that were given.
        given: usize,
        /// Fewest.
        needed: usize,
    },
    /// Edges are too wide.
    #[error(
        "only {sharp} of {given} views are sharp: edges are {median_px:.1} px wide in the middle of the ranking, {most_px} px \
         at most are usable\n  hint: hold the board still, give more light so that exposures are short, focus the lens"
    )]
    Blurred {
        /// Sharp views.
        sharp: usize,
        /// Views with enough points.
        given: usize,
        /// Median width of edges.
        median_px: f64,
        /// What is allowed.
        most_px: f64,
    },
    /// No focal length explains the views.
    #[error(
        "no focal length explains the {views} views\n  hint: check rows, columns and numbers in the board file, and that the \
         board is flat"
    )]
    NoStart {
        /// Views that were tried.
        views: usize,
    },
    /// The views do not determine the camera.
    #[error(
        "{views} views do not determine focal length and centre: they are all alike\n  hint: tilt the board by 30 to 45 \
         degrees to all sides, near and far"
    )]
    Undetermined {
        /// Views that were used.
        views: usize,
    },
    /// The tags are larger or smaller, against their distances, than the file says.
    #[error(
        "the printed tags are {ratio:.3} times as large, against the gaps between them, as the board file says (errors of \
         {rms_px:.2} px)\n  hint: measure tag and gap on the print, and correct the board file"
    )]
    WrongSize {
        /// Printed by stated size.
        ratio: f64,
        /// RMS of the fit.
        rms_px: f64,
    },
    /// The points do not fit a board as described.
    #[error(
        "{:.0} % of what was seen does not fit the board file, the rest by {rms_px:.2} px\n  hint: check rows, columns and \
         first number in the board file, and glue the board onto something flat", 100.0 * share
    )]
    WrongBoard {
        /// Share that was set aside.
        share: f64,
        /// RMS of the fit.
        rms_px: f64,
    },
    /// Tags are seen in the mirror alone.
    #[error(
        "tags are found only in mirrored images ({found} in {images} images)\n  hint: the board was printed mirrored, or the \
         camera mirrors its image (a selfie setting): print again, or switch that off"
    )]
    Mirrored {
        /// Tags found in mirrored images.
        found: usize,
        /// Images that were looked at.
        images: usize,
    },
    /// Nothing was found.
    #[error(
        "no tag of the board in {images} images\n  hint: the board has the numbers {first} to {last}: check its file, that \
         a white cell surrounds each tag, and the light"
    )]
    Nothing {
        /// Images that were looked at.
        images: usize,
        /// Least number.
        first: u32,
        /// Largest number.
        last: u32,
    },
}

#[cfg(test)]
mod tests;
