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

use nalgebra::{SMatrix, SVector};

use super::pattern::{FRAMED, Pattern};

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
    /// Ideal image points in local coordinates.
    pub x: Vec<f32>,
    /// See [`Samples::x`].
    pub y: Vec<f32>,
    /// Grey levels.
    pub grey: Vec<f32>,
    /// Derivatives by the unknowns, one column each.
    columns: [Vec<f32>; UNKNOWNS],
    residuals: Vec<f32>,
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

/// How the fit goes about it.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Steps at most.
    pub max_steps: usize,
    /// Ends when no corner moves farther, cells.
    pub settled_cells: f64,
}

/// Variance of the kernel of half-width 1, and its height.
const KERNEL_VARIANCE: f64 = 1.0 / 9.0;
const PEAK: f32 = 35.0 / 32.0;
/// Blur beyond one cell is not a tag any more.
const BLUR_RANGE: [f64; 2] = [0.05, 1.0];
/// How far the blur departs from what it was, as a share: it is known from other tags and images.
const BLUR_SHARE: f64 = 0.3;
/// Grey levels are whole numbers: the least standard deviation of a residual.
const LEAST_NOISE: f64 = 0.3;

impl Samples {
    /// Forgets all pixels.
    pub fn clear(&mut self) {
        self.x.clear();
        self.y.clear();
        self.grey.clear();
    }

    /// Adds a pixel.
    #[inline]
    pub fn push(&mut self, x: f32, y: f32, grey: u8) {
        self.x.push(x);
        self.y.push(y);
        self.grey.push(f32::from(grey));
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.grey.len()
    }

    /// Fits from a start that is right within half the reach of the blur; `None` where it leads nowhere.
    pub fn fit(&mut self, pattern: &Pattern, start: &Appearance, effort: Effort) -> Option<Fit> {
        if self.len() < 4 * UNKNOWNS {
            return None;
        }
        let mut appearance = *start;
        let mut noise = f64::INFINITY;
        let mut normal = Normal::zeros();
        for step in 0..effort.max_steps {
            let squares = self.linearize(pattern, &appearance);
            noise = (squares / (self.len() - UNKNOWNS) as f64).sqrt().max(LEAST_NOISE);
            let gradient;
            (normal, gradient) = self.normal(noise, &appearance, start);
            let change = normal.cholesky()?.solve(&gradient);
            let moved = appearance.change(&change)?;
            appearance = moved;
            let last = step + 1 == effort.max_steps;
            if last || change_cells(&change) < effort.settled_cells {
                break;
            }
        }
        let covariance = normal.cholesky()?.inverse().fixed_view::<8, 8>(0, 0).into_owned();
        Some(Fit { appearance, noise, covariance })
    }

    /// Residuals and derivatives at an appearance; the sum of squared residuals.
    fn linearize(&mut self, pattern: &Pattern, appearance: &Appearance) -> f64 {
        let count = self.len();
        for column in &mut self.columns {
            column.resize(count, 0.0);
        }
        self.residuals.resize(count, 0.0);
        let g = appearance.cells_from_local.map(|value| value as f32);
        let (black, contrast) = (appearance.black as f32, appearance.contrast as f32);
        let inv_blur = appearance.blur_cells.map(|h| 1.0 / h as f32);
        let [h_u, h_v] = appearance.blur_cells;
        let mixed = (appearance.correlation * h_u * h_v * KERNEL_VARIANCE) as f32;
        let mut squares = 0.0;
        for k in 0..count {
            let (x, y) = (self.x[k], self.y[k]);
            let inv_w = 1.0 / (g[6] * x + g[7] * y + g[8]);
            let u = (g[0] * x + g[1] * y + g[2]) * inv_w;
            let v = (g[3] * x + g[4] * y + g[5]) * inv_w;
            let [t, t_u, t_v, t_hu, t_hv] = shade(pattern, u, v, inv_blur, mixed);
            let (a, b) = (contrast * t_u * inv_w, contrast * t_v * inv_w);
            let c = -(a * u + b * v);
            let row =
                [a * x, a * y, a, b * x, b * y, b, c * x, c * y, 1.0, t, contrast * t_hu, contrast * t_hv];
            for (column, value) in self.columns.iter_mut().zip(row) {
                column[k] = value;
            }
            let residual = self.grey[k] - black - contrast * t;
            self.residuals[k] = residual;
            squares += f64::from(residual * residual);
        }
        squares
    }

    /// The normal equations in units of the noise, with what is known of the blur.
    fn normal(&self, noise: f64, now: &Appearance, known: &Appearance) -> (Normal, Unknowns) {
        let weight = 1.0 / (noise * noise);
        let mut normal = Normal::zeros();
        let mut gradient = Unknowns::zeros();
        for i in 0..UNKNOWNS {
            for j in 0..=i {
                let value = weight * f64::from(dot(&self.columns[i], &self.columns[j]));
                normal[(i, j)] = value;
                normal[(j, i)] = value;
            }
            gradient[i] = weight * f64::from(dot(&self.columns[i], &self.residuals));
        }
        for axis in 0..2 {
            let prior = 1.0 / (BLUR_SHARE * known.blur_cells[axis]).powi(2);
            normal[(10 + axis, 10 + axis)] += prior;
            gradient[10 + axis] += prior * (known.blur_cells[axis] - now.blur_cells[axis]);
        }
        (normal, gradient)
    }
}

impl Appearance {
    /// With all unknowns changed; `None` if it is no picture of a tag any more.
    fn change(&self, change: &Unknowns) -> Option<Self> {
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

/// T and its derivatives by u, v, h_u, h_v.
#[inline]
fn shade(pattern: &Pattern, u: f32, v: f32, inv_blur: [f32; 2], mixed: f32) -> [f32; 5] {
    let (i, j) = (u.floor(), v.floor());
    let last = FRAMED as f32 - 3.0;
    let (i, j) = (i.clamp(0.0, last), j.clamp(0.0, last));
    let across = Weights::new(u - i, inv_blur[0]);
    let down = Weights::new(v - j, inv_blur[1]);
    let cells = pattern.around(Pattern::place(i as usize, j as usize));
    let along = |w: [f32; 3], c: [f32; 3]| w[0] * c[0] + w[1] * c[1] + w[2] * c[2];
    let rows = cells.map(|row| along(across.of, row));
    let rows_u = cells.map(|row| along(across.by_place, row));
    let rows_h = cells.map(|row| along(across.by_blur, row));
    [
        along(down.of, rows) + mixed * along(down.by_place, rows_u),
        along(down.of, rows_u),
        along(down.by_place, rows),
        along(down.of, rows_h),
        along(down.by_blur, rows),
    ]
}

/// What a cell and its two neighbours contribute at a place in the cell.
struct Weights {
    of: [f32; 3],
    by_place: [f32; 3],
    by_blur: [f32; 3],
}

impl Weights {
    /// `place` from 0 to 1 across the cell.
    #[inline]
    fn new(place: f32, inv_blur: f32) -> Self {
        let (before, slope_before) = beyond(place * inv_blur);
        let (after, slope_after) = beyond((1.0 - place) * inv_blur);
        // d(d/h)/dh = −(d/h)/h, and the share beyond falls with d/h.
        let by_blur_before = slope_before * place * inv_blur * inv_blur;
        let by_blur_after = slope_after * (1.0 - place) * inv_blur * inv_blur;
        let (slope_before, slope_after) = (slope_before * inv_blur, slope_after * inv_blur);
        Self {
            of: [before, 1.0 - before - after, after],
            by_place: [-slope_before, slope_before - slope_after, slope_after],
            by_blur: [by_blur_before, -by_blur_before - by_blur_after, by_blur_after],
        }
    }
}

/// The share of the kernel that lies beyond an edge at a distance of τ half-widths, and the kernel there.
#[inline]
fn beyond(tau: f32) -> (f32, f32) {
    let tau = tau.clamp(-1.0, 1.0);
    let t2 = tau * tau;
    let rest = 1.0 - t2;
    let share = tau * (1.0 - t2 * (1.0 - t2 * (0.6 - t2 / 7.0)));
    (0.5 - PEAK * share, PEAK * rest * rest * rest)
}

/// Dot product in eight lanes, so that the compiler uses vectors.
#[inline]
fn dot(a: &[f32], b: &[f32]) -> f32 {
    const LANES: usize = 8;
    let mut sums = [0.0f32; LANES];
    let (a_parts, b_parts) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f32 = a_parts.remainder().iter().zip(b_parts.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a_parts.zip(b_parts) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    rest + sums.iter().sum::<f32>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Derivatives that a step of a thousandth of a cell cannot tell from differences.
    const TOLERANCE: f32 = 5e-3;

    #[test]
    fn derivatives_of_the_picture_are_those_of_differences() {
        let pattern = Pattern::new(7).expect("a tag");
        let step = 1e-3;
        for blur in [[0.3f32, 0.45], [0.9, 0.2]] {
            let at = |u: f32, v: f32, h: [f32; 2]| shade(&pattern, u, v, h.map(|h| 1.0 / h), 0.0)[0];
            for k in 0..400 {
                let (u, v) = (0.3 + 0.47 * (k % 20) as f32, 0.4 + 0.46 * (k / 20) as f32);
                let found = shade(&pattern, u, v, blur.map(|h| 1.0 / h), 0.0);
                let [hu, hv] = blur;
                let differences = [
                    at(u + step, v, blur) - at(u - step, v, blur),
                    at(u, v + step, blur) - at(u, v - step, blur),
                    at(u, v, [hu + step, hv]) - at(u, v, [hu - step, hv]),
                    at(u, v, [hu, hv + step]) - at(u, v, [hu, hv - step]),
                ];
                for (found, difference) in found[1..].iter().zip(differences) {
                    assert!(
                        (found - difference / (2.0 * step)).abs() < TOLERANCE,
                        "{k}: {found} {difference}"
                    );
                }
            }
        }
    }
}
