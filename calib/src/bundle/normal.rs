//! The normal equations, and how they are solved: a banded part for the motion, bordered by cameras and parts.
//!
//! # Equations
//! With m the motion's parameters (blocks of six, each of which meets only its next few neighbours) and b the border's,
//!
//! ```text
//! | B   Eᵀ | |m|     |g_m|      B = L Lᵀ (block by block)      W = E L⁻ᵀ       w = L⁻¹ g_m
//! | E   C  | |b| = − |g_b|      S = C − W Wᵀ                   S b = −(g_b − W w)
//!                               m = −L⁻ᵀ (w + Wᵀ b)
//! ```
//!
//! (the Schur complement: Triggs et al., "Bundle adjustment: a modern synthesis", 1999). S⁻¹ is the border's covariance.
//! The work grows with the length of the recording, not with its square.

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use super::term::{Linear, WIDTH};

/// Keeps solvable what nothing is left to be said of, for all of it was set aside: information of a deviation of a
/// kilometre, or of a thousand radians.
const LEAST: f64 = 1e-6;

/// JᵀJ summed up, and the gradient.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    /// Of block i: its products with itself and with those after it.
    band: Vec<Vec<Matrix6<f64>>>,
    /// E: six columns a block.
    edge: DMatrix<f64>,
    /// C: its upper triangle.
    corner: DMatrix<f64>,
    motion_gradient: Vec<Vector6<f64>>,
    border_gradient: DVector<f64>,
}

/// A solution of the normal equations.
pub(super) struct Step {
    pub motion: Vec<Vector6<f64>>,
    pub border: DVector<f64>,
    /// What half the cost should lose by it.
    pub promise: f64,
}

impl Normal {
    pub fn new(blocks: usize, reach: usize, border: usize) -> Self {
        Self {
            band: vec![vec![Matrix6::zeros(); reach + 1]; blocks],
            edge: DMatrix::zeros(border, 6 * blocks),
            corner: DMatrix::zeros(border, border),
            motion_gradient: vec![Vector6::zeros(); blocks],
            border_gradient: DVector::zeros(border),
        }
    }

    pub fn clear(&mut self) {
        self.band.iter_mut().flatten().for_each(|block| block.fill(0.0));
        self.edge.fill(0.0);
        self.corner.fill(0.0);
        self.motion_gradient.iter_mut().for_each(|block| block.fill(0.0));
        self.border_gradient.fill(0.0);
    }

    /// Adds a sighting with a weight.
    pub fn add(&mut self, linear: &Linear, weight: f64) {
        let (width, motion) = (linear.width, 6 * linear.count);
        let residual = width - 1;
        let mut products = [[0.0; WIDTH]; WIDTH];
        for row in &linear.rows {
            for (a, out) in products[..width].iter_mut().enumerate() {
                let factor = row[a] * weight;
                for (out, value) in out[a..width].iter_mut().zip(&row[a..width]) {
                    *out += factor * value;
                }
            }
        }
        for block in 0..linear.count {
            for other in block..linear.count {
                let into = &mut self.band[linear.first + block][other - block];
                for i in 0..6 {
                    for j in 0..6 {
                        let (a, b) = (6 * block + i, 6 * other + j);
                        into[(i, j)] += if a <= b { products[a][b] } else { products[b][a] };
                    }
                }
            }
            for i in 0..6 {
                let a = 6 * block + i;
                self.motion_gradient[linear.first + block][i] += products[a][residual];
                let mut column = self.edge.column_mut(6 * (linear.first + block) + i);
                for (k, border) in linear.border[..linear.border_count].iter().enumerate() {
                    column[*border] += products[a][motion + k];
                }
            }
        }
        for k in 0..linear.border_count {
            let own = linear.border[k];
            self.border_gradient[own] += products[motion + k][residual];
            for l in k..linear.border_count {
                let other = linear.border[l];
                self.corner[(own.min(other), own.max(other))] += products[motion + k][motion + l];
            }
        }
    }

    /// Adds a prior on a parameter of the border, which has moved so far from its mean.
    pub fn add_prior(&mut self, column: usize, information: f64, moved: f64) {
        self.corner[(column, column)] += information;
        self.border_gradient[column] += information * moved;
    }

    /// Adds what joins some neighbouring blocks of the motion: `jacobians` of one residual of six numbers.
    pub fn add_motion(&mut self, first: usize, jacobians: &[Matrix6<f64>], residual: &Vector6<f64>) {
        for (a, left) in jacobians.iter().enumerate() {
            for (b, right) in jacobians.iter().enumerate().skip(a) {
                self.band[first + a][b - a] += left.tr_mul(right);
            }
            self.motion_gradient[first + a] += left.tr_mul(residual);
        }
    }

    /// Solves with the diagonal enlarged by a factor of 1 + `damping`; `None` if it is not positive.
    pub fn solve(&self, damping: f64) -> Option<Step> {
        let factors = Factors::new(self, damping)?;
        let whitened = factors.forward(&self.motion_gradient);
        let (border, mut motion) = match &factors.schur {
            Some(schur) => {
                let flat = DVector::from_iterator(
                    6 * whitened.len(),
                    whitened.iter().flat_map(|v| v.iter().copied()),
                );
                let right = &self.border_gradient - &factors.edge * &flat;
                let border = -schur.solve(&right);
                let back = factors.edge.tr_mul(&border) + flat;
                let motion: Vec<Vector6<f64>> =
                    (0..whitened.len()).map(|k| -Vector6::from(back.fixed_rows::<6>(6 * k))).collect();
                (border, motion)
            }
            None => (DVector::zeros(0), whitened.iter().map(|v| -v).collect()),
        };
        factors.backward(&mut motion);
        let slope = self.motion_gradient.iter().zip(&motion).map(|(g, m)| g.dot(m)).sum::<f64>()
            + self.border_gradient.dot(&border);
        let finite =
            border.iter().all(|x| x.is_finite()) && motion.iter().all(|b| b.iter().all(|x| x.is_finite()));
        finite.then_some(Step { motion, border, promise: -0.5 * slope })
    }

    /// Covariance of the border; `None` if something in it is not determined.
    pub fn border_covariance(&self) -> Option<DMatrix<f64>> {
        Factors::new(self, 0.0)?.schur.map(|schur| schur.inverse())
    }
}

/// B = L Lᵀ, W, and the factor of S.
struct Factors {
    /// Of block row i: L's diagonal block, and L(i + k, i) for k from 1.
    lower: Vec<Vec<Matrix6<f64>>>,
    edge: DMatrix<f64>,
    schur: Option<nalgebra::Cholesky<f64, nalgebra::Dyn>>,
}

impl Factors {
    fn new(normal: &Normal, damping: f64) -> Option<Self> {
        let mut lower = normal.band.clone();
        let mut edge = normal.edge.clone();
        let blocks = lower.len();
        for row in &mut lower {
            for k in 0..6 {
                row[0][(k, k)] = row[0][(k, k)] * (1.0 + damping) + LEAST;
            }
        }
        for i in 0..blocks {
            // What earlier blocks take off has been taken off already: the loop below looks ahead.
            let pivot = lower[i][0].cholesky()?.l();
            let inverse = pivot.try_inverse()?;
            let inverse_transposed = inverse.transpose();
            let reach = lower[i].len().min(blocks - i);
            // L(i + k, i) = B(i, i + k)ᵀ L(i, i)⁻ᵀ
            let below: Vec<Matrix6<f64>> =
                (1..reach).map(|k| lower[i][k].tr_mul(&inverse_transposed)).collect();
            for (a, left) in below.iter().enumerate() {
                for (b, right) in below.iter().enumerate().skip(a) {
                    lower[i + 1 + a][b - a] -= left * right.transpose();
                }
            }
            let own = edge.fixed_columns::<6>(6 * i) * inverse_transposed;
            edge.fixed_columns_mut::<6>(6 * i).copy_from(&own);
            for (a, left) in below.iter().enumerate() {
                let mut later = edge.fixed_columns_mut::<6>(6 * (i + 1 + a));
                later -= &own * left.transpose();
            }
            lower[i][0] = pivot;
            for (k, block) in below.into_iter().enumerate() {
                lower[i][k + 1] = block;
            }
        }
        let schur = match normal.corner.nrows() {
            0 => None,
            size => {
                let mut schur = normal.corner.clone();
                for k in 0..size {
                    schur[(k, k)] = schur[(k, k)] * (1.0 + damping) + LEAST;
                }
                schur.fill_lower_triangle_with_upper_triangle();
                schur.gemm(-1.0, &edge, &edge.transpose(), 1.0);
                Some(schur.cholesky()?)
            }
        };
        Some(Self { lower, edge, schur })
    }

    /// L⁻¹ g.
    fn forward(&self, gradient: &[Vector6<f64>]) -> Vec<Vector6<f64>> {
        let mut solved = gradient.to_vec();
        for i in 0..solved.len() {
            self.lower[i][0].solve_lower_triangular_mut(&mut solved[i]);
            let own = solved[i];
            for (k, block) in self.lower[i].iter().enumerate().skip(1) {
                if let Some(later) = solved.get_mut(i + k) {
                    *later -= block * own;
                }
            }
        }
        solved
    }

    /// L⁻ᵀ x, in place.
    fn backward(&self, x: &mut [Vector6<f64>]) {
        for i in (0..x.len()).rev() {
            for (k, block) in self.lower[i].iter().enumerate().skip(1) {
                if let Some(later) = x.get(i + k).copied() {
                    x[i] -= block.tr_mul(&later);
                }
            }
            let mut own = x[i];
            self.lower[i][0].tr_solve_lower_triangular_mut(&mut own);
            x[i] = own;
        }
    }
}
