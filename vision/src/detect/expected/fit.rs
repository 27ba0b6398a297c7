//! The picture of a tag fitted to grey levels: where its edges lie, from every edge at once.
//!
//! # Equations
//! A pixel that sees the ideal point x = (X, Y, 1) (local coordinates: origin at the tag's middle, unit half its
//! side) lies at the cell coordinates (u, v) = (g₁·x, g₂·x) / g₃·x, where the g are the rows of a homography G.
//! Its grey level is
//!
//! ```text
//! I = β + γ T(u, v),    T = Σ_ij c_ij w_i(u; h_u) w_j(v; h_v)
//! ```
//!
//! with c = 1 for white cells and 0 for black ones, and w_i the box of a cell blurred by a kernel of half-width h
//! cells: lens, sensor, motion and the pixel itself. The kernel is the triweight (1 − τ²)³, within one percent a
//! Gaussian of σ = h/3, but of finite reach. Unknown are G (eight numbers), β, γ, h_u, h_v: all twelve are found
//! by Gauss-Newton, so that the edges are where they are whatever light and blur. Each edge is seen from both
//! sides, so a wrong kernel of the right symmetry moves none.
//!
//! The covariance of G is the inverse of the normal matrix times the variance of the residuals (Triggs et al.,
//! "Bundle adjustment: a modern synthesis", 1999, section 2).

mod lanes;

use nalgebra::{SMatrix, SVector};

use super::pattern::Pattern;
use lanes::{Derivatives, KERNEL_VARIANCE, LANES, Picture, Pixels};

/// Unknowns: eight of G, then β, γ, h_u, h_v.
const UNKNOWNS: usize = 12;

type Normal = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
type Unknowns = SVector<f64, UNKNOWNS>;

/// What a tag looks like in one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// G by rows; its last number is 1.
    pub cells_from_local: [f64; 9],
    /// β: grey level of black.
    pub black: f64,
    /// γ: white above black.
    pub contrast: f64,
    /// h_u, h_v in cells.
    pub blur_cells: [f64; 2],
    /// ρ: cosine of the angle between the gradients of u and v in the image; 0 for a tag seen from the front.
    pub correlation: f64,
}

/// Pixels of a tag near its edges.
#[derive(Debug, Default)]
pub struct Samples {
    /// The first `count` are pixels; what follows is room.
    pixels: Vec<Pixel>,
    count: usize,
    lanes: Vec<Pixels>,
    derivatives: Vec<Derivatives>,
}

/// One pixel: where it is in local coordinates, and the cell that it probably lies in. The fit may move it out of
/// that cell by a fraction of its side.
#[derive(Debug, Clone, Copy, Default)]
struct Pixel {
    place: [f32; 2],
    cell: [u8; 2],
    grey: u8,
}

/// A fitted appearance.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The appearance.
    pub appearance: Appearance,
    /// Standard deviation of the residuals, grey levels.
    pub noise: f64,
    /// Covariance of the eight unknowns of G.
    pub covariance: SMatrix<f64, 8, 8>,
}

/// Steps at most: two or three are usual.
const MAX_STEPS: usize = 7;
/// A step that moves no edge farther than this (cells) leaves an error of its square: a thousandth of a pixel.
const SETTLED_CELLS: f64 = 0.02;
/// The first steps take a part of the pixels.
const COARSE_STRIDE: usize = 3;
/// Blur beyond one cell is not a tag any more.
const BLUR_RANGE: [f64; 2] = [0.05, 1.0];
/// How far the blur departs from what it was, as a share: it is known from other tags and images.
const BLUR_SHARE: f64 = 0.3;
/// Grey levels are whole numbers: the least standard deviation of a residual.
const LEAST_NOISE: f64 = 0.3;

impl Samples {
    /// Forgets all pixels.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a pixel, if it is to be kept.
    #[inline]
    pub fn push(&mut self, place: [f32; 2], cell: [usize; 2], grey: u8, keep: bool) {
        if self.count == self.pixels.len() {
            self.pixels.resize(2 * self.count + 64, Pixel::default());
        }
        self.pixels[self.count] = Pixel { place, cell: cell.map(|index| index as u8), grey };
        self.count += usize::from(keep);
    }

    /// Gets ready for the fit, after the last pixel.
    pub fn complete(&mut self, pattern: &Pattern) {
        self.lanes.clear();
        for pixels in self.pixels[..self.count].chunks(LANES) {
            let mut lanes = Pixels::default();
            for (lane, pixel) in pixels.iter().enumerate() {
                let [column, row] = pixel.cell;
                lanes.x[lane] = pixel.place[0];
                lanes.y[lane] = pixel.place[1];
                lanes.column[lane] = f32::from(column);
                lanes.row[lane] = f32::from(row);
                lanes.grey[lane] = f32::from(pixel.grey);
                lanes.weight[lane] = 1.0;
                let cells = pattern.around(usize::from(column), usize::from(row));
                for (all, cell) in lanes.cells.iter_mut().zip(cells) {
                    all[lane] = cell;
                }
            }
            self.lanes.push(lanes);
        }
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Fits from a start that is right within half the reach of the blur; `None` where it leads nowhere.
    pub fn fit(&mut self, start: &Appearance) -> Option<Fit> {
        if self.len() < 4 * UNKNOWNS {
            return None;
        }
        let mut appearance = *start;
        let mut noise = f64::INFINITY;
        let mut normal = Normal::zeros();
        let mut stride = COARSE_STRIDE;
        for _ in 0..MAX_STEPS {
            let products = self.linearize(&appearance, stride);
            let squares = f64::from(products[UNKNOWNS][UNKNOWNS]);
            let freedom = (self.len() as f64 / stride as f64 - UNKNOWNS as f64).max(1.0);
            noise = (squares / freedom).sqrt().max(LEAST_NOISE);
            let gradient;
            (normal, gradient) = normal_equations(&products, noise, &appearance, start);
            let change = normal.cholesky()?.solve(&gradient);
            appearance = appearance.changed(&change)?;
            let settled = change_cells(&change) < SETTLED_CELLS;
            if settled && stride == 1 {
                break;
            }
            if settled {
                stride = 1;
            }
        }
        if stride > 1 {
            return None;
        }
        let covariance = normal.cholesky()?.inverse().fixed_view::<8, 8>(0, 0).into_owned();
        Some(Fit { appearance, noise, covariance })
    }

    /// Products of derivatives and residuals at an appearance, summed over every `stride`-th eight of pixels.
    fn linearize(&mut self, appearance: &Appearance, stride: usize) -> lanes::Products {
        let [h_u, h_v] = appearance.blur_cells;
        let picture = Picture {
            cells_from_local: appearance.cells_from_local.map(|value| value as f32),
            black: appearance.black as f32,
            contrast: appearance.contrast as f32,
            inv_blur: [1.0 / h_u as f32, 1.0 / h_v as f32],
            mixed: (appearance.correlation * h_u * h_v * KERNEL_VARIANCE) as f32,
        };
        lanes::products(&self.lanes, stride, &picture, &mut self.derivatives)
    }
}

/// The normal equations in units of the noise, with what is known of the blur.
fn normal_equations(
    products: &lanes::Products,
    noise: f64,
    now: &Appearance,
    known: &Appearance,
) -> (Normal, Unknowns) {
    let weight = 1.0 / (noise * noise);
    let mut normal = Normal::from_fn(|i, j| weight * f64::from(products[i][j]));
    let mut gradient = Unknowns::from_fn(|i, _| weight * f64::from(products[UNKNOWNS][i]));
    for axis in 0..2 {
        let at = UNKNOWNS - 2 + axis;
        let prior = 1.0 / (BLUR_SHARE * known.blur_cells[axis]).powi(2);
        normal[(at, at)] += prior;
        gradient[at] += prior * (known.blur_cells[axis] - now.blur_cells[axis]);
    }
    (normal, gradient)
}

impl Appearance {
    /// With all unknowns changed; `None` if it is no picture of a tag any more.
    fn changed(&self, change: &Unknowns) -> Option<Self> {
        if !change.iter().all(|number| number.is_finite()) {
            return None;
        }
        let mut cells_from_local = self.cells_from_local;
        for (value, change) in cells_from_local.iter_mut().zip(change.iter().take(8)) {
            *value += change;
        }
        let blur = |axis: usize| {
            // No step changes the blur by more than half: it is known less well than the edges.
            let h = self.blur_cells[axis];
            (h + change[10 + axis].clamp(-0.5 * h, 0.5 * h)).clamp(BLUR_RANGE[0], BLUR_RANGE[1])
        };
        let contrast = self.contrast + change[9];
        (contrast > 0.0).then(|| Self {
            cells_from_local,
            black: self.black + change[8],
            contrast,
            blur_cells: [blur(0), blur(1)],
            correlation: self.correlation,
        })
    }
}

/// How far a change moves the tag's edges at most, cells: local coordinates reach to ±1.
fn change_cells(change: &Unknowns) -> f64 {
    /// (u, v) at the square's end is this far from zero.
    const FAR: f64 = 9.0;
    let axis = |first: usize| change.fixed_rows::<3>(first).abs().sum();
    axis(0).max(axis(3)) + FAR * change.fixed_rows::<2>(6).abs().sum()
}
