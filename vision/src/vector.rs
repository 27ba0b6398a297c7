//! Inner loops that are written once and compiled twice, for every processor and for those with AVX2 and FMA, which takes
//! half the time: a [`Kernel`], which may compute with eight numbers side by side ([`Vector`]).
//!
//! [`fastest`] asks the processor; a kernel is inlined as a whole into what is compiled for the answer.

#![cfg_attr(
    target_arch = "x86_64",
    expect(
        unsafe_code,
        reason = "AVX2's instructions, in code that runs only after asking the processor for them"
    )
)]

use std::ops::{Add, Div, Mul, Sub};

use wide::{f32x8, i32x8};

/// Numbers side by side.
pub const LANES: usize = 8;

/// Work that is worth compiling twice.
pub trait Kernel {
    /// What it computes.
    type Output;

    /// Does it. Must be `#[inline(always)]`, and all that it calls and that takes time: else that is compiled once only.
    fn run<V: Vector>(self) -> Self::Output;
}

/// Runs a kernel as fast as this processor can.
pub fn fastest<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if avx::is_there() {
        // SAFETY: the processor has what it is compiled for.
        return unsafe { avx::run(kernel) };
    }
    kernel.run::<f32x8>()
}

/// Eight numbers.
pub trait Vector:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// From an array.
    fn new(numbers: [f32; LANES]) -> Self;
    /// The same number eight times.
    fn splat(number: f32) -> Self;
    /// The numbers.
    fn to_array(self) -> [f32; LANES];
    /// self · factor + addend.
    fn times_plus(self, factor: Self, addend: Self) -> Self;
    /// Neither below nor above, whatever it was.
    fn bounded(self, low: f32, high: f32) -> Self;
    /// 1 where it lies between, else 0.
    fn is_between(self, low: f32, high: f32) -> Self;
    /// A bit of each, as 0 or 1.
    fn bit<const PLACE: i32>(bits: &[i32; LANES]) -> Self;
    /// The whole numbers below; of what is not negative.
    fn floor(self) -> Self;
    /// The same as integers.
    fn whole(self) -> [i32; LANES];
}

impl Vector for f32x8 {
    #[inline(always)]
    fn new(numbers: [f32; LANES]) -> Self {
        Self::new(numbers)
    }

    #[inline(always)]
    fn splat(number: f32) -> Self {
        Self::splat(number)
    }

    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        self.to_array()
    }

    #[inline(always)]
    fn times_plus(self, factor: Self, addend: Self) -> Self {
        self * factor + addend
    }

    #[inline(always)]
    fn bounded(self, low: f32, high: f32) -> Self {
        self.fast_max(Self::splat(low)).fast_min(Self::splat(high))
    }

    #[inline(always)]
    fn is_between(self, low: f32, high: f32) -> Self {
        self.simd_gt(Self::splat(low)) & self.simd_lt(Self::splat(high)) & Self::ONE
    }

    #[inline(always)]
    fn bit<const PLACE: i32>(bits: &[i32; LANES]) -> Self {
        ((i32x8::new(*bits) >> PLACE) & i32x8::ONE).round_float()
    }

    #[inline(always)]
    fn floor(self) -> Self {
        self.fast_trunc_int().round_float()
    }

    #[inline(always)]
    fn whole(self) -> [i32; LANES] {
        self.fast_trunc_int().to_array()
    }
}

#[cfg(target_arch = "x86_64")]
mod avx {
    use std::arch::x86_64 as arch;

    use super::{Add, Div, Kernel, LANES, Mul, Sub, Vector};

    /// Whether [`Avx`] may be used.
    #[inline]
    pub fn is_there() -> bool {
        is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn run<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Avx>()
    }

    /// Eight numbers in one register. Used only where [`is_there`] is true: what is `SAFETY` below rests on it.
    #[derive(Debug, Clone, Copy)]
    pub struct Avx(arch::__m256);

    macro_rules! operator {
        ($operator:ident, $name:ident, $instruction:ident) => {
            impl $operator for Avx {
                type Output = Self;

                #[inline(always)]
                fn $name(self, other: Self) -> Self {
                    // SAFETY: the processor has AVX2.
                    Self(unsafe { arch::$instruction(self.0, other.0) })
                }
            }
        };
    }

    operator!(Add, add, _mm256_add_ps);
    operator!(Sub, sub, _mm256_sub_ps);
    operator!(Mul, mul, _mm256_mul_ps);
    operator!(Div, div, _mm256_div_ps);

    impl Vector for Avx {
        #[inline(always)]
        fn new(numbers: [f32; LANES]) -> Self {
            // SAFETY: the processor has AVX2; the array holds the eight numbers that are read.
            Self(unsafe { arch::_mm256_loadu_ps(numbers.as_ptr()) })
        }

        #[inline(always)]
        fn splat(number: f32) -> Self {
            // SAFETY: the processor has AVX2.
            Self(unsafe { arch::_mm256_set1_ps(number) })
        }

        #[inline(always)]
        fn to_array(self) -> [f32; LANES] {
            let mut numbers = [0.0; LANES];
            // SAFETY: the processor has AVX2; the array holds the eight numbers that are written.
            unsafe { arch::_mm256_storeu_ps(numbers.as_mut_ptr(), self.0) };
            numbers
        }

        #[inline(always)]
        fn times_plus(self, factor: Self, addend: Self) -> Self {
            // SAFETY: the processor has FMA.
            Self(unsafe { arch::_mm256_fmadd_ps(self.0, factor.0, addend.0) })
        }

        #[inline(always)]
        fn bounded(self, low: f32, high: f32) -> Self {
            // SAFETY: the processor has AVX2.
            Self(unsafe {
                arch::_mm256_min_ps(arch::_mm256_max_ps(self.0, Self::splat(low).0), Self::splat(high).0)
            })
        }

        #[inline(always)]
        fn is_between(self, low: f32, high: f32) -> Self {
            // SAFETY: the processor has AVX2.
            Self(unsafe {
                let above = arch::_mm256_cmp_ps::<{ arch::_CMP_GT_OQ }>(self.0, Self::splat(low).0);
                let below = arch::_mm256_cmp_ps::<{ arch::_CMP_LT_OQ }>(self.0, Self::splat(high).0);
                arch::_mm256_and_ps(arch::_mm256_and_ps(above, below), Self::splat(1.0).0)
            })
        }

        #[inline(always)]
        fn bit<const PLACE: i32>(bits: &[i32; LANES]) -> Self {
            // SAFETY: the processor has AVX2; the array holds the eight numbers that are read.
            Self(unsafe {
                let bits = arch::_mm256_loadu_si256(bits.as_ptr().cast());
                let bit = arch::_mm256_and_si256(
                    arch::_mm256_srli_epi32::<PLACE>(bits),
                    arch::_mm256_set1_epi32(1),
                );
                arch::_mm256_cvtepi32_ps(bit)
            })
        }

        #[inline(always)]
        fn floor(self) -> Self {
            // SAFETY: the processor has AVX2.
            Self(unsafe { arch::_mm256_floor_ps(self.0) })
        }

        #[inline(always)]
        fn whole(self) -> [i32; LANES] {
            let mut numbers = [0; LANES];
            // SAFETY: the processor has AVX2; the array holds the eight numbers that are written.
            unsafe {
                arch::_mm256_storeu_si256(numbers.as_mut_ptr().cast(), arch::_mm256_cvttps_epi32(self.0));
            }
            numbers
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results<V: Vector>() -> Vec<[f32; LANES]> {
        let numbers = V::new(std::array::from_fn(|k| 0.4 * k as f32 - 1.0));
        let bits = [0, 1, 2, 3, 4, 5, 6, 256];
        vec![
            (numbers + V::splat(2.0)).to_array(),
            (numbers - V::splat(2.0)).to_array(),
            (V::splat(2.0) / numbers).to_array(),
            numbers.times_plus(numbers, V::splat(0.5)).to_array(),
            (numbers * numbers).to_array(),
            numbers.bounded(-0.5, 1.0).to_array(),
            numbers.is_between(-0.6, 1.0).to_array(),
            V::bit::<1>(&bits).to_array(),
            V::bit::<8>(&bits).to_array(),
            (numbers + V::splat(1.1)).floor().to_array(),
            (numbers + V::splat(1.1)).whole().map(|number| number as f32),
        ]
    }

    #[test]
    #[cfg(target_arch = "x86_64")]
    fn both_kinds_of_vectors_compute_the_same() {
        /// FMA rounds once where two operations round twice.
        const TOLERANCE: f32 = 1e-6;
        if !avx::is_there() {
            return;
        }
        let (sut, expected) = (results::<avx::Avx>(), results::<f32x8>());
        for (sut, expected) in sut.iter().flatten().zip(expected.iter().flatten()) {
            assert!((sut - expected).abs() <= TOLERANCE * expected.abs(), "{sut} {expected}");
        }
    }
}
