//! What one image shows of a target, and which images are worth using.

use nalgebra::{Point2, SMatrix};

use crate::bundle::{POINTS, Part};
use crate::projection::Coverage;

/// Points of a target in one image.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// File or time, for reports.
    pub name: String,
    /// The parts that are seen.
    pub parts: Vec<PartView>,
    /// How wide edges are, pixels; `None` if nobody measured.
    pub blur_px: Option<f64>,
}

/// A part of a target in one image.
#[derive(Debug, Clone, PartialEq)]
pub struct PartView {
    /// Index into the target's parts.
    pub part: usize,
    /// Its points, as many as it has.
    pub points_px: [Point2<f64>; POINTS],
    /// L⁻¹ of their covariance L Lᵀ.
    pub whitening: SMatrix<f64, 8, 8>,
}

impl View {
    /// Points of the target (its own frame) and their pixels.
    pub fn points<'a>(
        &'a self,
        target: &'a [Part],
    ) -> impl Iterator<Item = (nalgebra::Point3<f64>, Point2<f64>)> + 'a {
        self.parts.iter().flat_map(|seen| {
            let part = target.get(seen.part);
            let points = part.map_or(&[][..], |part| &part.points);
            points
                .iter()
                .zip(seen.points_px)
                .filter_map(move |(point, pixel)| Some((part?.object_from_part * point, pixel)))
        })
    }

    /// Least and largest x and y of its points, pixels.
    fn spread_px(&self, target: &[Part]) -> f64 {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (_, pixel) in self.points(target) {
            for axis in 0..2 {
                low[axis] = low[axis].min(pixel[axis]);
                high[axis] = high[axis].max(pixel[axis]);
            }
        }
        (high[0] - low[0]).max(0.0) * (high[1] - low[1]).max(0.0)
    }
}

/// The most useful views, at most `most`: sharp ones, spread over the image, near and far; in their own order.
///
/// Greedy: each next view is the one that adds most where least has been seen.
pub fn choose(views: &[View], target: &[Part], width: u32, height: u32, most: usize) -> Vec<usize> {
    if views.len() <= most {
        return (0..views.len()).collect();
    }
    let cells_of = |view: &View| -> Vec<usize> {
        let coverage = Coverage::new(width, height, view.points(target).map(|(_, pixel)| pixel));
        (0..coverage.cells.len()).filter(|k| coverage.cells[*k].points > 0).collect()
    };
    let area = f64::from(width) * f64::from(height);
    // Sizes in octaves of the image's area: a board near and far, upright and tilted, has different ones.
    let octave = |view: &View| ((view.spread_px(target) / area).max(1e-6).log2() * 1.5).round() as i64;
    let about: Vec<(Vec<usize>, i64)> = views.iter().map(|view| (cells_of(view), octave(view))).collect();
    let mut seen = std::collections::HashMap::<(usize, i64), f64>::new();
    let (mut chosen, mut left) = (Vec::new(), (0..views.len()).collect::<Vec<_>>());
    while chosen.len() < most {
        let gain = |k: usize| {
            let (cells, octave) = &about[k];
            let fresh: f64 =
                cells.iter().map(|cell| 1.0 / (1.0 + seen.get(&(*cell, *octave)).unwrap_or(&0.0))).sum();
            fresh / views[k].blur_px.unwrap_or(1.0).max(1.0)
        };
        let best = (0..left.len()).max_by(|a, b| gain(left[*a]).total_cmp(&gain(left[*b])));
        let Some(best) = best else { break };
        let view = left.swap_remove(best);
        let (cells, octave) = &about[view];
        cells.iter().for_each(|cell| *seen.entry((*cell, *octave)).or_default() += 1.0);
        chosen.push(view);
    }
    chosen.sort_unstable();
    chosen
}
