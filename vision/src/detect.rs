//! Tags in one image: AprilTag 3 (the bundled C library, one detector a thread) behind a safe face.
//!
//! Convention: corners in pixels of the raw image with pixel centres at integers, as OpenCV has it. The
//! library has them at +0.5; the half pixel is taken off here and nowhere else. Corners come in the order
//! of [`crate::shells::ShellTag::corners`].
//!
//! False tags are kept out by the family (36h11: eleven bits between codes), at most one corrected bit, a
//! least decision margin, and by knowing no code but those of the shells.
//!
//! A tag whose cells are smaller than two pixels is hard to read and its edges are biased by its own inner
//! cells. A region may therefore be searched enlarged twice (`decimate` 0.5).

pub mod expected;
mod ffi;
mod region;

use std::collections::BTreeMap;

use nalgebra::{Point2, SMatrix};

use crate::image::GrayImage;
pub use region::{Rect, Region};

/// Covariance of a tag's corners in px²: x, y of the first, x, y of the second, …
pub type CornerCovariance = SMatrix<f64, 8, 8>;

/// A tag found in an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Its number within the family.
    pub id: u32,
    /// Bits that had to be corrected: 0 or 1.
    pub hamming: u32,
    /// How far, in grey levels, the bits are from undecided.
    pub margin: f64,
    /// Corners: bottom left, bottom right, top right, top left of the printed tag.
    pub corners_px: [Point2<f64>; 4],
    /// The resolution at which it was searched, as [`Region::decimate`].
    pub decimate: f32,
    /// How sure its corners are; `None` where nothing but their number of pixels tells.
    pub covariance_px2: Option<CornerCovariance>,
}

impl Detection {
    /// Length of the shortest side in pixels: what limits how well the tag can be read.
    pub fn shortest_side_px(&self) -> f64 {
        let side = |k: usize| (self.corners_px[(k + 1) % 4] - self.corners_px[k]).norm();
        (0..4).map(side).fold(f64::INFINITY, f64::min)
    }
}

/// Where and how finely to search an image.
#[derive(Debug, Clone, Copy)]
pub enum Search<'a> {
    /// The whole image. `decimate` 2 searches every other pixel in both directions (bits are always read
    /// at full resolution); 1 is the slowest and finds the smallest tags.
    Full {
        /// 1 or more.
        decimate: f32,
    },
    /// Only these regions.
    Regions(&'a [Region]),
}

/// The detector could not be set up.
#[derive(Debug, thiserror::Error)]
pub enum DetectorError {
    /// A code that the family does not have.
    #[error("tag id {0} does not exist in tag36h11 (0 to 586)")]
    UnknownId(u32),
    /// The C library returned nothing: out of memory.
    #[error("the AprilTag library could not allocate a detector")]
    OutOfMemory,
}

/// Least decision margin, grey levels. Tags of shells in fair light have 40 and more; what a textured
/// background yields by chance lies below 10.
const LEAST_MARGIN: f64 = 12.0;
/// Corrected bits that are accepted.
const MAX_HAMMING: u32 = 1;

/// Finds tags. One for each thread.
#[derive(Debug)]
pub struct Detector {
    engine: ffi::Engine,
    scratch: Vec<u8>,
}

impl Detector {
    /// A detector that knows these ids and no other.
    pub fn new(ids: &[u32]) -> Result<Self, DetectorError> {
        Ok(Self { engine: ffi::Engine::new(ids)?, scratch: Vec::new() })
    }

    /// The tags in an image, by rising id, each id once: what is seen twice is taken at the finer
    /// resolution, then with the larger margin.
    pub fn detect(&mut self, image: &GrayImage, search: Search<'_>) -> Vec<Detection> {
        let mut best: BTreeMap<u32, Detection> = BTreeMap::new();
        let mut keep = |found: Detection| {
            let rank = |d: &Detection| (-d.decimate, d.margin);
            match best.get(&found.id) {
                Some(known) if rank(known) >= rank(&found) => {}
                _ => {
                    best.insert(found.id, found);
                }
            }
        };
        match search {
            Search::Full { decimate } => {
                let view = ffi::View::new(image.width(), image.height(), image.data());
                let found = view.map(|view| self.engine.detect(view, decimate)).unwrap_or_default();
                let whole = region::Window { x: 0, y: 0, enlarged: 1.0 };
                found.iter().filter_map(|raw| accept(raw, whole, decimate)).for_each(&mut keep);
            }
            Search::Regions(regions) => {
                for region in regions {
                    let Some((size, window)) = region.extract(image, &mut self.scratch) else {
                        continue;
                    };
                    let Some(view) = ffi::View::new(size.0, size.1, &self.scratch) else { continue };
                    let found = self.engine.detect(view, region.decimate.max(1.0));
                    found.iter().filter_map(|raw| accept(raw, window, region.decimate)).for_each(&mut keep);
                }
            }
        }
        best.into_values().collect()
    }
}

/// The picture of a tag with its white margin, one pixel a cell (10x10), upright.
pub fn tag_bitmap(id: u32) -> Option<GrayImage> {
    ffi::tag_bitmap(id)
}

/// Judges what the library found, and brings its corners into the raw image and our convention.
fn accept(raw: &ffi::Raw, window: region::Window, decimate: f32) -> Option<Detection> {
    let margin = f64::from(raw.margin);
    let good = raw.hamming <= MAX_HAMMING && margin >= LEAST_MARGIN;
    let corners_px = raw.corners.map(|[x, y]| {
        // The library's convention: scaling about the image's outer corner is then exact.
        let x = x / window.enlarged + f64::from(window.x);
        let y = y / window.enlarged + f64::from(window.y);
        Point2::new(x - 0.5, y - 0.5)
    });
    let finite = corners_px.iter().all(|corner| corner.coords.iter().all(|c| c.is_finite()));
    (good && finite).then_some(Detection {
        id: raw.id,
        hamming: raw.hamming,
        margin,
        corners_px,
        decimate,
        covariance_px2: None,
    })
}

#[cfg(test)]
mod tests;
