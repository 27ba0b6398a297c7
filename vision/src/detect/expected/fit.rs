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
//! A tag that moves far while it is exposed is the mean of such pictures along its way ([`Smear`]), whose direction is that
//! of the predicted motion; how long it is, the blur that was fitted without it says ([`Appearance::smear_px`]).
//!
//! The covariance of G is the inverse of the normal matrix times the variance of the residuals (Triggs et al.,
//! "Bundle adjustment: a modern synthesis", 1999, section 2).

mod lanes;

pub use lanes::Pixels;
use lanes::{Derivatives, KERNEL_VARIANCE, Picture};

use super::START_BLUR_PX;
use super::pattern::Pattern;
use crate::cholesky::{self, Cholesky};
use crate::vector::{Kernel, Vector, fastest};

/// Unknowns: β, γ, h_u, h_v, then eight of G.
const UNKNOWNS: usize = 12;
/// The first that is one of G.
const OF_G: usize = 4;
/// The first that is one of the blur.
const OF_BLUR: usize = 2;

type Normal = [[f64; UNKNOWNS]; UNKNOWNS];
type Unknowns = [f64; UNKNOWNS];

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
    /// How far the tag moves while it is exposed.
    pub smear: Smear,
}

/// A steady straight motion during the exposure: the picture is the mean over its way. Known, not fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smear {
    /// From its begin to its end, local coordinates.
    pub local: [f64; 2],
    /// Its length in the image.
    pub length_px: f64,
}

impl Smear {
    /// A tag at rest.
    pub const NONE: Self = Self { local: [0.0; 2], length_px: 0.0 };

    /// Steps in which the way is reckoned with: a pixel each, less than two standard deviations of any lens.
    fn steps(&self) -> usize {
        self.length_px.ceil().max(1.0) as usize
    }
}

/// Pixels of a tag near its edges.
#[derive(Debug, Default)]
pub struct Samples {
    pixels: Vec<Pixels>,
    count: f64,
    derivatives: Vec<Derivatives>,
}

/// A fitted appearance.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The appearance.
    pub appearance: Appearance,
    /// Standard deviation of the residuals, grey levels.
    pub noise: f64,
    /// The normal matrix of the last step, in units of the noise before it.
    factor: Cholesky<UNKNOWNS>,
    noise_before: f64,
}

impl Fit {
    /// Covariance of what depends on G, given its derivatives by the eight unknowns of G: a row for each of these.
    pub fn covariance(&self, derivatives: &[[f64; 8]; 8]) -> [[f64; 8]; 8] {
        let mut rows = [[0.0; 8]; UNKNOWNS];
        rows[OF_G..].copy_from_slice(derivatives);
        let shrunk = (self.noise / self.noise_before).powi(2);
        cholesky::products(&self.factor.whitened(rows)).map(|row| row.map(|value| value * shrunk))
    }
}

/// How closely to fit.
#[derive(Debug, Clone, Copy)]
pub struct Closeness {
    /// Steps at most.
    pub most_steps: usize,
    /// A step that moves no edge farther than this needs no other.
    pub settled_px: f64,
}

/// Blur beyond one cell is not a tag any more.
const BLUR_RANGE: [f64; 2] = [0.05, 1.0];
/// How far the blur departs from what it was, as a share: it is known from other tags and images.
const BLUR_SHARE: f64 = 0.3;
/// Grey levels are whole numbers: the least standard deviation of a residual.
const LEAST_NOISE: f64 = 0.3;

impl Samples {
    /// Forgets all pixels.
    pub fn clear(&mut self) {
        self.pixels.clear();
        self.count = 0.0;
    }

    /// Adds eight pixels.
    #[inline(always)]
    pub fn push(&mut self, pixels: Pixels) {
        self.count += f64::from(pixels.weight.iter().sum::<f32>());
        self.pixels.push(pixels);
    }

    /// Fits from a start that is right within half the reach of the blur; `None` where it leads nowhere. `known` has
    /// the blur that is believed beforehand.
    pub fn fit(
        &mut self,
        pattern: &Pattern,
        start: &Appearance,
        known: &Appearance,
        closeness: &Closeness,
    ) -> Option<Fit> {
        fastest(Fitting { samples: self, pattern, start, known, closeness })
    }

    #[inline(always)]
    fn fit_with<V: Vector>(
        &mut self,
        pattern: &Pattern,
        start: &Appearance,
        known: &Appearance,
        closeness: &Closeness,
    ) -> Option<Fit> {
        let freedom = self.count - UNKNOWNS as f64;
        if freedom < UNKNOWNS as f64 {
            return None;
        }
        let mut appearance = *start;
        let cells_per_px = known.blur_cells[0].min(known.blur_cells[1]) / START_BLUR_PX;
        for _ in 0..closeness.most_steps {
            let products = self.linearize::<V>(pattern, &appearance);
            let squares = f64::from(products[UNKNOWNS][UNKNOWNS]);
            let noise = (squares / freedom).sqrt().max(LEAST_NOISE);
            let (normal, gradient) = normal_equations(&products, noise, &appearance, known);
            let factor = Cholesky::new(normal)?;
            let change = factor.solve(&gradient);
            appearance = appearance.changed(&change)?;
            if change_cells(&change) < closeness.settled_px * cells_per_px {
                // What the step promises to take off the residuals.
                let promise: f64 = change.iter().zip(&gradient).map(|(a, b)| a * b).sum();
                let left = (squares - promise * noise * noise).max(0.0);
                let noise_before = noise;
                let noise = (left / freedom).sqrt().max(LEAST_NOISE);
                return Some(Fit { appearance, noise, factor, noise_before });
            }
        }
        None
    }

    /// Products of derivatives and residuals at an appearance, summed over the pixels.
    #[inline(always)]
    fn linearize<V: Vector>(&mut self, pattern: &Pattern, appearance: &Appearance) -> lanes::Products {
        let [h_u, h_v] = appearance.blur_cells;
        let picture = Picture {
            cells_from_local: appearance.cells_from_local.map(|value| value as f32),
            black: appearance.black as f32,
            contrast: appearance.contrast as f32,
            inv_blur: [1.0 / h_u as f32, 1.0 / h_v as f32],
            mixed: (appearance.correlation * h_u * h_v * KERNEL_VARIANCE) as f32,
            smear: appearance.smear.local.map(|value| value as f32),
            steps: appearance.smear.steps(),
        };
        lanes::products::<V>(&self.pixels, pattern, &picture, &mut self.derivatives)
    }
}

struct Fitting<'a> {
    samples: &'a mut Samples,
    pattern: &'a Pattern,
    start: &'a Appearance,
    known: &'a Appearance,
    closeness: &'a Closeness,
}

impl Kernel for Fitting<'_> {
    type Output = Option<Fit>;

    #[inline(always)]
    fn run<V: Vector>(self) -> Option<Fit> {
        self.samples.fit_with::<V>(self.pattern, self.start, self.known, self.closeness)
    }
}

/// The normal equations in units of the noise, with what is known of the blur.
#[inline(always)]
fn normal_equations(
    products: &lanes::Products,
    noise: f64,
    now: &Appearance,
    known: &Appearance,
) -> (Normal, Unknowns) {
    let weight = 1.0 / (noise * noise);
    let mut normal = [[0.0; UNKNOWNS]; UNKNOWNS];
    let mut gradient = [0.0; UNKNOWNS];
    for (i, row) in normal.iter_mut().enumerate() {
        for (value, product) in row.iter_mut().zip(&products[i]) {
            *value = weight * f64::from(*product);
        }
        gradient[i] = weight * f64::from(products[UNKNOWNS][i]);
    }
    for axis in 0..2 {
        let at = OF_BLUR + axis;
        let prior = 1.0 / (BLUR_SHARE * known.blur_cells[axis]).powi(2);
        normal[at][at] += prior;
        gradient[at] += prior * (known.blur_cells[axis] - now.blur_cells[axis]);
    }
    (normal, gradient)
}

impl Appearance {
    /// The blur in units of another's, along the side where it has grown most.
    pub fn blur_over(&self, other: &Self) -> f64 {
        let ratio = |axis: usize| self.blur_cells[axis] / other.blur_cells[axis];
        ratio(0).max(ratio(1))
    }

    /// How far the tag moves while it is exposed, cells of u and of v.
    pub fn smear_cells(&self) -> [f64; 2] {
        let (g, [x, y]) = (&self.cells_from_local, self.smear.local);
        [0, 3].map(|row| ((g[row] - g[row + 2] * g[6]) * x + (g[row + 1] - g[row + 2] * g[7]) * y).abs())
    }

    /// The length of the motion that explains what is more blurred than it should be: a box of length L has the variance
    /// L²/12, of which each side of the tag sees the square of its share. `cells_per_px` are u and v along the motion.
    pub fn smear_px(&self, known: &Self, cells_per_px: [f64; 2]) -> f64 {
        let excess = |axis: usize| self.blur_cells[axis].powi(2) - known.blur_cells[axis].powi(2);
        let variance = (excess(0) + excess(1)) * KERNEL_VARIANCE;
        let seen = cells_per_px[0].powi(2) + cells_per_px[1].powi(2);
        (self.smear.length_px.powi(2) + 12.0 * variance / seen).max(0.0).sqrt()
    }

    /// With all unknowns changed; `None` if it is no picture of a tag any more.
    fn changed(&self, change: &Unknowns) -> Option<Self> {
        if !change.iter().all(|number| number.is_finite()) {
            return None;
        }
        let mut cells_from_local = self.cells_from_local;
        for (value, change) in cells_from_local.iter_mut().zip(&change[OF_G..]) {
            *value += change;
        }
        let blur = |axis: usize| {
            // No step changes the blur by more than half: it is known less well than the edges.
            let h = self.blur_cells[axis];
            (h + change[OF_BLUR + axis].clamp(-0.5 * h, 0.5 * h)).clamp(BLUR_RANGE[0], BLUR_RANGE[1])
        };
        let contrast = self.contrast + change[1];
        (contrast > 0.0).then(|| Self {
            cells_from_local,
            black: self.black + change[0],
            contrast,
            blur_cells: [blur(0), blur(1)],
            correlation: self.correlation,
            smear: self.smear,
        })
    }
}

/// How far a change moves the tag's edges at most, cells: local coordinates reach to ±1.
fn change_cells(change: &Unknowns) -> f64 {
    /// (u, v) at the square's end is this far from zero.
    const FAR: f64 = 9.0;
    let sum = |range: std::ops::Range<usize>| -> f64 { change[range].iter().map(|value| value.abs()).sum() };
    sum(OF_G..OF_G + 3).max(sum(OF_G + 3..OF_G + 6)) + FAR * sum(OF_G + 6..UNKNOWNS)
}
