//! Brings an expected tag to where it is, roughly: its own pattern is laid over the image and shifted.
//!
//! Measured is how much brighter the pixels are that should be white than those that should be black, close to
//! both sides of each edge. The shift that makes the most of it is found by halving steps: no derivatives, so
//! that blur and light do not matter.

use nalgebra::Vector2;
use wide::f32x8;

use super::pattern::{BLACK_CELLS, EIGHTS, Pattern};
use super::places::greys;
use super::view::View;
use super::{LEAST_CONTRAST, Refusal};
use crate::image::GrayImage;
use crate::vector::LANES;

/// Cells that may have the wrong colour, of the 64 of the black square: one corrected bit and a speck of dirt.
pub const MOST_WRONG_CELLS: u32 = 2;
/// Before the fit a few more: edges may still be off.
const MOST_WRONG_CELLS_AT_FIRST: u32 = 8;

/// Distance of the probes from an edge at most, cells.
const ASIDE: f64 = 0.3;
/// The finer the step, the closer the probes, but not closer than the blur allows.
const ASIDE_OF_STEP: f64 = 0.75;
const LEAST_ASIDE_PX: f64 = 1.3;
/// Where the edges show this share of the contrast between the cells' middles, the fit needs no search.
const ALIGNED_SHARE: f64 = 0.5;
/// The first step of the search, cells: hardly more than the probes' distance.
const FIRST_STEP: f64 = 0.4;
/// Steps below this end it: the fit takes over from there.
const LAST_STEP_PX: f64 = 1.4;
/// The search goes this far at most, cells: beyond, another part of the pattern may fit as well.
const FARTHEST: f64 = 2.0;
/// Probes are every so many of the pattern's eights of spots.
const STRIDE: usize = 3;

/// The middles of the cells of the black square, in the image.
#[derive(Debug, Clone, Copy)]
pub struct Cells {
    /// Mean grey levels of what should be black and white.
    pub black: f64,
    /// See [`Cells::black`].
    pub white: f64,
    /// Cells on the wrong side of the mean of the two.
    wrong: u32,
}

/// Whether a tag needs no search; refuses nothing yet.
pub fn is_aligned(image: &GrayImage, pattern: &Pattern, view: &View, here: &Cells) -> bool {
    if here.wrong > MOST_WRONG_CELLS || here.contrast() < LEAST_CONTRAST {
        return false;
    }
    let aside = ASIDE.min(LEAST_ASIDE_PX * BLACK_CELLS as f64 / view.side_px);
    let edges = Probes::new(pattern, view, aside).contrast(image, Vector2::zeros());
    edges > ALIGNED_SHARE * here.contrast()
}

/// Refuses what does not have the tag's cells, before the fit.
pub fn check_at_first(there: &Cells) -> Result<(), Refusal> {
    if there.contrast() < LEAST_CONTRAST {
        return Err(Refusal::Contrast);
    }
    if there.wrong > MOST_WRONG_CELLS_AT_FIRST {
        return Err(Refusal::Cells);
    }
    Ok(())
}

/// The shift that makes the most of the edges.
pub fn search(image: &GrayImage, pattern: &Pattern, view: &View, doubt_px: f64) -> Vector2<f64> {
    let cell_px = view.side_px / BLACK_CELLS as f64;
    let mut step_px = FIRST_STEP * cell_px;
    // As wide as the doubt asks for to begin with, then the neighbours of the best alone.
    let mut reach = (doubt_px / step_px).ceil().clamp(1.0, FARTHEST / FIRST_STEP) as i32;
    let mut shift_px = Vector2::zeros();
    loop {
        let aside_px = (ASIDE * cell_px).min((ASIDE_OF_STEP * step_px).max(LEAST_ASIDE_PX));
        let probes = Probes::new(pattern, view, aside_px / cell_px);
        let center = shift_px;
        let mut best = probes.contrast(image, center);
        for i in -reach..=reach {
            for j in -reach..=reach {
                let shift = center + Vector2::new(f64::from(i), f64::from(j)) * step_px;
                let contrast = probes.contrast(image, shift);
                if contrast > best {
                    best = contrast;
                    shift_px = shift;
                }
            }
        }
        if step_px < LAST_STEP_PX {
            return shift_px;
        }
        reach = 1;
        step_px *= 0.5;
    }
}

impl Cells {
    /// Reads them where they are thought to be.
    pub fn read(image: &GrayImage, pattern: &Pattern, view: &View) -> Self {
        let mut levels = [[0_u8; LANES]; BLACK_CELLS];
        let mut sums = [0_u32; 2];
        let mut counts = [0_u32; 2];
        let columns = f32x8::new(std::array::from_fn(|k| k as f32 + 1.5));
        for (row, levels) in levels.iter_mut().enumerate() {
            *levels = greys(image, view.places.pixels(columns, f32x8::splat(row as f32 + 1.5)));
            for (column, level) in levels.iter().enumerate() {
                let white = usize::from(pattern.is_white(column + 1, row + 1));
                sums[white] += u32::from(*level);
                counts[white] += 1;
            }
        }
        let mean = |white: usize| f64::from(sums[white]) / f64::from(counts[white].max(1));
        let (black, white) = (mean(0), mean(1));
        let threshold = (0.5 * (black + white)) as u8;
        let mut wrong = 0;
        for (row, levels) in levels.iter().enumerate() {
            for (column, level) in levels.iter().enumerate() {
                wrong += u32::from((*level > threshold) != pattern.is_white(column + 1, row + 1));
            }
        }
        Self { black, white, wrong }
    }

    /// White above black.
    pub fn contrast(&self) -> f64 {
        self.white - self.black
    }

    /// Refuses what does not have the tag's cells; gives the number of those that are wrong nevertheless.
    pub fn checked(&self) -> Result<u32, Refusal> {
        if self.wrong > MOST_WRONG_CELLS { Err(Refusal::Cells) } else { Ok(self.wrong) }
    }
}

/// Pixels on both sides of the edges.
struct Probes {
    white: [[f32x8; 2]; PROBES],
    black: [[f32x8; 2]; PROBES],
}

/// Eights of probes.
const PROBES: usize = EIGHTS / STRIDE;

impl Probes {
    /// `aside` in cells.
    fn new(pattern: &Pattern, view: &View, aside: f64) -> Self {
        let mut probes = Self { white: [[f32x8::ZERO; 2]; PROBES], black: [[f32x8::ZERO; 2]; PROBES] };
        let aside = f32x8::splat(aside as f32);
        let both = probes.white.iter_mut().zip(&mut probes.black);
        for (spots, (white, black)) in pattern.spots(STRIDE).zip(both) {
            let (u, v) = (f32x8::new(spots.u), f32x8::new(spots.v));
            let (du, dv) = (f32x8::new(spots.normal_u) * aside, f32x8::new(spots.normal_v) * aside);
            *white = view.places.pixels(u + du, v + dv);
            *black = view.places.pixels(u - du, v - dv);
        }
        probes
    }

    /// White above black.
    fn contrast(&self, image: &GrayImage, shift_px: Vector2<f64>) -> f64 {
        let shift = [f32x8::splat(shift_px.x as f32), f32x8::splat(shift_px.y as f32)];
        let mut above = 0;
        for (white, black) in self.white.iter().zip(&self.black) {
            let white = greys(image, [white[0] + shift[0], white[1] + shift[1]]);
            let black = greys(image, [black[0] + shift[0], black[1] + shift[1]]);
            for (white, black) in white.into_iter().zip(black) {
                above += i32::from(white) - i32::from(black);
            }
        }
        f64::from(above) / (PROBES * LANES) as f64
    }
}
