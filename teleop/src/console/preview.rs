//! Camera previews: half-size JPEGs, each with what was searched and found in it, so that drawing and picture belong
//! to the same instant.
//!
//! Wire format: length of the head (4 bytes, little endian), the head (JSON), the JPEG (empty if another machine reads
//! the camera: its images stay there).

use locoman_vision::camera::Camera;
use locoman_vision::image::ImageError;
use locoman_vision::rig::Rig;
use locoman_vision::track::{MissedTag, SeenTag};
use nalgebra::{Isometry3, Point3};
use serde::Serialize;

use crate::shown::Shown;

/// Enough to see tags by eye.
const JPEG_QUALITY: i32 = 75;
/// Length of the drawn axes: about a palm.
const AXIS_M: f64 = 0.08;

#[derive(Debug, Serialize)]
struct Head<'a> {
    camera: &'a str,
    capture_ns: u64,
    /// Of the full image, in whose pixels everything here is.
    width: u32,
    height: u32,
    tags: Vec<Tag>,
    missed: Vec<Missed>,
    /// x, y, width, height of what was searched.
    regions: Vec<[u32; 4]>,
    whole: bool,
    problem: Option<&'a str>,
    axes: Vec<Axes<'a>>,
}

#[derive(Debug, Serialize)]
struct Tag {
    id: u32,
    accepted: bool,
    /// `used`, or why not.
    fate: String,
    corners: [[f64; 2]; 4],
    /// Where the shell's pose has its corners.
    reprojected: Option<[[f64; 2]; 4]>,
    /// The largest distance of a corner from there.
    off_px: Option<f64>,
}

/// A tag that was expected and not read.
#[derive(Debug, Serialize)]
struct Missed {
    id: u32,
    corners: [[f64; 2]; 4],
    why: String,
}

#[derive(Debug, Serialize)]
struct Axes<'a> {
    name: &'a str,
    origin: [f64; 2],
    /// Ends of x, y, z; `null` where they cannot be seen.
    ends: [Option<[f64; 2]>; 3],
}

/// The message for one camera.
pub(super) fn message(rig: &Rig, shown: &Shown) -> Result<Option<Vec<u8>>, ImageError> {
    let Some(camera) = rig.cameras.get(shown.seen.camera) else { return Ok(None) };
    let head = Head {
        camera: &camera.id,
        capture_ns: shown.seen.capture_ns,
        width: camera.width,
        height: camera.height,
        tags: shown.seen.tags.iter().map(tag).collect(),
        missed: shown.seen.missed.iter().map(missed).collect(),
        regions: shown.seen.searched.iter().map(|rect| [rect.x, rect.y, rect.width, rect.height]).collect(),
        whole: shown.seen.searched_whole,
        problem: shown.seen.problem.as_deref(),
        axes: shown.shells.iter().filter_map(|(name, pose)| axes(camera, name, pose)).collect(),
    };
    let head = serde_json::to_vec(&head).unwrap_or_default();
    let jpeg = match &shown.image {
        Some(image) => image.half().to_jpeg(JPEG_QUALITY)?,
        None => Vec::new(),
    };
    let length = u32::try_from(head.len()).unwrap_or(0).to_le_bytes();
    Ok(Some([length.as_slice(), &head, &jpeg].concat()))
}

fn tag(tag: &SeenTag) -> Tag {
    let corners = &tag.detection.corners_px;
    let off = |there: &[_; 4]| {
        corners.iter().zip(there).map(|(seen, there)| nalgebra::distance(seen, there)).fold(0.0, f64::max)
    };
    Tag {
        id: tag.detection.id,
        accepted: tag.is_used(),
        fate: tag.fate.to_string(),
        corners: corners.map(Into::into),
        reprojected: tag.reprojected_px.map(|corners| corners.map(Into::into)),
        off_px: tag.reprojected_px.as_ref().map(off),
    }
}

fn missed(tag: &MissedTag) -> Missed {
    Missed { id: tag.id, corners: tag.corners_px.map(Into::into), why: tag.refusal.to_string() }
}

/// `None` if the origin is not in the image.
fn axes<'a>(camera: &Camera, name: &'a str, world_from_shell: &Isometry3<f64>) -> Option<Axes<'a>> {
    let camera_from_shell = camera.world_from_camera.inverse() * world_from_shell;
    let pixel = |x: f64, y: f64, z: f64| camera.project(&(camera_from_shell * Point3::new(x, y, z)));
    let origin = pixel(0.0, 0.0, 0.0).filter(|origin| camera.contains(origin))?;
    let ends = [pixel(AXIS_M, 0.0, 0.0), pixel(0.0, AXIS_M, 0.0), pixel(0.0, 0.0, AXIS_M)];
    Some(Axes { name, origin: origin.into(), ends: ends.map(|end| end.map(Into::into)) })
}
