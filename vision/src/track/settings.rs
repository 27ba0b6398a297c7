//! What the tracker believes about cameras, tags and hands.

use super::filter::FilterSettings;
use crate::detect::Detection;
use crate::pose::SolverSettings;

/// All settings of a [`super::Tracker`]; the defaults suit 720p cameras about a metre from a hand.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackerSettings {
    /// The pose solver.
    pub solver: SolverSettings,
    /// The motion filter.
    pub filter: FilterSettings,
    /// How long a shell that is not seen is predicted before it counts as lost, nanoseconds.
    pub horizon_ns: u64,
    /// A pose whose corners' RMS is larger is not accepted, pixels.
    pub max_rms_px: f64,
    /// Jumps in a row after which the tracker believes them and begins anew.
    pub jumps_to_restart: u32,
    /// Noise of a corner of a large tag, with what calibration leaves, standard deviation per axis, pixels.
    pub corner_floor_px: f64,
    /// Further error of a corner of a tag with sides of ten pixels, whose own cells bias its edges; falls with
    /// the third power of the side (measured on rendered images with a lens blur of 0.7 pixels).
    pub corner_small_px: f64,
    /// What of that is left if the tag was searched enlarged.
    pub corner_enlarged: f64,
    /// Tags with sides longer than this (pixels) are searched at every other pixel,
    pub coarse_side_px: f64,
    /// and those with shorter ones than this in a region enlarged twice.
    pub fine_side_px: f64,
    /// Reduction of a whole image when it is searched for what is lost.
    pub full_decimate: f32,
    /// How many standard deviations of the predicted position a region leaves round its tags.
    pub margin_sigmas: f64,
    /// Tags are looked for this far from where they are predicted, and farther by the doubt of the prediction.
    pub least_doubt_px: f64,
    /// What a region leaves round its tags at least, pixels.
    pub margin_px: f64,
    /// Half the width of the cube round the palm in which its lost thumb is searched, metres.
    pub thumb_reach_m: f64,
}

impl Default for TrackerSettings {
    fn default() -> Self {
        Self {
            solver: SolverSettings::default(),
            filter: FilterSettings::default(),
            horizon_ns: 250_000_000,
            max_rms_px: 2.0,
            jumps_to_restart: 3,
            corner_floor_px: 0.04,
            corner_small_px: 0.75,
            corner_enlarged: 0.5,
            coarse_side_px: 30.0,
            fine_side_px: 18.0,
            full_decimate: 2.0,
            margin_sigmas: 2.0,
            least_doubt_px: 2.0,
            margin_px: 5.0,
            thumb_reach_m: 0.12,
        }
    }
}

impl TrackerSettings {
    /// Standard deviation of a detected corner along each axis, pixels.
    pub fn corner_sigma_px(&self, detection: &Detection) -> f64 {
        let tens = detection.shortest_side_px() / 10.0;
        let enlarged = if detection.decimate < 1.0 { self.corner_enlarged } else { 1.0 };
        self.corner_floor_px.hypot(enlarged * self.corner_small_px / tens.powi(3))
    }
}
