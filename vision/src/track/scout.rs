//! The search of whole images for what is lost.

use std::time::Instant;

use super::TrackerSettings;
use super::eye::wrong_size;
use super::nanoseconds;
use super::update::{CameraUpdate, TagOwners};
use crate::camera::Camera;
use crate::detect::{Detector, DetectorError, Search};
use crate::image::GrayImage;
use crate::rig::Rig;
use crate::shells::ShellSet;

/// Searches whole images of one camera. Slow: a live station runs it beside the eyes.
#[derive(Debug)]
pub struct Scout {
    index: usize,
    camera: Camera,
    decimate: f32,
    detector: Detector,
    owners: TagOwners,
}

impl Scout {
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
            decimate: settings.full_decimate,
            detector: Detector::new(&owners.ids())?,
            owners,
        })
    }

    /// All tags of shells in an image.
    pub fn search(&mut self, image: &GrayImage, capture_ns: u64) -> CameraUpdate {
        if let Some(problem) = wrong_size(image, &self.camera) {
            return CameraUpdate::unusable(self.index, capture_ns, problem);
        }
        let begun = Instant::now();
        let found = self.detector.detect(image, Search::Full { decimate: self.decimate });
        CameraUpdate {
            tags: self.owners.assign(found),
            searched_whole: true,
            detect_ns: nanoseconds(begun.elapsed()),
            ..CameraUpdate::nothing(self.index, capture_ns)
        }
    }
}
