//! Small positive matrices of a fixed size: A = UᵀU, solved and whitened without memory of its own.
//!
//! nalgebra has the same; this runs over whole rows, which the compiler makes vectors of, and takes a third of the
//! time, and half of that with AVX2. It is what the fit of each tag and each step of a pose wait for.

use crate::vector::{Kernel, Vector, fastest};

/// The decomposition of a positive definite matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Cholesky<const N: usize> {
    /// U; below the diagonal stands what is left of the work.
    upper: [[f64; N]; N],
    inverse_diagonal: [f64; N],
}

impl<const N: usize> Cholesky<N> {
    /// Of a symmetric matrix; only what is on and above its diagonal is read. `None` if it is not positive definite.
    #[inline(always)]
    pub fn new(matrix: [[f64; N]; N]) -> Option<Self> {
        let mut upper = matrix;
        let mut inverse_diagonal = [0.0; N];
        for i in 0..N {
            let mut row = upper[i];
            for above in &upper[..i] {
                let factor = above[i];
                for (value, above) in row.iter_mut().zip(above) {
                    *value -= factor * above;
                }
            }
            let pivot = row[i];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return None;
            }
            inverse_diagonal[i] = 1.0 / pivot.sqrt();
            upper[i] = row.map(|value| value * inverse_diagonal[i]);
        }
        Some(Self { upper, inverse_diagonal })
    }

    /// A⁻¹ b.
    #[inline(always)]
    pub fn solve(&self, right: &[f64; N]) -> [f64; N] {
        let mut x = self.whitened(right.map(|value| [value])).map(|[value]| value);
        for i in (0..N).rev() {
            let known: f64 = (i + 1..N).map(|k| self.upper[i][k] * x[k]).sum();
            x[i] = (x[i] - known) * self.inverse_diagonal[i];
        }
        x
    }

    /// U⁻ᵀ times rows: what has the covariance A has the covariance 1 then.
    #[inline(always)]
    pub fn whitened<const M: usize>(&self, mut rows: [[f64; M]; N]) -> [[f64; M]; N] {
        for i in 0..N {
            let mut row = rows[i];
            for (k, above) in rows[..i].iter().enumerate() {
                let factor = self.upper[k][i];
                for (value, above) in row.iter_mut().zip(above) {
                    *value -= factor * above;
                }
            }
            rows[i] = row.map(|value| value * self.inverse_diagonal[i]);
        }
        rows
    }

    /// A⁻¹.
    pub fn inverse(&self) -> [[f64; N]; N] {
        let mut identity = [[0.0; N]; N];
        (0..N).for_each(|k| identity[k][k] = 1.0);
        let mut inverse = [[0.0; N]; N];
        self.whitened_products(&identity, &mut inverse);
        inverse
    }

    /// [`Cholesky::new`] as fast as the processor can.
    pub fn of(matrix: &[[f64; N]; N]) -> Option<Self> {
        fastest(Decomposition(matrix))
    }

    /// Products of columns of [`Cholesky::whitened`] rows: RᵀA⁻¹R, as fast as the processor can.
    pub fn whitened_products<const M: usize>(&self, rows: &[[f64; M]; N], into: &mut [[f64; M]; M]) {
        fastest(WhitenedProducts { of: self, rows, into });
    }
}

struct Decomposition<'a, const N: usize>(&'a [[f64; N]; N]);

impl<const N: usize> Kernel for Decomposition<'_, N> {
    type Output = Option<Cholesky<N>>;

    #[inline(always)]
    fn run<V: Vector>(self) -> Self::Output {
        Cholesky::new(*self.0)
    }
}

struct WhitenedProducts<'a, const N: usize, const M: usize> {
    of: &'a Cholesky<N>,
    rows: &'a [[f64; M]; N],
    into: &'a mut [[f64; M]; M],
}

impl<const N: usize, const M: usize> Kernel for WhitenedProducts<'_, N, M> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        *self.into = products(&self.of.whitened(*self.rows));
    }
}

/// Sums over rows of the products of their columns: RᵀR.
#[inline(always)]
pub fn products<const N: usize, const M: usize>(rows: &[[f64; M]; N]) -> [[f64; M]; M] {
    let mut sums = [[0.0; M]; M];
    for (i, out) in sums.iter_mut().enumerate() {
        let mut sum = [0.0; M];
        for row in rows {
            let factor = row[i];
            for (sum, value) in sum.iter_mut().zip(row) {
                *sum += factor * value;
            }
        }
        *out = sum;
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 5;

    fn matrix() -> [[f64; N]; N] {
        let rows: [[f64; N]; 7] =
            std::array::from_fn(|i| std::array::from_fn(|j| ((3 * i + 7 * j) as f64).sin()));
        let mut matrix = products(&rows);
        (0..N).for_each(|k| matrix[k][k] += 0.5);
        matrix
    }

    #[test]
    fn a_solution_solves_and_an_inverse_inverts() {
        const TOLERANCE: f64 = 1e-9;
        let matrix = matrix();
        let sut = Cholesky::new(matrix).expect("positive");
        let right = [1.0, -2.0, 0.5, 3.0, 0.0];
        let (solution, inverse) = (sut.solve(&right), sut.inverse());
        for i in 0..N {
            let sum = |column: &dyn Fn(usize) -> f64| (0..N).map(|k| matrix[i][k] * column(k)).sum::<f64>();
            assert!((sum(&|k| solution[k]) - right[i]).abs() < TOLERANCE);
            for j in 0..N {
                let expected = f64::from(u8::from(i == j));
                assert!((sum(&|k| inverse[k][j]) - expected).abs() < TOLERANCE);
            }
        }
    }

    #[test]
    fn what_is_not_positive_has_none() {
        let mut indefinite = matrix();
        indefinite[3][3] = -1.0;
        assert_eq!(Cholesky::new(indefinite), None);
        assert_eq!(Cholesky::new([[f64::NAN; 2]; 2]), None);
    }
}
