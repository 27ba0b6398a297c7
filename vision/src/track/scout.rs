//! The search of images by the library: whole ones for what is lost, regions for what is not where it was expected.

use std::time::Instant;

use super::TrackerSettings;
use super::eye::{Eye, wrong_size};
use super::nanoseconds;
use super::update::{CameraUpdate, TagOwners};
use crate::camera::Camera;
use crate::detect::{Detector, DetectorError, Region, Search};
use crate::image::GrayImage;
use crate::rig::Rig;
use crate::shells::ShellSet;

/// Searches images of one camera. Slow: a live station runs it beside the eyes.
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

    /// Adds to what an eye has read what a search of the same image, or of a region of it, finds; the eye sharpens it.
    pub fn add_to(
        &mut self,
        update: &mut CameraUpdate,
        eye: &mut Eye,
        image: &GrayImage,
        region: Option<Region>,
    ) {
        let mut found = self.search(image, update.capture_ns, region);
        found.tags.retain(|seen| !update.has_tag(seen.detection.id));
        for seen in &mut found.tags {
            // A tag that cannot be sharpened keeps the corners that the search has given it.
            let _ = eye.sharpen(image, &mut seen.detection);
        }
        update.add(found);
    }

    /// All tags of shells in an image, or in a region of it.
    pub fn search(&mut self, image: &GrayImage, capture_ns: u64, region: Option<Region>) -> CameraUpdate {
        if let Some(problem) = wrong_size(image, &self.camera) {
            return CameraUpdate::unusable(self.index, capture_ns, problem);
        }
        let begun = Instant::now();
        let found = match &region {
            Some(region) => self.detector.detect(image, Search::Regions(std::slice::from_ref(region))),
            None => self.detector.detect(image, Search::Full { decimate: self.decimate }),
        };
        CameraUpdate {
            tags: self.owners.assign(found),
            searched: region.iter().map(|region| region.rect).collect(),
            searched_whole: region.is_none(),
            detect_ns: nanoseconds(begun.elapsed()),
            ..CameraUpdate::nothing(self.index, capture_ns)
        }
    }
}
