//! What the tracker says after each instant.

use std::collections::HashMap;

use nalgebra::{Isometry3, Matrix6, Point2, Vector3};

use super::filter::Motion;
use crate::camera::Camera;
use crate::detect::expected::Refusal;
use crate::detect::{Detection, Rect};
use crate::pose::Fate;
use crate::shells::{Shell, ShellSet};
use crate::source::mean_ns;

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
    /// Whether the shell's pose rests on it, or why not.
    pub fate: Fate,
    /// Its corners as the shell's pose has them, if there is a pose.
    pub reprojected_px: Option<[Point2<f64>; 4]>,
}

impl SeenTag {
    /// A tag of a shell, not yet judged.
    pub fn new(detection: Detection, shell: usize, tag: usize) -> Self {
        Self { detection, shell, tag, fate: Fate::Unsolved, reprojected_px: None }
    }

    /// Whether the shell's pose rests on it.
    pub fn is_used(&self) -> bool {
        self.fate == Fate::Used
    }
}

/// A tag that should have been seen and was not.
#[derive(Debug, Clone, PartialEq)]
pub struct MissedTag {
    /// Its number within the family.
    pub id: u32,
    /// Index of the shell that it is on.
    pub shell: usize,
    /// Where it was expected.
    pub corners_px: [Point2<f64>; 4],
    /// Why it was not read.
    pub refusal: Refusal,
}

/// What one camera contributed.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraUpdate {
    /// Its index in the rig.
    pub camera: usize,
    /// When its frame was exposed.
    pub capture_ns: u64,
    /// The tags in its image.
    pub tags: Vec<SeenTag>,
    /// The tags that were expected and not read.
    pub missed: Vec<MissedTag>,
    /// The regions that were searched, or are to be.
    pub searched: Vec<Rect>,
    /// Whether the whole image was searched.
    pub searched_whole: bool,
    /// How long decoding the image took.
    pub decode_ns: u64,
    /// How long reading and searching took.
    pub detect_ns: u64,
    /// Why its image could not be used.
    pub problem: Option<String>,
    /// How far its tags lie from where the poses have them, pixels, if that has lasted and other cameras agree with the
    /// poses: it is no longer where the rig file says.
    pub moved_px: Option<f64>,
}

impl CameraUpdate {
    /// A frame in which nothing was searched yet.
    pub fn nothing(camera: usize, capture_ns: u64) -> Self {
        Self {
            camera,
            capture_ns,
            tags: Vec::new(),
            missed: Vec::new(),
            searched: Vec::new(),
            searched_whole: false,
            decode_ns: 0,
            detect_ns: 0,
            problem: None,
            moved_px: None,
        }
    }

    /// A frame that cannot be used.
    pub fn unusable(camera: usize, capture_ns: u64, problem: String) -> Self {
        Self { problem: Some(problem), ..Self::nothing(camera, capture_ns) }
    }

    /// Whether a tag was found.
    pub fn has_tag(&self, id: u32) -> bool {
        self.tags.iter().any(|seen| seen.detection.id == id)
    }

    /// Adds what another search of the same frame found and this one did not.
    pub fn add(&mut self, other: Self) {
        for seen in other.tags {
            if !self.has_tag(seen.detection.id) {
                self.tags.push(seen);
            }
        }
        self.missed.extend(other.missed);
        self.searched.extend(other.searched);
        self.searched_whole |= other.searched_whole;
        self.detect_ns += other.detect_ns;
    }
}

/// The outcome of one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackUpdate {
    /// The instant: the mean of the frames' capture times.
    pub time_ns: u64,
    /// In the order of the shells file.
    pub shells: Vec<ShellUpdate>,
    /// Those that had a frame.
    pub cameras: Vec<CameraUpdate>,
    /// Duration of decoding (the slowest camera), of detection (likewise), and of solving and filtering.
    pub decode_ns: u64,
    /// See [`TrackUpdate::decode_ns`].
    pub detect_ns: u64,
    /// See [`TrackUpdate::decode_ns`].
    pub solve_ns: u64,
}

impl TrackUpdate {
    /// What a camera of the rig contributed, if it had a frame.
    pub fn camera(&self, index: usize) -> Option<&CameraUpdate> {
        self.cameras.iter().find(|update| update.camera == index)
    }
}

/// The mean capture time; `None` of nothing.
pub(super) fn mean_time_ns<'a>(cameras: impl Iterator<Item = &'a CameraUpdate> + Clone) -> Option<u64> {
    cameras.clone().next()?;
    Some(mean_ns(cameras.map(|camera| camera.capture_ns)))
}

/// Shell and tag index of each id.
#[derive(Debug)]
pub struct TagOwners(HashMap<u32, (usize, usize)>);

impl TagOwners {
    /// Of all tags of all shells.
    pub fn new(shells: &ShellSet) -> Self {
        let tags = shells.shells.iter().enumerate();
        let tags =
            tags.flat_map(|(s, shell)| shell.tags.iter().enumerate().map(move |(t, tag)| (tag.id, (s, t))));
        Self(tags.collect())
    }

    /// The ids, in no order.
    pub fn ids(&self) -> Vec<u32> {
        self.0.keys().copied().collect()
    }

    /// Index of the shell that a tag is on.
    pub fn shell_of(&self, id: u32) -> Option<usize> {
        self.0.get(&id).map(|(shell, _)| *shell)
    }

    /// Names the shell of each detection; those that are on none are left out.
    pub fn assign(&self, found: Vec<Detection>) -> Vec<SeenTag> {
        let seen = |detection: Detection| {
            let &(shell, tag) = self.0.get(&detection.id)?;
            Some(SeenTag::new(detection, shell, tag))
        };
        found.into_iter().filter_map(seen).collect()
    }
}

/// Fills in where a shell's motion puts the corners of the tags that were found, each at its own time.
pub(super) fn reproject(
    shell_index: usize,
    shell: &Shell,
    motion: &Motion,
    cameras: &[Camera],
    updates: &mut [CameraUpdate],
) {
    for update in updates {
        let Some(camera) = cameras.get(update.camera) else { continue };
        let camera_from_world = camera.world_from_camera.inverse();
        let since_s = (i128::from(update.capture_ns) - i128::from(motion.time_ns)) as f64 * 1e-9;
        for seen in update.tags.iter_mut().filter(|seen| seen.shell == shell_index) {
            let Some(tag) = shell.tags.get(seen.tag) else { continue };
            let (corners, found_px) = (tag.corners(), &seen.detection.corners_px);
            let pixels: [Option<Point2<f64>>; 4] = std::array::from_fn(|c| {
                let pose = motion.state().pose_after(since_s + camera.row_delay_s(found_px[c].y));
                camera.project(&(camera_from_world * pose * corners[c]))
            });
            seen.reprojected_px = match pixels {
                [Some(a), Some(b), Some(c), Some(d)] => Some([a, b, c, d]),
                _ => None,
            };
        }
    }
}
