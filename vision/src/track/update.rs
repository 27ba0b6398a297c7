//! What the tracker says after each instant.

use nalgebra::{Isometry3, Matrix6, Point2, Vector3};

use crate::camera::Camera;
use crate::detect::{Detection, Rect};
use crate::shells::Shell;

/// How a pose came about. Ordered from good to bad.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Measured at this instant.
    Tracked,
    /// Not measured now; extrapolated from a moment ago, with growing covariance.
    Predicted,
    /// Unknown.
    Lost,
}

/// One shell at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct ShellUpdate {
    /// How the pose came about.
    pub verdict: Verdict,
    /// The pose; `None` exactly if the verdict is `Lost`.
    pub world_from_shell: Option<Isometry3<f64>>,
    /// Covariance of position (world axes, m²), then rotation (shell axes, rad²).
    pub covariance: Matrix6<f64>,
    /// Velocity of the shell's origin, world axes, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Angular velocity, shell axes, rad/s.
    pub rate_rad_s: Vector3<f64>,
    /// RMS of the corners' residuals, pixels; 0 if not measured.
    pub rms_px: f64,
    /// Different tags behind the pose; 0 if not measured.
    pub tags: usize,
    /// Different cameras behind the pose; 0 if not measured.
    pub cameras: usize,
}

impl ShellUpdate {
    /// A shell of which nothing is known.
    pub fn lost() -> Self {
        Self {
            verdict: Verdict::Lost,
            world_from_shell: None,
            covariance: Matrix6::zeros(),
            velocity_m_s: Vector3::zeros(),
            rate_rad_s: Vector3::zeros(),
            rms_px: 0.0,
            tags: 0,
            cameras: 0,
        }
    }
}

/// A tag that was found in an image.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenTag {
    /// What the detector found.
    pub detection: Detection,
    /// Index of the shell that it is on.
    pub shell: usize,
    /// Index of the tag on the shell.
    pub tag: usize,
    /// Whether the shell's pose rests on it; `false` for outliers and where no pose was found.
    pub used: bool,
    /// Its corners as the shell's pose has them, if there is a pose.
    pub reprojected_px: Option<[Point2<f64>; 4]>,
}

/// What one camera contributed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CameraUpdate {
    /// When its frame was exposed; `None` if it had none in this set.
    pub capture_ns: Option<u64>,
    /// The tags in its image.
    pub tags: Vec<SeenTag>,
    /// The regions that were searched.
    pub searched: Vec<Rect>,
    /// Whether the whole image was searched.
    pub searched_whole: bool,
    /// How long decoding the image took.
    pub decode_ns: u64,
    /// Why its image could not be used.
    pub problem: Option<String>,
}

/// The outcome of one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackUpdate {
    /// The instant: when the frames were exposed.
    pub time_ns: u64,
    /// In the order of the shells file.
    pub shells: Vec<ShellUpdate>,
    /// In the order of the rig file.
    pub cameras: Vec<CameraUpdate>,
    /// Duration of decoding (the slowest camera), of detection, and of solving and filtering.
    pub decode_ns: u64,
    /// See [`TrackUpdate::decode_ns`].
    pub detect_ns: u64,
    /// See [`TrackUpdate::decode_ns`].
    pub solve_ns: u64,
}

/// Fills in where a pose puts the corners of the tags that were found.
pub(super) fn reproject(
    shell_index: usize,
    shell: &Shell,
    pose: &Isometry3<f64>,
    cameras: &[Camera],
    updates: &mut [CameraUpdate],
) {
    for (camera, update) in cameras.iter().zip(updates) {
        let camera_from_shell = camera.world_from_camera.inverse() * pose;
        for seen in update.tags.iter_mut().filter(|seen| seen.shell == shell_index) {
            let corners = shell.tags[seen.tag].corners();
            let pixels = corners.map(|corner| camera.project(&(camera_from_shell * corner)));
            seen.reprojected_px = match pixels {
                [Some(a), Some(b), Some(c), Some(d)] => Some([a, b, c, d]),
                _ => None,
            };
        }
    }
}
