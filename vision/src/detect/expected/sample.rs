//! Picks the pixels of a tag that say where its edges are.

use super::View;
use super::fit::{Appearance, Samples};
use super::pattern::{CELLS, Pattern};
use super::rays::RayGrid;
use crate::image::GrayImage;

/// Pixels beside an edge are taken up to this many half-widths of the blur from it, and
const REACH: f64 = 1.0;
/// this many pixels more, for what the alignment left.
const SPARE_PX: f64 = 0.7;
/// Not so close to the end of the white margin, cells: what lies beyond is unknown.
const BORDER: f32 = 0.35;

/// Collects pixels near the edges, in every `step`-th row.
#[expect(clippy::too_many_arguments, reason = "what a tag looks like, and two buffers that are kept")]
pub fn collect(
    image: &GrayImage,
    pattern: &Pattern,
    view: &View,
    rays: &RayGrid,
    appearance: &Appearance,
    step: usize,
    row: &mut Vec<[f32; 2]>,
    samples: &mut Samples,
) {
    samples.clear();
    let g = appearance.cells_from_local.map(|value| value as f32);
    let reach = |axis: usize| {
        (REACH * appearance.blur_cells[axis] + SPARE_PX * view.cells_per_px[axis]).min(1.0) as f32
    };
    let (reach_u, reach_v) = (reach(0), reach(1));
    let (inv_unit, origin) = ((1.0 / view.unit) as f32, view.origin.cast::<f32>());
    let bound = |axis: usize, size: u32| {
        let ends = view.margin_px.iter().map(|corner| corner[axis]);
        let low = ends.clone().fold(f64::INFINITY, f64::min).ceil().max(0.0) as usize;
        let high = ends.fold(0.0, f64::max).floor() as usize;
        low..(high + 1).min(size as usize)
    };
    let (columns, rows) = (bound(0, image.width()), bound(1, image.height()));
    row.resize(columns.len(), [0.0; 2]);
    let last = CELLS as f32 - BORDER;
    for y in rows.step_by(step) {
        rays.row(y, columns.start, row);
        let pixels = &image.data()[y * image.width() as usize..][columns.clone()];
        for (ray, grey) in row.iter().zip(pixels) {
            let (x, y) = ((ray[0] - origin.x) * inv_unit, (ray[1] - origin.y) * inv_unit);
            let inv_w = 1.0 / (g[6] * x + g[7] * y + g[8]);
            let u = (g[0] * x + g[1] * y + g[2]) * inv_w;
            let v = (g[3] * x + g[4] * y + g[5]) * inv_w;
            if !(BORDER..last).contains(&u) || !(BORDER..last).contains(&v) {
                continue;
            }
            let (column, line) = (u as usize, v as usize);
            let (fu, fv) = (u - column as f32, v - line as f32);
            let [left, right, above, below] = pattern.steps(Pattern::place(column, line));
            let near = (left && fu < reach_u)
                || (right && 1.0 - fu < reach_u)
                || (above && fv < reach_v)
                || (below && 1.0 - fv < reach_v);
            if near {
                samples.push(x, y, *grey);
            }
        }
    }
}
