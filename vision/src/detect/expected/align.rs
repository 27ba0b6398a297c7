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
    let cell_px = view.side_px / 8.0;
    let mut step_px = FIRST_STEP * cell_px;
    // As wide as the doubt asks for to begin with, then the neighbours of the best alone.
    let mut reach = (doubt_px / step_px).ceil().clamp(1.0, FARTHEST / FIRST_STEP) as i32;
    let mut shift_px = Vector2::zeros();
    let (mut contrast, mut black, mut white);
    loop {
        let aside_px = (ASIDE * cell_px).min((ASIDE_OF_STEP * step_px).max(LEAST_ASIDE_PX));
        let probes = Probes::new(pattern, view, aside_px / cell_px);
        let center = shift_px;
        (contrast, black, white) = probes.contrast(image, center);
        for i in -reach..=reach {
            for j in -reach..=reach {
                let shift = center + Vector2::new(f64::from(i), f64::from(j)) * step_px;
                let found = probes.contrast(image, shift);
                if found.0 > contrast {
                    (contrast, black, white) = found;
                    shift_px = shift;
                }
            }
        }
        if step_px < LAST_STEP_PX {
            break;
        }
        reach = 1;
        step_px *= 0.5;
    }
    if contrast < LEAST_CONTRAST {
        return Err(Refusal::Contrast);
    }
    let wrong = wrong_cells_at(image, pattern, view, shift_px, 0.5 * (black + white));
    if wrong > MOST_WRONG_CELLS_AT_FIRST {
        return Err(Refusal::Cells);
    }
    Ok(Aligned { shift_px, black, white })
}

/// Cells of the black square whose middle has the wrong colour.
pub fn wrong_cells(image: &GrayImage, pattern: &Pattern, view: &View, threshold: f64) -> u32 {
    wrong_cells_at(image, pattern, view, Vector2::zeros(), threshold)
}

fn wrong_cells_at(
    image: &GrayImage,
    pattern: &Pattern,
    view: &View,
    shift_px: Vector2<f64>,
    threshold: f64,
) -> u32 {
    let mut wrong = 0;
    for row in 1..CELLS - 1 {
        for column in 1..CELLS - 1 {
            let place = view.rough_px(column as f64 + 0.5, row as f64 + 0.5) + shift_px;
            let bright = grey(image, &place) > threshold;
            wrong += u32::from(bright != pattern.is_white(column, row));
        }
    }
    wrong
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
                let [_, right, _, below] = pattern.steps(Pattern::place(column, row));
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

    /// White above black, and both.
    fn contrast(&self, image: &GrayImage, shift_px: Vector2<f64>) -> (f64, f64, f64) {
        let shift: Vector2<f32> = shift_px.cast();
        let sum = |places: &[Point2<f32>]| -> u32 {
            places.iter().map(|place| u32::from(nearest(image, place.x + shift.x, place.y + shift.y))).sum()
        };
        let count = self.count.max(1) as f64;
        let white = f64::from(sum(&self.white[..self.count])) / count;
        let black = f64::from(sum(&self.black[..self.count])) / count;
        (white - black, black, white)
    }
}

fn grey(image: &GrayImage, place: &Point2<f64>) -> f64 {
    f64::from(nearest(image, place.x as f32, place.y as f32))
}

/// The nearest pixel; outside the image its border.
#[inline]
fn nearest(image: &GrayImage, x: f32, y: f32) -> u8 {
    // Casts of negative numbers saturate at zero.
    let x = ((x + 0.5) as usize).min(image.width() as usize - 1);
    let y = ((y + 0.5) as usize).min(image.height() as usize - 1);
    image.data()[y * image.width() as usize + x]
}
