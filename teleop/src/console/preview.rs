//! Camera previews: half-size JPEGs, each with what was found in it, so that drawing and picture belong to
//! the same instant.
//!
//! Wire format: length of the head (4 bytes, little endian), the head (JSON), the JPEG.

use locoman_vision::camera::Camera;
use locoman_vision::image::{Frame, ImageError};
use locoman_vision::rig::Rig;
use locoman_vision::track::{CameraUpdate, TrackUpdate};
use nalgebra::{Isometry3, Point3};
use serde::Serialize;

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
    dropped: u64,
    tags: Vec<Tag>,
    axes: Vec<Axes<'a>>,
}

#[derive(Debug, Serialize)]
struct Tag {
    accepted: bool,
    corners: [[f64; 2]; 4],
}

#[derive(Debug, Serialize)]
struct Axes<'a> {
    name: &'a str,
    origin: [f64; 2],
    /// Ends of x, y, z; `null` where they cannot be seen.
    ends: [Option<[f64; 2]>; 3],
}

/// The message for one camera's frame.
pub(super) fn message(
    rig: &Rig,
    frame: &Frame,
    update: &TrackUpdate,
    names: &[String],
    dropped: u64,
) -> Result<Option<Vec<u8>>, ImageError> {
    let (Some(camera), Some(seen)) = (rig.cameras.get(frame.camera), update.camera(frame.camera)) else {
        return Ok(None);
    };
    let shells = names.iter().zip(&update.shells);
    let head = Head {
        camera: &camera.id,
        capture_ns: frame.capture_ns,
        width: camera.width,
        dropped,
        tags: tags(seen),
        axes: shells
            .filter_map(|(name, shell)| axes(camera, name, shell.world_from_shell.as_ref()?))
            .collect(),
    };
    let head = serde_json::to_vec(&head).unwrap_or_default();
    let jpeg = frame.pixels.to_gray_half()?.to_jpeg(JPEG_QUALITY)?;
    let length = u32::try_from(head.len()).unwrap_or(0).to_le_bytes();
    Ok(Some([length.as_slice(), &head, &jpeg].concat()))
}

fn tags(seen: &CameraUpdate) -> Vec<Tag> {
    let tag = |tag: &locoman_vision::track::SeenTag| Tag {
        accepted: tag.used,
        corners: tag.detection.corners_px.map(|corner| [corner.x, corner.y]),
    };
    seen.tags.iter().map(tag).collect()
}

/// `None` if the origin is not in the image.
fn axes<'a>(camera: &Camera, name: &'a str, world_from_shell: &Isometry3<f64>) -> Option<Axes<'a>> {
    let camera_from_shell = camera.world_from_camera.inverse() * world_from_shell;
    let pixel = |x: f64, y: f64, z: f64| camera.project(&(camera_from_shell * Point3::new(x, y, z)));
    let origin = pixel(0.0, 0.0, 0.0).filter(|origin| camera.contains(origin))?;
    let ends = [pixel(AXIS_M, 0.0, 0.0), pixel(0.0, AXIS_M, 0.0), pixel(0.0, 0.0, AXIS_M)];
    Some(Axes { name, origin: origin.into(), ends: ends.map(|end| end.map(Into::into)) })
}
