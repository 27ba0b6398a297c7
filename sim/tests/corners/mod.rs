//! Corners that the detector finds in rendered pictures, beside those of the truth.

#![expect(clippy::expect_used, reason = "helpers of tests: a panic there is the report")]

use locoman_sim::operator::sight::Sighting;
use locoman_sim::operator::studio::Studio;
use locoman_vision::detect::{Detector, Search};
use locoman_vision::image::GrayImage;

/// Tags of at least this size count.
const LEAST_SIDE_PX: f64 = 30.0;

/// What was compared so far.
pub struct Comparison {
    detector: Detector,
    squares_px2: f64,
    /// Coordinates of corners that were found.
    pub coordinates: u32,
    /// Tags that were not found.
    pub missed: u32,
}

impl Comparison {
    /// With the tags of all shells.
    pub fn new(sut: &Studio) -> Self {
        let facets = sut.solids().iter().flat_map(|solid| &solid.facets);
        let ids: Vec<u32> = facets.flat_map(|facet| &facet.tags).map(|tag| tag.id).collect();
        let detector = Detector::new(&ids).expect("ids of the family");
        Self { detector, squares_px2: 0.0, coordinates: 0, missed: 0 }
    }

    /// Takes a picture; the tags in it that count and were found.
    pub fn look(
        &mut self,
        sut: &Studio,
        camera: usize,
        t_s: f64,
        frame: u64,
        counts: impl Fn(&Sighting) -> bool,
    ) -> Vec<Sighting> {
        let picture = sut.picture(camera, t_s, frame);
        let image = GrayImage::new(picture.width, picture.height, picture.grey).expect("size");
        let found = self.detector.detect(&image, Search::Full { decimate: 1.0 });
        let mut sightings = sut.sightings(camera, t_s);
        sightings.retain(|truth| truth.is_readable() && truth.side_px >= LEAST_SIDE_PX && counts(truth));
        let all = sightings.len();
        sightings.retain(|truth| {
            let Some(tag) = found.iter().find(|tag| tag.id == truth.id) else { return false };
            let corners = tag.corners_px.iter().zip(&truth.corners_px);
            self.squares_px2 += corners.map(|(a, b)| (a - b).norm_squared()).sum::<f64>();
            self.coordinates += 8;
            true
        });
        self.missed += (all - sightings.len()) as u32;
        sightings
    }

    /// Error along an axis.
    pub fn rms_px(&self) -> f64 {
        (self.squares_px2 / f64::from(self.coordinates)).sqrt()
    }
}
