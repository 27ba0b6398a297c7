//! What the console shows of a camera: its last image, what was searched and found in it, and the shells' poses at
//! that time.

use std::sync::Arc;

use locoman_vision::image::GrayImage;
use locoman_vision::shells::ShellSet;
use locoman_vision::track::{CameraUpdate, TrackUpdate};
use nalgebra::Isometry3;

use crate::board::Board;
use crate::latest::lock;

/// One camera at one instant.
#[derive(Debug)]
pub struct Shown {
    /// What was found.
    pub seen: CameraUpdate,
    /// The image; `None` if another machine reads the camera.
    pub image: Option<Arc<GrayImage>>,
    /// Name and `world_from_shell` of every shell that is not lost.
    pub shells: Vec<(String, Isometry3<f64>)>,
}

/// Puts what was solved last, with the images that belong to it, where the console finds it.
pub fn put(board: &Board, shells: &ShellSet, update: TrackUpdate, mut images: Vec<(usize, Arc<GrayImage>)>) {
    let poses = shells.shells.iter().zip(&update.shells);
    let poses: Vec<(String, Isometry3<f64>)> =
        poses.filter_map(|(shell, seen)| Some((shell.name.clone(), seen.world_from_shell?))).collect();
    let mut shown = lock(&board.shown);
    for seen in update.cameras {
        let image = images.iter().position(|(camera, _)| *camera == seen.camera);
        let image = image.map(|index| images.swap_remove(index).1);
        shown.insert(seen.camera, Arc::new(Shown { image, shells: poses.clone(), seen }));
    }
}

/// What to say of a camera whose tags lie so far from where the poses have them.
pub fn moved(moved_px: f64) -> String {
    format!(
        "has moved: it sees tags {moved_px:.0} px from where the other cameras have them; put it back or calibrate the rig"
    )
}
