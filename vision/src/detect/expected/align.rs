//! Brings an expected tag to where it is, roughly: its own pattern is laid over the image and shifted.
//!
//! Measured is how much brighter the pixels are that should be white than those that should be black, close to
//! both sides of each edge. The shift that makes the most of it is found by halving steps: no derivatives, so
//! that blur and light do not matter.

use nalgebra::{Point2, Vector2};

use super::pattern::{CELLS, Pattern};
use super::{LEAST_CONTRAST, Refusal, View};
use crate::image::GrayImage;

/// Where a tag was found.
#[derive(Debug, Clone, Copy)]
pub struct Aligned {
    /// From where it was expected.
    pub shift_px: Vector2<f64>,
    /// Mean grey levels of what should be black and white.
    pub black: f64,
    /// See [`Aligned::black`].
    pub white: f64,
}

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
const ALIGNED_SHARE: f64 = 0.7;
/// The first step of the search, cells: hardly more than the probes' distance.
const FIRST_STEP: f64 = 0.4;
/// Steps below this end it: the fit takes over from there.
const LAST_STEP_PX: f64 = 1.4;
/// The search goes this far at most, cells: beyond, another part of the pattern may fit as well.
const FARTHEST: f64 = 2.0;
/// Probes at most: two for each of the edges of a tag's 100 cells.
const MOST_PROBES: usize = 400;

/// Finds the shift; refuses what does not have the tag's cells.
pub fn align(image: &GrayImage, pattern: &Pattern, view: &View, doubt_px: f64) -> Result<Aligned, Refusal> {
    let here = Cells::read(image, pattern, view, Vector2::zeros());
    if here.wrong <= MOST_WRONG_CELLS && here.contrast() >= LEAST_CONTRAST {
        let aside = ASIDE.min(LEAST_ASIDE_PX * 8.0 / view.side_px);
        let edges = Probes::new(pattern, view, aside).contrast(image, Vector2::zeros());
        if edges > ALIGNED_SHARE * here.contrast() {
            return Ok(Aligned { shift_px: Vector2::zeros(), black: here.black, white: here.white });
        }
    }
    let shift_px = search(image, pattern, view, doubt_px);
    let there = Cells::read(image, pattern, view, shift_px);
    if there.contrast() < LEAST_CONTRAST {
        return Err(Refusal::Contrast);
    }
    if there.wrong > MOST_WRONG_CELLS_AT_FIRST {
        return Err(Refusal::Cells);
    }
    Ok(Aligned { shift_px, black: there.black, white: there.white })
}

/// The shift that makes the most of the edges.
fn search(image: &GrayImage, pattern: &Pattern, view: &View, doubt_px: f64) -> Vector2<f64> {
    let cell_px = view.side_px / 8.0;
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

/// Cells of the black square whose middle has the wrong colour.
pub fn wrong_cells(image: &GrayImage, pattern: &Pattern, view: &View) -> u32 {
    Cells::read(image, pattern, view, Vector2::zeros()).wrong
}

/// The middles of the cells of the black square.
struct Cells {
    /// Mean grey levels of what should be black and white.
    black: f64,
    white: f64,
    /// Cells on the wrong side of the mean of the two.
    wrong: u32,
}

impl Cells {
    fn read(image: &GrayImage, pattern: &Pattern, view: &View, shift_px: Vector2<f64>) -> Self {
        const SIDE: usize = CELLS - 2;
        let mut levels = [0_u8; SIDE * SIDE];
        let mut sums = [0_u32; 2];
        let mut counts = [0_u32; 2];
        let cell = |k: usize| (k % SIDE + 1, k / SIDE + 1);
        for (k, level) in levels.iter_mut().enumerate() {
            let (column, row) = cell(k);
            let place = view.rough_px(column as f64 + 0.5, row as f64 + 0.5) + shift_px;
            *level = nearest(image, place.x as f32, place.y as f32);
            let white = usize::from(pattern.is_white(column, row));
            sums[white] += u32::from(*level);
            counts[white] += 1;
        }
        let mean = |white: usize| f64::from(sums[white]) / f64::from(counts[white].max(1));
        let (black, white) = (mean(0), mean(1));
        let threshold = 0.5 * (black + white);
        let is_wrong = |(k, level): (usize, &u8)| {
            let (column, row) = cell(k);
            (f64::from(*level) > threshold) != pattern.is_white(column, row)
        };
        let wrong = levels.iter().enumerate().filter(|cell| is_wrong(*cell)).count();
        Self { black, white, wrong: u32::try_from(wrong).unwrap_or(u32::MAX) }
    }

    fn contrast(&self) -> f64 {
        self.white - self.black
    }
}

/// Pixels on both sides of the edges.
struct Probes {
    white: [Point2<f32>; MOST_PROBES / 2],
    black: [Point2<f32>; MOST_PROBES / 2],
    count: usize,
}

impl Probes {
    /// `aside` in cells.
    fn new(pattern: &Pattern, view: &View, aside: f64) -> Self {
        let mut probes = Self {
            white: [Point2::origin(); MOST_PROBES / 2],
            black: [Point2::origin(); MOST_PROBES / 2],
            count: 0,
        };
        for row in 0..CELLS {
            for column in 0..CELLS {
                let [_, right, _, below] = pattern.steps(column, row);
                let (u, v) = (column as f64, row as f64);
                let white = pattern.is_white(column, row);
                if right && column + 1 < CELLS {
                    probes.add(view, [u + 1.0 - aside, v + 0.5], [u + 1.0 + aside, v + 0.5], white);
                }
                if below && row + 1 < CELLS {
                    probes.add(view, [u + 0.5, v + 1.0 - aside], [u + 0.5, v + 1.0 + aside], white);
                }
            }
        }
        probes
    }

    fn add(&mut self, view: &View, here: [f64; 2], there: [f64; 2], here_is_white: bool) {
        let (white, black) = if here_is_white { (here, there) } else { (there, here) };
        if self.count < MOST_PROBES / 2 {
            self.white[self.count] = view.rough_px(white[0], white[1]).cast();
            self.black[self.count] = view.rough_px(black[0], black[1]).cast();
            self.count += 1;
        }
    }

    /// White above black.
    fn contrast(&self, image: &GrayImage, shift_px: Vector2<f64>) -> f64 {
        let shift: Vector2<f32> = shift_px.cast();
        let sum = |places: &[Point2<f32>]| -> u32 {
            places.iter().map(|place| u32::from(nearest(image, place.x + shift.x, place.y + shift.y))).sum()
        };
        let white = f64::from(sum(&self.white[..self.count]));
        let black = f64::from(sum(&self.black[..self.count]));
        (white - black) / self.count.max(1) as f64
    }
}

/// The nearest pixel; outside the image its border.
#[inline]
fn nearest(image: &GrayImage, x: f32, y: f32) -> u8 {
    // Casts of negative numbers saturate at zero.
    let x = ((x + 0.5) as u32).min(image.width() - 1) as usize;
    let y = ((y + 0.5) as u32).min(image.height() - 1) as usize;
    image.data()[y * image.width() as usize + x]
}
