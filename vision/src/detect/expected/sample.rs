//! Picks the pixels of a tag that say where its edges are.
//!
//! Of a small tag all pixels near an edge are taken; of a larger one an even lattice of them, so that reading a
//! tag takes about the same time whatever its size.

use super::View;
use super::fit::{Appearance, Samples};
use super::pattern::{CELLS, Pattern};
use super::rays::RayGrid;
use crate::image::GrayImage;

/// Pixels that are taken of a tag, about.
const WANTED: f64 = 640.0;
/// Length of the edges of a tag, in sides: 32 cells' sides outside, about 40 inside.
const EDGES: f64 = 9.0;
/// Pixels beside an edge are taken up to this many pixels farther than the blur reaches, for what the alignment
/// left.
const SPARE_PX: f64 = 0.5;
/// Not so close to the end of the white margin, cells: what lies beyond is unknown.
const BORDER: f32 = 0.35;
/// From one row of the lattice to the next, in its steps: near the golden ratio, which spreads evenly.
const SLANT: f64 = 0.382;

/// Collects pixels near the edges.
pub fn collect(
    image: &GrayImage,
    pattern: &Pattern,
    view: &View,
    rays: &RayGrid,
    appearance: &Appearance,
    samples: &mut Samples,
) {
    samples.clear();
    let g = appearance.cells_from_local.map(|value| value as f32);
    let reach = |axis: usize| appearance.blur_cells[axis] + SPARE_PX * view.cells_per_px[axis];
    let (reach_u, reach_v) = (reach(0) as f32, reach(1) as f32);
    let (inv_unit, origin) = ((1.0 / view.unit) as f32, view.origin.cast::<f32>());

    let band_px = 2.0 * reach(0) / view.cells_per_px[0];
    let near_px2 = (EDGES * view.side_px * band_px).min((1.2 * view.side_px).powi(2));
    let step = ((near_px2 / WANTED) as usize).max(1);
    let slant = ((SLANT * step as f64).round() as usize).max(1);

    let outline = Outline::new(view);
    let last = CELLS as f32 - BORDER;
    for y in outline.rows(image.height() as usize) {
        let columns = outline.columns(y, image.width() as usize);
        // The lattice is fixed to the image: which pixels are taken does not depend on the guess.
        let phase = (y * slant) % step;
        let first = columns.start + (step + phase - columns.start % step) % step;
        let pixels = &image.data()[y * image.width() as usize..][..columns.end];
        let line = rays.row(y);
        for (x_px, grey) in pixels.iter().enumerate().skip(first).step_by(step) {
            let ray = line.at(x_px);
            let (x, y) = ((ray[0] - origin.x) * inv_unit, (ray[1] - origin.y) * inv_unit);
            let inv_w = 1.0 / (g[6] * x + g[7] * y + g[8]);
            let u = (g[0] * x + g[1] * y + g[2]) * inv_w;
            let v = (g[3] * x + g[4] * y + g[5]) * inv_w;
            // Casts of negative numbers saturate at zero.
            let (column, row) = ((u as usize).min(CELLS - 1), (v as usize).min(CELLS - 1));
            let (fu, fv) = (u - column as f32, v - row as f32);
            let [left, right, above, below] = pattern.steps(column, row);
            // Without branches: which pixels are near an edge cannot be foreseen.
            let inside = (u > BORDER) & (u < last) & (v > BORDER) & (v < last);
            let near = (left & (fu < reach_u))
                | (right & (1.0 - fu < reach_u))
                | (above & (fv < reach_v))
                | (below & (1.0 - fv < reach_v));
            samples.push([x, y], [column, row], *grey, inside & near);
        }
    }
    samples.complete(pattern);
}

/// The quadrilateral of the white margin.
struct Outline {
    corners: [[f64; 2]; 4],
}

impl Outline {
    fn new(view: &View) -> Self {
        Self { corners: view.margin_px.map(|corner| [corner.x, corner.y]) }
    }

    fn rows(&self, height: usize) -> std::ops::Range<usize> {
        let low = self.corners.iter().map(|c| c[1]).fold(f64::INFINITY, f64::min);
        let high = self.corners.iter().map(|c| c[1]).fold(0.0, f64::max);
        (low.ceil().max(0.0) as usize)..(high as usize + 1).min(height)
    }

    /// The columns inside it in a row.
    fn columns(&self, row: usize, width: usize) -> std::ops::Range<usize> {
        let y = row as f64;
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for k in 0..4 {
            let (a, b) = (self.corners[k], self.corners[(k + 1) % 4]);
            if (a[1] <= y) != (b[1] <= y) {
                let x = a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
                low = low.min(x);
                high = high.max(x);
            }
        }
        (low.max(0.0) as usize).min(width)..(high as usize + 1).min(width)
    }
}
