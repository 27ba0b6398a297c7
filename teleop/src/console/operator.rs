//! What the 3D view of the operator is drawn from: the tags of each shell and the cameras' frusta; sent once.

use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use nalgebra::Point3;
use serde::Serialize;

/// Depth of the drawn frusta, metres.
const FRUSTUM_M: f64 = 0.12;

#[derive(Debug, Serialize)]
pub(super) struct Operator {
    shells: Vec<Shell>,
    cameras: Vec<Camera>,
}

#[derive(Debug, Serialize)]
struct Shell {
    name: String,
    tags: Vec<Tag>,
}

#[derive(Debug, Serialize)]
struct Tag {
    id: u32,
    /// In the shell's frame.
    corners: [[f64; 3]; 4],
}

#[derive(Debug, Serialize)]
struct Camera {
    id: String,
    center: [f64; 3],
    /// The image's corners at [`FRUSTUM_M`] before the camera: top left, top right, bottom right, bottom left.
    corners: [[f64; 3]; 4],
}

/// Of a rig and the shells that it looks at; everything in the world's frame but tags.
pub(super) fn operator(rig: &Rig, shells: &ShellSet) -> Operator {
    let shell = |shell: &locoman_vision::shells::Shell| Shell {
        name: shell.name.clone(),
        tags: shell
            .tags
            .iter()
            .map(|tag| Tag { id: tag.id, corners: tag.corners().map(|corner| corner.coords.into()) })
            .collect(),
    };
    Operator {
        shells: shells.shells.iter().map(shell).collect(),
        cameras: rig.cameras.iter().map(camera).collect(),
    }
}

/// A lens that distorts is drawn as if it did not: the picture shows where cameras are and look.
fn camera(camera: &locoman_vision::camera::Camera) -> Camera {
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let corner = |x: f64, y: f64| {
        let x = (x - camera.center_px.x) / camera.focal_px.x * FRUSTUM_M;
        let y = (y - camera.center_px.y) / camera.focal_px.y * FRUSTUM_M;
        (camera.world_from_camera * Point3::new(x, y, FRUSTUM_M)).coords.into()
    };
    Camera {
        id: camera.id.clone(),
        center: camera.world_from_camera.translation.vector.into(),
        corners: [corner(0.0, 0.0), corner(width, 0.0), corner(width, height), corner(0.0, height)],
    }
}
