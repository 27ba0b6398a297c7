//! From recordings and pictures to observations: our own detector, over all images at once.

use std::path::Path;

use locoman_vision::detect::{CornerCovariance, Detection, Detector, DetectorError, Search};
use locoman_vision::image::{Frame, GrayImage};
use locoman_vision::pose::Observation;
use locoman_vision::rig::Rig;
use locoman_vision::shells::Shell;
use locoman_vision::source::{FrameSource, SourceError, open_recording};
use locoman_vision::track::TrackerSettings;
use nalgebra::{Point2, Vector2};
use rayon::prelude::*;

use crate::bundle::Sighting;
use crate::intrinsics::{IntrinsicsError, PartView, View};

/// What cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadingError {
    /// The recording.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The detector.
    #[error(transparent)]
    Detector(#[from] DetectorError),
}

/// What lens, print and light leave in every corner, pixels per axis.
const FLOOR_PX: f64 = 0.03;
/// Images are searched at every other pixel; corners are fitted at full resolution all the same.
const DECIMATE: f32 = 2.0;

/// What was seen in one image.
#[derive(Debug, Clone)]
pub struct Seen {
    /// Index into the rig's cameras.
    pub camera: usize,
    /// Its capture time.
    pub capture_ns: u64,
    /// Tags of the body.
    pub observations: Vec<Observation>,
    /// Median width of the edges of its tags, pixels; `None` without tags.
    pub blur_px: Option<f64>,
}

/// Every `stride`th image of each camera of a recording; `progress` hears the number of images.
pub fn read_recording(
    path: &Path,
    rig: &Rig,
    body: &Shell,
    stride: usize,
    progress: &mut dyn FnMut(usize),
) -> Result<Vec<Seen>, ReadingError> {
    /// Images that are held at once.
    const BATCH: usize = 32;
    let mut source = open_recording(path, rig)?;
    let mut counts = vec![0_usize; rig.cameras.len()];
    let (mut seen, mut done) = (Vec::new(), 0);
    loop {
        let mut frames: Vec<Frame> = Vec::with_capacity(BATCH);
        while frames.len() < BATCH {
            let Some(frame) = source.next_frame()? else { break };
            let count = &mut counts[frame.camera];
            *count += 1;
            if (*count - 1).is_multiple_of(stride.max(1)) {
                frames.push(frame);
            }
        }
        if frames.is_empty() {
            return Ok(seen);
        }
        done += frames.len();
        let read: Result<Vec<Option<Seen>>, DetectorError> = frames
            .par_iter()
            .map_init(
                || Eye::new(body),
                |eye, frame| {
                    eye.as_mut().map_or_else(|_| Eye::new(body).map(|_| None), |eye| Ok(eye.frame(frame)))
                },
            )
            .collect();
        seen.extend(read?.into_iter().flatten());
        progress(done);
    }
}

/// The observations of all images.
pub fn observations(seen: &[Seen]) -> Vec<Observation> {
    seen.iter().flat_map(|image| image.observations.iter().cloned()).collect()
}

/// The images of one camera as views of a flat target.
pub fn views(seen: &[Seen], camera: usize) -> Vec<View> {
    let own = seen.iter().filter(|image| image.camera == camera && !image.observations.is_empty());
    own.map(|image| view(image, format!("{:.3} s", image.capture_ns as f64 * 1e-9))).collect()
}

fn view(image: &Seen, name: String) -> View {
    let parts = image.observations.iter().filter_map(|o| Sighting::of_tag(o, 0, 0)).map(|sighting| {
        PartView { part: sighting.part, points_px: sighting.points_px, whitening: sighting.whitening }
    });
    View { name, parts: parts.collect(), blur_px: image.blur_px }
}

/// The board in single pictures; what stands in the way, if it is in none.
pub fn read_pictures(pictures: &[(String, GrayImage)], body: &Shell) -> Result<Vec<View>, PicturesError> {
    let read: Result<Vec<Seen>, DetectorError> =
        pictures.par_iter().map(|(_, image)| Ok(Eye::new(body)?.image(0, 0, image))).collect();
    let read = read?;
    if read.iter().all(|image| image.observations.is_empty()) {
        return Err(nothing_found(pictures, body)?.into());
    }
    Ok(read.iter().zip(pictures).map(|(seen, (name, _))| view(seen, name.clone())).collect())
}

/// Pictures without a board.
#[derive(Debug, thiserror::Error)]
pub enum PicturesError {
    /// The detector.
    #[error(transparent)]
    Detector(#[from] DetectorError),
    /// What is wrong with them.
    #[error(transparent)]
    Intrinsics(#[from] IntrinsicsError),
}

/// Looks again into the mirror: a board that is printed mirrored is not read otherwise.
fn nothing_found(pictures: &[(String, GrayImage)], body: &Shell) -> Result<IntrinsicsError, DetectorError> {
    /// Pictures that are looked at again.
    const MOST: usize = 20;
    let mut eye = Eye::new(body)?;
    let mirrored = pictures.iter().take(MOST).filter_map(|(_, image)| mirrored(image));
    let found: usize = mirrored.map(|image| eye.image(0, 0, &image).observations.len()).sum();
    let images = pictures.len();
    if found > 0 {
        return Ok(IntrinsicsError::Mirrored { found, images: images.min(MOST) });
    }
    let ids = || body.tags.iter().map(|tag| tag.id);
    Ok(IntrinsicsError::Nothing { images, first: ids().min().unwrap_or(0), last: ids().max().unwrap_or(0) })
}

fn mirrored(image: &GrayImage) -> Option<GrayImage> {
    let rows = (0..image.height()).flat_map(|y| image.row(y).iter().rev().copied());
    GrayImage::new(image.width(), image.height(), rows.collect()).ok()
}

struct Eye<'a> {
    detector: Detector,
    settings: TrackerSettings,
    body: &'a Shell,
}

impl<'a> Eye<'a> {
    fn new(body: &'a Shell) -> Result<Self, DetectorError> {
        let ids: Vec<u32> = body.tags.iter().map(|tag| tag.id).collect();
        Ok(Self { detector: Detector::new(&ids)?, settings: TrackerSettings::default(), body })
    }

    /// `None` of an image that cannot be decoded: it is told of and left out.
    fn frame(&mut self, frame: &Frame) -> Option<Seen> {
        match frame.pixels.to_gray() {
            Ok(image) => Some(self.image(frame.camera, frame.capture_ns, &image)),
            Err(error) => {
                tracing::warn!(camera = frame.camera, time_ns = frame.capture_ns, %error, "an image was left out");
                None
            }
        }
    }

    fn image(&mut self, camera: usize, capture_ns: u64, image: &GrayImage) -> Seen {
        let found = self.detector.detect(image, Search::Full { decimate: DECIMATE });
        let mut blurs: Vec<f64> = found.iter().filter_map(|tag| edge_width_px(image, tag)).collect();
        blurs.sort_by(f64::total_cmp);
        let observation = |detection: &Detection| {
            let tag = self.body.tags.iter().position(|tag| tag.id == detection.id)?;
            let floor = CornerCovariance::from_diagonal_element(FLOOR_PX * FLOOR_PX);
            Some(Observation {
                camera,
                tag,
                capture_ns,
                corners_px: detection.corners_px,
                covariance_px2: self.settings.corner_covariance_px2(detection) + floor,
            })
        };
        let observations = found.iter().filter_map(observation).collect();
        Seen { camera, capture_ns, observations, blur_px: blurs.get(blurs.len() / 2).copied() }
    }
}

/// How many pixels the outer edges of a tag take from dark to light: contrast over the steepest slope, median of four.
fn edge_width_px(image: &GrayImage, tag: &Detection) -> Option<f64> {
    /// Reach of a profile to both sides, pixels; and samples a pixel.
    const REACH_PX: f64 = 5.0;
    const FINE: f64 = 2.0;
    let corners = &tag.corners_px;
    let center = corners.iter().map(|corner| corner.coords).sum::<Vector2<f64>>() / 4.0;
    let mut widths = Vec::with_capacity(4);
    for k in 0..4 {
        let middle = nalgebra::center(&corners[k], &corners[(k + 1) % 4]);
        let outwards = (middle.coords - center).normalize();
        let steps = (2.0 * REACH_PX * FINE) as i32;
        let at = |step: i32| sample(image, &(middle + outwards * (f64::from(step) / FINE - REACH_PX)));
        let profile: Option<Vec<f64>> = (0..=steps).map(at).collect();
        let Some(profile) = profile else { continue };
        let (low, high) = profile.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
        let slope = profile.windows(2).map(|pair| (pair[1] - pair[0]) * FINE).fold(0.0, f64::max);
        if slope > 0.0 {
            widths.push((high - low) / slope);
        }
    }
    widths.sort_by(f64::total_cmp);
    widths.get(widths.len() / 2).copied()
}

fn sample(image: &GrayImage, at: &Point2<f64>) -> Option<f64> {
    let inside = at.x >= 0.0 && at.y >= 0.0;
    let (x, y) = (at.x.floor(), at.y.floor());
    let (column, row) = (x as u32, y as u32);
    if !inside || column + 1 >= image.width() || row + 1 >= image.height() {
        return None;
    }
    let (u, v) = (at.x - x, at.y - y);
    let value = |dy: u32, dx: usize| f64::from(image.row(row + dy)[column as usize + dx]);
    let above = value(0, 0) * (1.0 - u) + value(0, 1) * u;
    let below = value(1, 0) * (1.0 - u) + value(1, 1) * u;
    Some(above * (1.0 - v) + below * v)
}

#[cfg(test)]
mod tests {
    use locoman_vision::detect::tag_bitmap;

    use super::*;
    use crate::board::Board;

    /// Pixels a cell of a drawn tag.
    const CELL: u32 = 4;

    /// A flat picture of a board, seen straight on.
    fn drawn(board: &Board) -> GrayImage {
        let pitch = 10 * CELL + 8;
        let (width, height) = (board.columns * pitch + 40, board.rows * pitch + 40);
        let mut pixels = vec![255; (width * height) as usize];
        for k in 0..board.columns * board.rows {
            let tag = tag_bitmap(board.first_id + k).expect("a code");
            let (left, top) =
                (20 + k % board.columns * pitch, 20 + (board.rows - 1 - k / board.columns) * pitch);
            for y in 0..10 * CELL {
                for x in 0..10 * CELL {
                    let value = tag.row(y / CELL)[(x / CELL) as usize];
                    pixels[((top + y) * width + left + x) as usize] = value;
                }
            }
        }
        GrayImage::new(width, height, pixels).expect("size")
    }

    #[test]
    fn a_board_is_read_and_a_mirrored_print_is_named() {
        let board = Board { columns: 4, rows: 3, first_id: 100, tag_mm: 30.0, gap_mm: 10.0 };
        let (image, body) = (drawn(&board), board.to_shell());
        let views = read_pictures(&[("one".into(), image.clone())], &body).expect("read");
        assert_eq!(views[0].parts.len(), 12);
        assert!(views[0].blur_px.is_some_and(|blur| blur < 3.0), "{:?}", views[0].blur_px);
        let mirrored = mirrored(&image).expect("size");
        let error = read_pictures(&[("one".into(), mirrored)], &body).expect_err("mirrored").to_string();
        assert!(error.contains("mirrored") && error.contains("12 in 1"), "{error}");
        let other = Board { first_id: 300, ..board }.to_shell();
        let error = read_pictures(&[("one".into(), image)], &other).expect_err("others").to_string();
        assert!(error.contains("numbers 300 to 311"), "{error}");
    }
}
