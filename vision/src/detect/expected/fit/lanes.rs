//! The fit's inner loops, eight pixels side by side, so that the compiler makes vectors of them; compiled a second
//! time for processors with AVX2, which halves the time.

#![cfg_attr(
    target_arch = "x86_64",
    expect(unsafe_code, reason = "calls what was compiled for AVX2 after asking the processor for it")
)]

use wide::f32x8;

use super::UNKNOWNS;

/// Pixels side by side.
pub const LANES: usize = 8;

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
    /// That cell and its neighbours, 1 white, 0 black: row by row from the top left.
    pub cells: [Lanes; 9],
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
}

/// Products of derivatives and residuals, summed over every `stride`-th eight of pixels; `scratch` is kept for the
/// next time.
pub fn products(
    pixels: &[Pixels],
    stride: usize,
    picture: &Picture,
    scratch: &mut Vec<Derivatives>,
) -> Products {
    scratch.resize(pixels.len().div_ceil(stride), [[0.0; LANES]; COUNT]);
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        // SAFETY: the processor has both.
        return unsafe {
            avx2::derive(pixels, stride, picture, scratch);
            avx2::products(scratch)
        };
    }
    derive(pixels, stride, picture, scratch);
    sum_products(scratch)
}

/// The same for processors with AVX2.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::{__m256, _mm256_fmadd_ps, _mm256_loadu_ps, _mm256_setzero_ps, _mm256_storeu_ps};

    use super::{COUNT, Derivatives, LANES, Lanes, Picture, Pixels, Products};

    #[target_feature(enable = "avx2,fma")]
    pub fn derive(pixels: &[Pixels], stride: usize, picture: &Picture, out: &mut [Derivatives]) {
        super::derive(pixels, stride, picture, out);
    }

    /// Four sums at a time: as many as hide how long an addition takes.
    #[target_feature(enable = "avx2,fma")]
    pub fn products(derivatives: &[Derivatives]) -> Products {
        let mut products = [[0.0; COUNT]; COUNT];
        for i in 0..COUNT {
            for j in (0..=i).step_by(4) {
                let others = [j, j + 1, j + 2, j + 3].map(|k| k.min(i));
                let mut sums = [_mm256_setzero_ps(); 4];
                for all in derivatives {
                    let own = load(&all[i]);
                    for (sum, k) in sums.iter_mut().zip(others) {
                        *sum = _mm256_fmadd_ps(own, load(&all[k]), *sum);
                    }
                }
                for (sum, k) in sums.into_iter().zip(others) {
                    let mut lanes: Lanes = [0.0; LANES];
                    // SAFETY: the array holds the eight numbers that are written.
                    unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), sum) };
                    let value = super::sum(&lanes);
                    products[i][k] = value;
                    products[k][i] = value;
                }
            }
        }
        products
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn load(lanes: &Lanes) -> __m256 {
        // SAFETY: the array holds the eight numbers that are read.
        unsafe { _mm256_loadu_ps(lanes.as_ptr()) }
    }
}

/// Derivatives and residuals.
#[inline(always)]
fn derive(pixels: &[Pixels], stride: usize, picture: &Picture, out: &mut [Derivatives]) {
    let g = picture.cells_from_local.map(f32x8::splat);
    let [black, contrast, mixed] = [picture.black, picture.contrast, picture.mixed].map(f32x8::splat);
    let [inv_blur_u, inv_blur_v] = picture.inv_blur.map(f32x8::splat);
    for (pixels, out) in pixels.iter().step_by(stride).zip(out) {
        let (x, y) = (f32x8::new(pixels.x), f32x8::new(pixels.y));
        let weight = f32x8::new(pixels.weight);
        let inv_w = f32x8::ONE / (g[6] * x + g[7] * y + g[8]);
        let u = (g[0] * x + g[1] * y + g[2]) * inv_w;
        let v = (g[3] * x + g[4] * y + g[5]) * inv_w;
        let across = Weights::new(u - f32x8::new(pixels.column), inv_blur_u);
        let down = Weights::new(v - f32x8::new(pixels.row), inv_blur_v);
        let cells = pixels.cells.map(f32x8::new);
        let [t, t_u, t_v, t_hu, t_hv] = shade(&cells, &across, &down, mixed);
        let scale = weight * contrast;
        let (a, b) = (scale * t_u * inv_w, scale * t_v * inv_w);
        let c = -(a * u + b * v);
        let residual = weight * (f32x8::new(pixels.grey) - black - contrast * t);
        let values = [
            a * x,
            a * y,
            a,
            b * x,
            b * y,
            b,
            c * x,
            c * y,
            weight,
            weight * t,
            scale * t_hu,
            scale * t_hv,
            residual,
        ];
        *out = values.map(f32x8::to_array);
    }
}

/// Products summed over all pixels.
fn sum_products(derivatives: &[Derivatives]) -> Products {
    let mut products = [[0.0; COUNT]; COUNT];
    for i in 0..COUNT {
        for j in 0..=i {
            let mut sums: Lanes = [0.0; LANES];
            for all in derivatives {
                for lane in 0..LANES {
                    sums[lane] += all[i][lane] * all[j][lane];
                }
            }
            let value = sum(&sums);
            products[i][j] = value;
            products[j][i] = value;
        }
    }
    products
}

/// Halves onto halves: no addition waits for more than two others.
#[inline(always)]
fn sum(lanes: &Lanes) -> f32 {
    let four: [f32; 4] = std::array::from_fn(|k| lanes[k] + lanes[k + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}

/// T and its derivatives by u, v, h_u, h_v.
#[inline(always)]
fn shade(cells: &[f32x8; 9], across: &Weights, down: &Weights, mixed: f32x8) -> [f32x8; 5] {
    let (rows, rows_u, rows_h) =
        (along(cells, across.of), along(cells, across.by_place), along(cells, across.by_blur));
    [
        over(down.of, rows) + mixed * over(down.by_place, rows_u),
        over(down.of, rows_u),
        over(down.by_place, rows),
        over(down.of, rows_h),
        over(down.by_blur, rows),
    ]
}

#[inline(always)]
fn along(c: &[f32x8; 9], w: [f32x8; 3]) -> [f32x8; 3] {
    [
        w[0] * c[0] + w[1] * c[1] + w[2] * c[2],
        w[0] * c[3] + w[1] * c[4] + w[2] * c[5],
        w[0] * c[6] + w[1] * c[7] + w[2] * c[8],
    ]
}

#[inline(always)]
fn over(w: [f32x8; 3], rows: [f32x8; 3]) -> f32x8 {
    w[0] * rows[0] + w[1] * rows[1] + w[2] * rows[2]
}

/// What a cell and its two neighbours contribute at a place in the cell.
struct Weights {
    of: [f32x8; 3],
    by_place: [f32x8; 3],
    by_blur: [f32x8; 3],
}

impl Weights {
    /// `place` from 0 to 1 across the cell.
    #[inline(always)]
    fn new(place: f32x8, inv_blur: f32x8) -> Self {
        let rest = f32x8::ONE - place;
        let (before, slope_before) = beyond(place * inv_blur);
        let (after, slope_after) = beyond(rest * inv_blur);
        let (slope_before, slope_after) = (slope_before * inv_blur, slope_after * inv_blur);
        // d(d/h)/dh = −(d/h)/h, and the share beyond falls with d/h.
        let by_blur_before = slope_before * place * inv_blur;
        let by_blur_after = slope_after * rest * inv_blur;
        Self {
            of: [before, f32x8::ONE - before - after, after],
            by_place: [-slope_before, slope_before - slope_after, slope_after],
            by_blur: [by_blur_before, -by_blur_before - by_blur_after, by_blur_after],
        }
    }
}

/// The share of the kernel that lies beyond an edge at a distance of τ half-widths, and the kernel there.
#[inline(always)]
fn beyond(tau: f32x8) -> (f32x8, f32x8) {
    let tau = tau.fast_max(-f32x8::ONE).fast_min(f32x8::ONE);
    let t2 = tau * tau;
    let rest = f32x8::ONE - t2;
    let share =
        tau * (f32x8::ONE - t2 * (f32x8::ONE - t2 * (f32x8::splat(0.6) - t2 * f32x8::splat(1.0 / 7.0))));
    (f32x8::HALF - f32x8::splat(PEAK) * share, f32x8::splat(PEAK) * rest * rest * rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::expected::pattern::Pattern;

    /// Derivatives that a step of a thousandth of a cell cannot tell from differences.
    const TOLERANCE: f32 = 5e-3;

    #[test]
    fn derivatives_of_the_picture_are_those_of_differences() {
        let pattern = Pattern::new(7).expect("a tag");
        let step = 1e-3;
        for blur in [[0.3f32, 0.45], [0.9, 0.2]] {
            for k in 0..400 {
                let (u, v) = (0.3 + 0.47 * (k % 20) as f32, 0.4 + 0.46 * (k / 20) as f32);
                let cells = pattern.around(u as usize, v as usize).map(f32x8::splat);
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
