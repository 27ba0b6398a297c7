//! Reads tags where they are expected: no search for quadrilaterals, no decoding of unknown codes.
//!
//! ```text
//!  expected homography ──► align ──────► fit ──────────► check ────────► Reading
//!  (from a predicted       the tag's     some pixels,    do all cells    corners and
//!   pose, or corners       own pattern,  then more close have the right  their covariance
//!   found by a search)     shifted       to its edges    colour?
//! ```
//!
//! What does not look like the tag is refused with the reason, and left to the search by the library.
//! Corners follow [`super`]'s convention; the fit itself, and why it is right within a hundredth of a pixel, is
//! in [`fit`].

mod align;
mod bend;
mod fit;
mod pattern;
mod places;
mod rays;
mod sample;
mod view;

use std::collections::BTreeMap;

use nalgebra::{Matrix2, Matrix3, Point2, SMatrix, Vector2, Vector3};

use super::CornerCovariance;
use crate::camera::Camera;
use crate::image::GrayImage;
use align::Cells;
use fit::{Appearance, Closeness, Fit, Samples, Smear};
use pattern::{CORNERS, MIDDLE, Pattern};
use rays::RayGrid;
use sample::{Choice, Picked, Scene};
use view::{View, Way};

/// Where a tag is expected.
#[derive(Debug, Clone, Copy)]
pub struct Expectation {
    /// Its number within the family.
    pub id: u32,
    /// Homography from cell coordinates (see [`Expectation::from_pose`]) to the ideal image (x/z, y/z).
    pub ideal_from_cells: Matrix3<f64>,
    /// How it moves: what the ideal image shows at (x, y) moves as M (x, y, 1) does, a second later; zero at rest.
    pub ideal_rate: Matrix3<f64>,
    /// How far off it may be, pixels.
    pub doubt_px: f64,
}

/// A tag that was read.
#[derive(Debug, Clone)]
pub struct Reading {
    /// Corners: bottom left, bottom right, top right, top left of the printed tag.
    pub corners_px: [Point2<f64>; 4],
    /// How sure they are, by the noise of this very tag.
    pub covariance_px2: CornerCovariance,
    /// White above black, grey levels.
    pub contrast: f64,
    /// Standard deviation of what the fit leaves, grey levels.
    pub noise: f64,
    /// Standard deviation of the blur along the tag's sides, pixels.
    pub blur_px: [f64; 2],
    /// Cells that have the wrong colour.
    pub wrong_cells: u32,
}

/// Why a tag was not read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// The family has no such tag, or this reader does not know it.
    #[error("the tag is not known")]
    Unknown,
    /// It lies not wholly inside the image, or behind the camera.
    #[error("the tag is not wholly inside the image")]
    Outside,
    /// Its cells would be smaller than can be told apart.
    #[error("the tag is too small to be read")]
    Small,
    /// What is there has the wrong cells: something covers it, or it is not there.
    #[error("the cells are not those of the tag")]
    Cells,
    /// Too little difference between black and white.
    #[error("too little contrast")]
    Contrast,
    /// The picture of the tag cannot be brought into line with the image.
    #[error("the picture of the tag does not fit")]
    Misfit,
}

/// White above black at least, grey levels.
const LEAST_CONTRAST: f64 = 16.0;
/// Residuals beyond this share of the contrast are no tag. Noise of 1 %, uneven light and print add to 5.
const MOST_RESIDUAL: f64 = 0.15;
/// How far the fit may move the aligned tag, in cells: the rest is another tag or none.
const FARTHEST_CELLS: f64 = 1.0;
/// Half-width of the blur to begin with, pixels: a lens of σ = 0.7 px and the pixel itself, σ = 0.29 px.
const START_BLUR_PX: f64 = 2.27;
/// The kernel's half-width in standard deviations.
const BLUR_SIGMAS: f64 = 3.0;
/// First a few pixels farther from the edges, since these may be off by a pixel,
const COARSE: Choice = Choice { stride: 3, blur_share: 0.4, spare_px: 0.7, turns: 1 };
/// until the rest is small beside the blur;
const COARSELY: Closeness = Closeness { most_steps: 6, settled_px: 0.8 };
/// then more of them close to the edges, where the grey level changes most. Corners do not change by a thousandth of
/// a pixel if steps are made until they are ten times as small.
const FINE: Choice = Choice { stride: 1, blur_share: 0.3, spare_px: 0.0, turns: 1 };
const FINELY: Closeness = Closeness { most_steps: 5, settled_px: 0.2 };
/// Where motion smears the edges each pixel says less of them, and the kernel is another: more are taken, up to so many
/// times, and from as far as the blur reaches.
const MOST_TURNS: f64 = 4.0;

/// Motions during the exposure that seem to be shorter are taken for more of the lens's blur, which costs less.
const LEAST_SMEAR_PX: f64 = 1.8;
/// The length of longer ones is looked at until it grows by no more than this,
const SETTLED_SMEAR_PX: f64 = 0.3;
/// or so many times.
const SMEAR_ROUNDS: usize = 5;

/// Reads expected tags in the images of one camera. One for each thread.
#[derive(Debug)]
pub struct Reader {
    camera: Camera,
    rays: RayGrid,
    patterns: BTreeMap<u32, Pattern>,
    picked: Picked,
    samples: Samples,
}

impl Expectation {
    /// Where a tag is seen: `camera_from_tag` in the tag's frame of [`crate::shells`].
    pub fn from_pose(
        id: u32,
        camera_from_tag: &nalgebra::Isometry3<f64>,
        size_m: f64,
        doubt_px: f64,
    ) -> Self {
        let cell_m = size_m / 8.0;
        let rotation = camera_from_tag.rotation.to_rotation_matrix();
        let (x, y) = (rotation.matrix().column(0) * cell_m, rotation.matrix().column(1) * -cell_m);
        let origin = camera_from_tag.translation.vector - (x + y) * MIDDLE;
        Self {
            id,
            ideal_from_cells: Matrix3::from_columns(&[x, y, origin]),
            ideal_rate: Matrix3::zeros(),
            doubt_px,
        }
    }

    /// Where a search has found a tag: its corners as this module reports them.
    pub fn from_corners(
        id: u32,
        camera: &Camera,
        corners_px: &[Point2<f64>; 4],
        doubt_px: f64,
    ) -> Option<Self> {
        let rays = corners_px.map(|corner| camera.unproject(&corner));
        // Eight equations for the eight ratios of the homography's elements.
        let mut matrix = SMatrix::<f64, 8, 8>::zeros();
        let mut right = nalgebra::SVector::<f64, 8>::zeros();
        for (k, ([u, v], ray)) in CORNERS.into_iter().zip(rays).enumerate() {
            for (axis, value) in [ray.x, ray.y].into_iter().enumerate() {
                let at = 2 * k + axis;
                let own = [u, v, 1.0];
                for (i, number) in own.into_iter().enumerate() {
                    matrix[(at, 3 * axis + i)] = number;
                }
                matrix[(at, 6)] = -value * u;
                matrix[(at, 7)] = -value * v;
                right[at] = value;
            }
        }
        let h = matrix.lu().solve(&right)?;
        let ideal_from_cells = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0);
        Some(Self { id, ideal_from_cells, ideal_rate: Matrix3::zeros(), doubt_px })
    }
}

impl Reader {
    /// For a camera, and the tags that it may see.
    pub fn new(camera: &Camera, ids: &[u32]) -> Self {
        Self {
            rays: RayGrid::new(camera),
            camera: camera.clone(),
            patterns: ids.iter().filter_map(|id| Some((*id, Pattern::new(*id)?))).collect(),
            picked: Picked::default(),
            samples: Samples::default(),
        }
    }

    /// Reads one tag.
    pub fn read(&mut self, image: &GrayImage, expectation: &Expectation) -> Result<Reading, Refusal> {
        let Self { camera, rays, patterns, picked, samples } = self;
        let pattern = patterns.get(&expectation.id).ok_or(Refusal::Unknown)?;
        let view = View::new(camera, expectation)?;
        let mut desk = Desk { camera, rays, picked, samples, image, pattern };
        let here = Cells::read(image, pattern, &view);
        if align::is_aligned(image, pattern, &view, &here)
            && let Ok(reading) = desk.read(&view, &here)
        {
            return Ok(reading);
        }
        let shift_px = align::search(image, pattern, &view, expectation.doubt_px);
        let view = view.shifted(camera, shift_px)?;
        let there = Cells::read(image, pattern, &view);
        align::check_at_first(&there)?;
        desk.read(&view, &there)
    }
}

/// One tag's image, and what it is read with.
struct Desk<'a> {
    camera: &'a Camera,
    rays: &'a RayGrid,
    picked: &'a mut Picked,
    samples: &'a mut Samples,
    image: &'a GrayImage,
    pattern: &'a Pattern,
}

impl Desk<'_> {
    /// Reads a tag that is aligned.
    fn read(&mut self, view: &View, cells: &Cells) -> Result<Reading, Refusal> {
        let start = Appearance {
            cells_from_local: view.cells_from_local,
            black: cells.black,
            contrast: cells.contrast(),
            blur_cells: view.cells_per_px.map(|cells| START_BLUR_PX * cells),
            correlation: view.correlation,
            smear: Smear::NONE,
        };
        let mut scene = view.scene(self.image, self.pattern);
        sample::pick(&scene, self.rays, &start, &COARSE, self.picked, self.samples);
        let coarse =
            self.samples.fit(self.pattern, &start, &start, &COARSELY).ok_or(Refusal::Misfit)?.appearance;
        let local_from_cells = Matrix3::from_row_slice(&coarse.cells_from_local).try_inverse();
        scene.places = view.local.places(&local_from_cells.ok_or(Refusal::Misfit)?);
        let fit = match view.way {
            Some(way) => self.fit_moving(&scene, &start, &coarse, &way)?,
            None => self.fit_closely(&scene, &start, &coarse)?,
        };
        self.judge(view, &fit)
    }

    /// Fits a tag that may have moved far while it was exposed.
    fn fit_moving(
        &mut self,
        scene: &Scene<'_>,
        known: &Appearance,
        coarse: &Appearance,
        way: &Way,
    ) -> Result<Fit, Refusal> {
        let mut begin = *coarse;
        let mut fitted = None;
        // A bell is not what a motion leaves, and says less than its length: what is left over says more, each time.
        for _ in 0..SMEAR_ROUNDS {
            let length_px = begin.smear_px(known, way.cells_per_px);
            if length_px < LEAST_SMEAR_PX || length_px - begin.smear.length_px < SETTLED_SMEAR_PX {
                break;
            }
            let smear = Smear { local: way.local_per_px.map(|share| share * length_px), length_px };
            let fit =
                self.fit_closely(scene, known, &Appearance { smear, blur_cells: known.blur_cells, ..begin })?;
            begin = fit.appearance;
            fitted = Some(fit);
        }
        fitted.map_or_else(|| self.fit_closely(scene, known, coarse), Ok)
    }

    /// Fits with pixels close to the edges.
    fn fit_closely(
        &mut self,
        scene: &Scene<'_>,
        known: &Appearance,
        begin: &Appearance,
    ) -> Result<Fit, Refusal> {
        let smeared = begin.blur_over(known).max(1.0);
        let moved = begin.smear.length_px / (2.0 * START_BLUR_PX);
        let fine = Choice {
            blur_share: (FINE.blur_share * smeared * smeared).min(1.0),
            turns: (smeared + moved).min(MOST_TURNS).round() as usize,
            ..FINE
        };
        sample::pick(scene, self.rays, begin, &fine, self.picked, self.samples);
        // Where the kernel is another, steps promise more than they keep: the last must be short.
        let closely = Closeness { settled_px: FINELY.settled_px / (smeared * smeared), ..FINELY };
        self.samples.fit(self.pattern, begin, known, &closely).ok_or(Refusal::Misfit)
    }

    /// Whether what was fitted is the tag, and where its corners are.
    fn judge(&self, view: &View, fit: &Fit) -> Result<Reading, Refusal> {
        let appearance = &fit.appearance;
        if appearance.contrast < LEAST_CONTRAST {
            return Err(Refusal::Contrast);
        }
        if fit.noise > MOST_RESIDUAL * appearance.contrast {
            return Err(Refusal::Misfit);
        }
        let fitted = view.fitted(self.camera, &appearance.cells_from_local)?;
        let moved_px = (fitted.middle_px - view.middle_px).norm();
        if moved_px * view.cells_per_px[0].max(view.cells_per_px[1]) > FARTHEST_CELLS {
            return Err(Refusal::Misfit);
        }
        let wrong_cells = Cells::read(self.image, self.pattern, &fitted).checked()?;
        let (corners_px, covariance_px2) = corners(self.camera, view, fit).ok_or(Refusal::Misfit)?;
        let sigma_px = |axis: usize| appearance.blur_cells[axis] / view.cells_per_px[axis] / BLUR_SIGMAS;
        Ok(Reading {
            corners_px,
            covariance_px2,
            contrast: appearance.contrast,
            noise: fit.noise,
            blur_px: [sigma_px(0), sigma_px(1)],
            wrong_cells,
        })
    }
}

/// Corners in pixels and their covariance, from the fitted homography.
fn corners(camera: &Camera, view: &View, fit: &Fit) -> Option<([Point2<f64>; 4], CornerCovariance)> {
    let g = &fit.appearance.cells_from_local;
    let local_from_cells = Matrix3::from_row_slice(g).try_inverse()?;
    let mut corners_px = [Point2::origin(); 4];
    let mut by_g = [[0.0; 8]; 8];
    for (k, [u, v]) in CORNERS.into_iter().enumerate() {
        let p = local_from_cells * Vector3::new(u, v, 1.0);
        let (x, y) = (p.x / p.z, p.y / p.z);
        let w = g[6] * x + g[7] * y + g[8];
        // d(u, v) / d(x, y), and d(u, v) / dG = (x, y, 1) for u and for v, −u (x, y) and −v (x, y) for the last two: a
        // change of G is made good by moving (x, y).
        let by_local = Matrix2::new(g[0] - u * g[6], g[1] - u * g[7], g[3] - v * g[6], g[4] - v * g[7]) / w;
        let ideal = view.local.origin + view.bend.bent(Vector2::new(x, y)) * view.local.unit;
        let (pixel, by_ideal) = camera.pixel_of_ideal_with_jacobian(ideal);
        corners_px[k] = pixel;
        let by_cells = by_ideal * (-view.local.unit / w) * by_local.try_inverse()?;
        for axis in 0..2 {
            let (by_u, by_v) = (by_cells[(axis, 0)], by_cells[(axis, 1)]);
            let by_w = -u * by_u - v * by_v;
            let of_g = [by_u * x, by_u * y, by_u, by_v * x, by_v * y, by_v, by_w * x, by_w * y];
            for (row, value) in by_g.iter_mut().zip(of_g) {
                row[2 * k + axis] = value;
            }
        }
    }
    let covariance = fit.covariance(&by_g);
    let covariance = CornerCovariance::from_fn(|i, j| covariance[i][j]);
    let sane = corners_px.iter().all(|corner| corner.coords.iter().all(|c| c.is_finite()))
        && covariance.iter().all(|number| number.is_finite());
    sane.then_some((corners_px, covariance))
}

#[cfg(test)]
mod tests;
