//! The tags behind the poses, beside the tags that are there.

use locoman_vision::camera::Camera;
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use locoman_vision::track::{SeenTag, TrackUpdate};
use nalgebra::Isometry3;

use super::film::{Shot, scene_s};
use crate::eval::statistics::rms;
use crate::operator::motion::Body;
use crate::operator::shutter::seen_by_its_rows;
use crate::operator::studio::Studio;

/// An accepted tag whose corners lie farther than this from where the truth projects them is a false one:
/// far beyond noise (0.1 px) and motion blur (1 px), well below the size of any tag.
const FALSE_TAG_PX: f64 = 4.0;

/// From this size on a corner's noise hardly depends on the size.
const LARGE_TAG_PX: f64 = 30.0;

/// What was read, and how well.
#[derive(Debug, Default)]
pub struct TagTally {
    /// Tags that a pose rests on and that are not where they were found.
    pub false_accepted: usize,
    readable: usize,
    read: usize,
    large_corner_errors_px: Vec<f64>,
    small_corner_errors_px: Vec<f64>,
}

impl TagTally {
    /// Compares what an update found in each image with what is there.
    pub fn add(&mut self, studio: &Studio, rig: &Rig, shells: &ShellSet, shot: &Shot, update: &TrackUpdate) {
        for (index, sightings) in &shot.sightings {
            let (Some(camera), Some(update)) = (rig.cameras.get(*index), update.camera(*index)) else {
                continue;
            };
            for seen in update.tags.iter().filter(|seen| seen.is_used()) {
                let error_px = worst_corner_px(studio, camera, update.capture_ns, seen, shells);
                self.false_accepted += usize::from(error_px > FALSE_TAG_PX);
            }
            for truth in sightings.iter().filter(|truth| truth.is_readable()) {
                self.readable += 1;
                if let Some(seen) = update.tags.iter().find(|seen| seen.detection.id == truth.id) {
                    self.read += 1;
                    let errors_px = if truth.side_px >= LARGE_TAG_PX {
                        &mut self.large_corner_errors_px
                    } else {
                        &mut self.small_corner_errors_px
                    };
                    for (a, b) in seen.detection.corners_px.iter().zip(&truth.corners_px) {
                        errors_px.extend((a - b).iter());
                    }
                }
            }
        }
    }

    /// Readable tags that were read, whether or not a pose rests on them.
    pub fn read_share(&self) -> f64 {
        self.read as f64 / self.readable as f64
    }

    /// Error of the corners of readable tags per axis: with sides of at least 30 pixels, and of 16 to 30.
    pub fn corner_rms_px(&self) -> (f64, f64) {
        (rms(&self.large_corner_errors_px), rms(&self.small_corner_errors_px))
    }
}

fn worst_corner_px(
    studio: &Studio,
    camera: &Camera,
    capture_ns: u64,
    seen: &SeenTag,
    shells: &ShellSet,
) -> f64 {
    let shell = shells.shells.get(seen.shell);
    let body = shell.and_then(|shell| Body::from_name(&shell.name));
    let tag = shell.and_then(|shell| shell.tags.get(seen.tag));
    let (Some(body), Some(tag)) = (body, tag) else { return f64::INFINITY };
    let camera_from_world = camera.world_from_camera.inverse();
    let camera_from_shell = |t_s: f64| -> Isometry3<f64> { camera_from_world * studio.true_pose(body, t_s) };
    tag.corners()
        .iter()
        .zip(&seen.detection.corners_px)
        .map(|(corner, found)| {
            seen_by_its_rows(camera, scene_s(capture_ns), |t_s| camera_from_shell(t_s) * corner)
                .map_or(f64::INFINITY, |(truth, _)| (truth - found).norm())
        })
        .fold(0.0, f64::max)
}
