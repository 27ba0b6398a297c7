//! One camera's view of what is already followed: tags are read where they are expected.

use std::time::Instant;

use super::fusion::Motions;
use super::plan;
use super::update::{CameraUpdate, TagOwners};
use super::{TrackerSettings, nanoseconds};
use crate::camera::Camera;
use crate::detect::{Detector, DetectorError, Search};
use crate::image::GrayImage;
use crate::rig::Rig;
use crate::shells::ShellSet;

/// Reads the tags of followed shells in the images of one camera. One for each thread.
#[derive(Debug)]
pub struct Eye {
    index: usize,
    camera: Camera,
    shells: ShellSet,
    settings: TrackerSettings,
    detector: Detector,
    owners: TagOwners,
    /// Counts images: when a lost thumb is searched round its palm.
    images: usize,
    cameras: usize,
}

impl Eye {
    /// For the camera of this index.
    pub fn new(
        rig: &Rig,
        index: usize,
        shells: &ShellSet,
        settings: &TrackerSettings,
    ) -> Result<Self, DetectorError> {
        let owners = TagOwners::new(shells);
        Ok(Self {
            index,
            camera: rig.cameras[index].clone(),
            shells: shells.clone(),
            settings: settings.clone(),
            detector: Detector::new(&owners.ids())?,
            owners,
            images: index,
            cameras: rig.cameras.len(),
        })
    }

    /// Reads what is expected in an image; `motions` are the newest that are known.
    pub fn look(&mut self, image: &GrayImage, capture_ns: u64, motions: &Motions) -> CameraUpdate {
        if let Some(problem) = wrong_size(image, &self.camera) {
            return CameraUpdate::unusable(self.index, capture_ns, problem);
        }
        let begun = Instant::now();
        self.images += 1;
        let my_turn = self.images.is_multiple_of(self.cameras);
        let motions = motions.at(capture_ns, &self.settings);
        let regions = plan::regions(&self.camera, &self.shells, &motions, &self.settings, my_turn);
        let found = self.detector.detect(image, Search::Regions(&regions));
        CameraUpdate {
            tags: self.owners.assign(found),
            searched: regions.iter().map(|region| region.rect).collect(),
            detect_ns: nanoseconds(begun.elapsed()),
            ..CameraUpdate::nothing(self.index, capture_ns)
        }
    }
}

/// What to say of an image that does not have the rig's size.
pub(super) fn wrong_size(image: &GrayImage, camera: &Camera) -> Option<String> {
    let (width, height) = (image.width(), image.height());
    ((width, height) != (camera.width, camera.height)).then(|| {
        format!("the image has {width}x{height} pixels, the rig file says {}x{}", camera.width, camera.height)
    })
}
