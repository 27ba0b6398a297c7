//! One camera's view of what is already followed: tags are read where they are expected.
//!
//! What is not where it should be is left to a [`super::Scout`], which searches a region round its shell by the
//! library: at most one region an image and the cameras in turn, so that a hidden shell costs little.

use std::time::Instant;

use nalgebra::{Matrix3, Vector2};

use super::filter::Motion;
use super::fusion::Motions;
use super::plan::{self, Expected};
use super::update::{CameraUpdate, MissedTag, SeenTag, TagOwners};
use super::{TrackerSettings, nanoseconds};
use crate::camera::Camera;
use crate::detect::expected::{Expectation, Reader, Reading};
use crate::detect::{Detection, Region};
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
    reader: Reader,
    /// Memory for the motions at an image's time, and for the tags of one shell.
    motions: Vec<Option<Motion>>,
    expected: Vec<Expected>,
    /// Tags that one image has shown, and missed, at most.
    most_tags: usize,
    most_missed: usize,
    /// Counts images: in every so many it is this camera's turn to have a region searched.
    images: usize,
    cameras: usize,
    wanted: Option<Region>,
}

impl Eye {
    /// For the camera of this index.
    pub fn new(rig: &Rig, index: usize, shells: &ShellSet, settings: &TrackerSettings) -> Self {
        Self {
            index,
            camera: rig.cameras[index].clone(),
            shells: shells.clone(),
            settings: settings.clone(),
            reader: Reader::new(&rig.cameras[index], &TagOwners::new(shells).ids()),
            motions: Vec::new(),
            expected: Vec::new(),
            most_tags: 0,
            most_missed: 0,
            images: index,
            cameras: rig.cameras.len(),
            wanted: None,
        }
    }

    /// Reads what is expected in an image; `motions` are the newest that are known.
    pub fn look(&mut self, image: &GrayImage, capture_ns: u64, motions: &Motions) -> CameraUpdate {
        if let Some(problem) = wrong_size(image, &self.camera) {
            return CameraUpdate::unusable(self.index, capture_ns, problem);
        }
        let begun = Instant::now();
        self.wanted = None;
        self.images += 1;
        let my_turn = self.images.is_multiple_of(self.cameras);
        let newest = motions;
        let mut motions = std::mem::take(&mut self.motions);
        newest.expect_at(capture_ns, &self.settings, &mut motions);
        let mut update = CameraUpdate::nothing(self.index, capture_ns);
        // At once, so that nothing has to be copied from one place to another while it grows.
        update.tags.reserve(self.most_tags);
        update.missed.reserve(self.most_missed);
        let mut sought: Option<Region> = None;
        for (shell, motion) in motions.iter().enumerate() {
            match motion {
                Some(motion) => {
                    if self.read_shell(image, shell, motion, &mut update) || !my_turn {
                        continue;
                    }
                    let region =
                        plan::tags_region(&self.camera, &self.shells.shells[shell], motion, &self.settings);
                    sought = larger(sought, region);
                }
                None if my_turn => {
                    let palm = self.shells.palm_of(shell).and_then(|palm| motions[palm].as_ref());
                    let region = palm.and_then(|palm| plan::thumb_region(&self.camera, palm, &self.settings));
                    sought = larger(sought, region);
                }
                None => {}
            }
        }
        self.wanted = sought;
        self.motions = motions;
        self.most_tags = self.most_tags.max(update.tags.len());
        self.most_missed = self.most_missed.max(update.missed.len());
        update.detect_ns = nanoseconds(begun.elapsed());
        update
    }

    /// Where in the last image to search for what was not where it was expected.
    pub const fn wanted(&self) -> Option<Region> {
        self.wanted
    }

    /// Sharpens the corners of tags that a search has found in an image of this camera.
    pub fn sharpen(&mut self, image: &GrayImage, detection: &mut Detection) -> bool {
        /// The library is right within a pixel, or wrong altogether.
        const DOUBT_PX: f64 = 1.0;
        let start = Expectation::from_corners(detection.id, &self.camera, &detection.corners_px, DOUBT_PX);
        match start.map(|start| self.reader.read(image, &start)) {
            Some(Ok(reading)) => {
                *detection = reading_as_detection(detection.id, &reading);
                true
            }
            _ => false,
        }
    }

    /// Reads the tags of one shell; whether it is as it should be: any were read, or none expected.
    fn read_shell(
        &mut self,
        image: &GrayImage,
        shell: usize,
        motion: &Motion,
        update: &mut CameraUpdate,
    ) -> bool {
        let mut expected = std::mem::take(&mut self.expected);
        plan::expected_tags(&self.camera, &self.shells.shells[shell], motion, &self.settings, &mut expected);
        // What the first tags have shown holds for the rest: the shell is rigid.
        let mut offset = Offset::default();
        for tag in &expected {
            let expectation = offset.applied(&tag.expectation);
            let id = expectation.id;
            match self.reader.read(image, &expectation) {
                Ok(reading) => {
                    offset.add(&self.camera, tag, &reading);
                    let detection = reading_as_detection(id, &reading);
                    update.tags.push(SeenTag::new(detection, shell, tag.tag));
                }
                Err(refusal) => {
                    update.missed.push(MissedTag { id, shell, corners_px: tag.corners_px, refusal });
                }
            }
        }
        let content = expected.is_empty() || offset.count > 0.0;
        self.expected = expected;
        content
    }
}

/// How far, in the ideal image, tags of a shell lie from where they were expected.
#[derive(Debug, Default)]
struct Offset {
    sum: Vector2<f64>,
    count: f64,
}

impl Offset {
    /// What is left of the doubt once tags of the same shell have been read, pixels.
    const LEFT_PX: f64 = 2.0;

    fn add(&mut self, camera: &Camera, tag: &Expected, reading: &Reading) {
        let middle = |corners: &[nalgebra::Point2<f64>; 4]| {
            nalgebra::Point2::from((corners[0].coords + corners[2].coords) / 2.0)
        };
        let (found, expected) = (middle(&reading.corners_px), middle(&tag.corners_px));
        self.sum += camera.unproject(&found).xy() - camera.unproject(&expected).xy();
        self.count += 1.0;
    }

    fn applied(&self, expectation: &Expectation) -> Expectation {
        if self.count == 0.0 {
            return *expectation;
        }
        let shift = Matrix3::new_translation(&(self.sum / self.count));
        Expectation {
            ideal_from_cells: shift * expectation.ideal_from_cells,
            doubt_px: expectation.doubt_px.min(Self::LEFT_PX),
            ..*expectation
        }
    }
}

fn reading_as_detection(id: u32, reading: &Reading) -> Detection {
    Detection {
        id,
        hamming: reading.wrong_cells,
        margin: 0.5 * reading.contrast,
        corners_px: reading.corners_px,
        decimate: 1.0,
        covariance_px2: Some(reading.covariance_px2),
    }
}

fn larger(one: Option<Region>, other: Option<Region>) -> Option<Region> {
    match (one, other) {
        (Some(a), Some(b)) => Some(if b.rect.area() > a.rect.area() { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// What to say of an image that does not have the rig's size.
pub(super) fn wrong_size(image: &GrayImage, camera: &Camera) -> Option<String> {
    let (width, height) = (image.width(), image.height());
    ((width, height) != (camera.width, camera.height)).then(|| {
        format!("the image has {width}x{height} pixels, the rig file says {}x{}", camera.width, camera.height)
    })
}
