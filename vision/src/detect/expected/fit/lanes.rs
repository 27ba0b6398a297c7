//! The fit's inner loops, eight pixels side by side.

use super::UNKNOWNS;
use crate::detect::expected::pattern::{CELLS, Pattern};
use crate::detect::expected::places::plane;
use crate::vector::{LANES, Vector};

type Lanes = [f32; LANES];

/// Variance of the kernel (1 − τ²)³ of half-width 1, and its height.
pub const KERNEL_VARIANCE: f64 = 1.0 / 9.0;
const PEAK: f32 = 35.0 / 32.0;

/// Eight pixels.
#[derive(Debug, Clone, Default)]
pub struct Pixels {
    /// Local coordinates.
    pub x: Lanes,
    /// See [`Pixels::x`].
    pub y: Lanes,
    /// The cell.
    pub column: Lanes,
    /// See [`Pixels::column`].
    pub row: Lanes,
    /// Colours of that cell and its neighbours: [`super::super::pattern::Pattern::around`].
    pub around: [i32; LANES],
    /// What was seen.
    pub grey: Lanes,
    /// 0 where there is no pixel, else 1.
    pub weight: Lanes,
}

/// Derivatives of eight pixels by the unknowns, then their residuals.
pub type Derivatives = [Lanes; COUNT];

/// Derivatives and residual of a pixel.
const COUNT: usize = UNKNOWNS + 1;

/// Sums over all pixels of the products of each two of [`Derivatives`].
pub type Products = [[f32; COUNT]; COUNT];

/// What the tag should look like: [`super::Appearance`] as the loops need it.
#[derive(Debug, Clone, Copy)]
pub struct Picture {
    /// G by rows.
    pub cells_from_local: [f32; 9],
    /// β.
    pub black: f32,
    /// γ.
    pub contrast: f32,
    /// 1/h_u, 1/h_v.
    pub inv_blur: [f32; 2],
    /// Covariance of the blur along u and along v. A blur that is not aligned with the tag smooths its corners
    /// another way: to first order by this times the mixed derivative of T.
    pub mixed: f32,
    /// How far the tag moves while it is exposed, local coordinates,
    pub smear: [f32; 2],
    /// and in how many equal steps this is reckoned with.
    pub steps: usize,
}

/// Derivatives of the grey level by the unknowns, and the grey level itself.
type Slopes<V> = [V; COUNT];

/// Products of derivatives and residuals, summed over the pixels; `scratch` is kept for the next time.
#[inline(always)]
pub fn products<V: Vector>(
    pixels: &[Pixels],
    pattern: &Pattern,
    picture: &Picture,
    scratch: &mut Vec<Derivatives>,
) -> Products {
    scratch.resize(pixels.len(), [[0.0; LANES]; COUNT]);
    if picture.steps > 1 {
        derive_smeared::<V>(pixels, pattern, picture, scratch);
    } else {
        derive::<V>(pixels, picture, scratch);
    }
    sum_products::<V>(scratch)
}

/// Derivatives and residuals.
#[inline(always)]
fn derive<V: Vector>(pixels: &[Pixels], picture: &Picture, out: &mut [Derivatives]) {
    for (pixels, out) in pixels.iter().zip(out) {
        let (x, y) = (V::new(pixels.x), V::new(pixels.y));
        let [u, v, inv_w] = cells::<V>(picture, x, y);
        let place = Place { x, y, u, v, inv_w, column: V::new(pixels.column), row: V::new(pixels.row) };
        let slopes = slopes(picture, &place, &Row::of_cells(&pixels.around));
        put(pixels, &slopes, V::splat(1.0), out);
    }
}

/// The same where the tag moves: the mean over its way. In steps of a pixel or less, which the lens smooths anyway, this is
/// as good as the integral.
#[inline(always)]
fn derive_smeared<V: Vector>(
    pixels: &[Pixels],
    pattern: &Pattern,
    picture: &Picture,
    out: &mut [Derivatives],
) {
    let share = 1.0 / picture.steps as f32;
    for (pixels, out) in pixels.iter().zip(out) {
        let mut sums = [V::splat(0.0); COUNT];
        for step in 0..picture.steps {
            let along = (step as f32 + 0.5) * share - 0.5;
            let x = V::new(pixels.x) + V::splat(along * picture.smear[0]);
            let y = V::new(pixels.y) + V::splat(along * picture.smear[1]);
            let [u, v, inv_w] = cells::<V>(picture, x, y);
            let last = (CELLS - 1) as f32;
            let (column, row) = (u.bounded(0.0, last).floor(), v.bounded(0.0, last).floor());
            let cell = row.times_plus(V::splat(CELLS as f32), column).whole();
            let around = cell.map(|cell| i32::from(pattern.around(cell as usize)));
            let slopes = slopes(picture, &Place { x, y, u, v, inv_w, column, row }, &Row::of_cells(&around));
            for (sum, slope) in sums.iter_mut().zip(slopes) {
                *sum = slope + *sum;
            }
        }
        put(pixels, &sums, V::splat(share), out);
    }
}

/// u, v and 1/w of local coordinates.
#[inline(always)]
fn cells<V: Vector>(picture: &Picture, x: V, y: V) -> [V; 3] {
    let g = &picture.cells_from_local;
    let inv_w = V::splat(1.0) / plane(g[6], g[7], g[8], x, y);
    [plane(g[0], g[1], g[2], x, y) * inv_w, plane(g[3], g[4], g[5], x, y) * inv_w, inv_w]
}

/// Eight places on the tag, in local coordinates and in cells, and the cells that they are in.
struct Place<V> {
    x: V,
    y: V,
    u: V,
    v: V,
    inv_w: V,
    column: V,
    row: V,
}

/// The grey level and its derivatives at eight places.
#[inline(always)]
fn slopes<V: Vector>(picture: &Picture, place: &Place<V>, cells: &[Row<V>; 3]) -> Slopes<V> {
    let &Place { x, y, u, v, inv_w, column, row } = place;
    let across = Weights::new(u - column, V::splat(picture.inv_blur[0]));
    let down = Weights::new(v - row, V::splat(picture.inv_blur[1]));
    let [t, t_u, t_v, t_hu, t_hv] = shade(cells, &across, &down, V::splat(picture.mixed));
    let contrast = V::splat(picture.contrast);
    let (a, b) = (contrast * t_u * inv_w, contrast * t_v * inv_w);
    let c = V::splat(0.0) - a.times_plus(u, b * v);
    let grey = contrast.times_plus(t, V::splat(picture.black));
    [V::splat(1.0), t, contrast * t_hu, contrast * t_hv, a * x, a * y, a, b * x, b * y, b, c * x, c * y, grey]
}

/// Puts down derivatives and residuals, the former times a share.
#[inline(always)]
fn put<V: Vector>(pixels: &Pixels, slopes: &Slopes<V>, share: V, out: &mut Derivatives) {
    let weight = V::new(pixels.weight);
    let scale = weight * share;
    for (out, slope) in out.iter_mut().zip(&slopes[..UNKNOWNS]) {
        *out = (scale * *slope).to_array();
    }
    out[UNKNOWNS] = (weight * V::new(pixels.grey) - scale * slopes[UNKNOWNS]).to_array();
}

/// Products summed over all pixels, four sums at a time: as many as hide how long an addition takes.
#[inline(always)]
fn sum_products<V: Vector>(derivatives: &[Derivatives]) -> Products {
    let mut products = [[0.0; COUNT]; COUNT];
    for i in 0..COUNT {
        for j in (0..=i).step_by(4) {
            let others = [j, (j + 1).min(i), (j + 2).min(i), (j + 3).min(i)];
            let mut sums = [V::splat(0.0); 4];
            let (pairs, rest) = derivatives.as_chunks::<2>();
            for [one, other] in pairs {
                add_products(one, i, others, &mut sums);
                add_products(other, i, others, &mut sums);
            }
            for last in rest {
                add_products(last, i, others, &mut sums);
            }
            for (k, lanes) in others.into_iter().zip(sums) {
                let value = sum(&lanes.to_array());
                products[i][k] = value;
                products[k][i] = value;
            }
        }
    }
    products
}

/// Adds the products of one column with four others.
#[inline(always)]
fn add_products<V: Vector>(all: &Derivatives, own: usize, others: [usize; 4], sums: &mut [V; 4]) {
    let own = V::new(all[own]);
    sums[0] = own.times_plus(V::new(all[others[0]]), sums[0]);
    sums[1] = own.times_plus(V::new(all[others[1]]), sums[1]);
    sums[2] = own.times_plus(V::new(all[others[2]]), sums[2]);
    sums[3] = own.times_plus(V::new(all[others[3]]), sums[3]);
}

/// Halves onto halves: no addition waits for more than two others.
#[inline(always)]
fn sum(lanes: &Lanes) -> f32 {
    ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]))
}

/// T and its derivatives by u, v, h_u, h_v.
#[inline(always)]
fn shade<V: Vector>(cells: &[Row<V>; 3], across: &Weights<V>, down: &Weights<V>, mixed: V) -> [V; 5] {
    let [above, here, below] = cells;
    let rows = Row::new(
        across.of.times_plus(above, above.here),
        across.of.times_plus(here, here.here),
        across.of.times_plus(below, below.here),
    );
    let rows_u =
        Row::new(across.by_place.times(above), across.by_place.times(here), across.by_place.times(below));
    let rows_h =
        Row::new(across.by_blur.times(above), across.by_blur.times(here), across.by_blur.times(below));
    [
        mixed.times_plus(down.by_place.times(&rows_u), down.of.times_plus(&rows, rows.here)),
        down.of.times_plus(&rows_u, rows_u.here),
        down.by_place.times(&rows),
        down.of.times_plus(&rows_h, rows_h.here),
        down.by_blur.times(&rows),
    ]
}

/// Three values in a row, as the middle one and what the others are above it.
struct Row<V> {
    before: V,
    here: V,
    after: V,
}

impl<V: Vector> Row<V> {
    #[inline(always)]
    fn new(before: V, here: V, after: V) -> Self {
        Self { before: before - here, here, after: after - here }
    }

    /// The colours of cells: see [`Pixels::around`].
    #[inline(always)]
    fn of_cells(around: &[i32; LANES]) -> [Self; 3] {
        [
            Self::new(V::bit::<0>(around), V::bit::<1>(around), V::bit::<2>(around)),
            Self::new(V::bit::<3>(around), V::bit::<4>(around), V::bit::<5>(around)),
            Self::new(V::bit::<6>(around), V::bit::<7>(around), V::bit::<8>(around)),
        ]
    }
}

/// What the neighbours before and after contribute beyond the cell itself.
struct Share<V> {
    before: V,
    after: V,
}

impl<V: Vector> Share<V> {
    #[inline(always)]
    fn times(&self, row: &Row<V>) -> V {
        self.before.times_plus(row.before, self.after * row.after)
    }

    #[inline(always)]
    fn times_plus(&self, row: &Row<V>, addend: V) -> V {
        self.before.times_plus(row.before, self.after.times_plus(row.after, addend))
    }
}

/// What a cell's two neighbours contribute at a place in the cell, in its stead, and the derivatives of that.
struct Weights<V> {
    of: Share<V>,
    by_place: Share<V>,
    by_blur: Share<V>,
}

impl<V: Vector> Weights<V> {
    /// `place` from 0 to 1 across the cell.
    #[inline(always)]
    fn new(place: V, inv_blur: V) -> Self {
        let (tau_before, tau_after) = (place * inv_blur, (V::splat(1.0) - place) * inv_blur);
        let (before, kernel_before) = beyond(tau_before);
        let (after, kernel_after) = beyond(tau_after);
        let (slope_before, slope_after) = (kernel_before * inv_blur, kernel_after * inv_blur);
        Self {
            of: Share { before, after },
            by_place: Share { before: V::splat(0.0) - slope_before, after: slope_after },
            // d(d/h)/dh = −(d/h)/h, and the share beyond falls with d/h.
            by_blur: Share { before: slope_before * tau_before, after: slope_after * tau_after },
        }
    }
}

/// The share of the kernel that lies beyond an edge at a distance of τ half-widths, and the kernel there.
#[inline(always)]
fn beyond<V: Vector>(tau: V) -> (V, V) {
    let tau = tau.bounded(-1.0, 1.0);
    let t2 = tau * tau;
    let rest = V::splat(1.0) - t2;
    // PEAK τ (1 − τ² + 3/5 τ⁴ − τ⁶/7)
    let series = t2.times_plus(V::splat(-PEAK / 7.0), V::splat(PEAK * 0.6));
    let series = t2.times_plus(t2.times_plus(series, V::splat(-PEAK)), V::splat(PEAK));
    (V::splat(0.5) - tau * series, V::splat(PEAK) * rest * (rest * rest))
}

#[cfg(test)]
mod tests {
    use wide::f32x8;

    use super::*;

    /// Derivatives that a step of a thousandth of a cell cannot tell from differences.
    const TOLERANCE: f32 = 5e-3;

    #[test]
    fn derivatives_of_the_picture_are_those_of_differences() {
        let pattern = Pattern::new(7).expect("a tag");
        let step = 1e-3;
        for blur in [[0.3f32, 0.45], [0.9, 0.2]] {
            for k in 0..400 {
                let (u, v) = (0.3 + 0.47 * (k % 20) as f32, 0.4 + 0.46 * (k / 20) as f32);
                let cells =
                    Row::of_cells(&[i32::from(pattern.around(v as usize * CELLS + u as usize)); LANES]);
                let shade = |du: f32, dv: f32, [hu, hv]: [f32; 2]| {
                    let across = Weights::new((u - u.floor() + du).into(), (1.0 / hu).into());
                    let down = Weights::new((v - v.floor() + dv).into(), (1.0 / hv).into());
                    shade(&cells, &across, &down, f32x8::ZERO).map(|all| all.to_array()[0])
                };
                let at = |du: f32, dv: f32, h: [f32; 2]| shade(du, dv, h)[0];
                let [hu, hv] = blur;
                let differences = [
                    at(step, 0.0, blur) - at(-step, 0.0, blur),
                    at(0.0, step, blur) - at(0.0, -step, blur),
                    at(0.0, 0.0, [hu + step, hv]) - at(0.0, 0.0, [hu - step, hv]),
                    at(0.0, 0.0, [hu, hv + step]) - at(0.0, 0.0, [hu, hv - step]),
                ];
                let found = shade(0.0, 0.0, blur);
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
