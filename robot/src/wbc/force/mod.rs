//! Contact forces: the paper's quadratic program with the slack δ_t eliminated.
//!
//! The torso's six equations of motion, with the joints' accelerations in them,
//!
//! ```text
//! A_tt (q̈_t + δ_t) + A_tj q̈_j + b_t + g_t = J_ctᵀ f
//! ```
//! give δ_t = B f - d with B = A_tt⁻¹ J_ctᵀ and d = A_tt⁻¹ (A_t q̈ + b_t + g_t). What remains is
//!
//! ```text
//! min  fᵀ Q_1 f + (B f - d)ᵀ Q_2 (B f - d)    s.t.  |f_x|, |f_y| <= µ f_z,  f_min <= f_z <= f_max
//! ```
//! over the 3n forces of n feet. Forces and d are in units of the robot's weight: solvers stop at absolute
//! tolerances, and in newtons they stop newtons away. There are always forces that satisfy the constraints.

mod active_set;
mod interior_point;

pub use active_set::ActiveSet;
pub use interior_point::InteriorPoint;

use super::ForceFailure;

/// Most unknowns: three for each foot.
pub const MAX_FORCES: usize = 12;
/// Constraints of each foot.
pub const ROWS_PER_FOOT: usize = 6;
/// Forces of the feet in contact, three for each foot, in body weights.
pub type Forces = [f64; MAX_FORCES];

/// min ½ fᵀ H f + hᵀ f within each foot's friction pyramid; entries beyond 3 `feet` are not used.
#[derive(Debug, Clone)]
pub struct ForceProblem {
    /// How many feet stand on the ground.
    pub feet: usize,
    /// H = Q_1 + Bᵀ Q_2 B, symmetric and positive definite.
    pub hessian: [[f64; MAX_FORCES]; MAX_FORCES],
    /// h = -Bᵀ Q_2 d.
    pub gradient: Forces,
    /// µ
    pub friction: f64,
    /// Least vertical force of each foot.
    pub min_vertical: [f64; 4],
    /// Greatest vertical force of each foot.
    pub max_vertical: [f64; 4],
}

/// A constraint n · f >= bound on one foot's force.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Which of the feet in contact.
    pub foot: usize,
    /// n
    pub normal: [f64; 3],
    /// Its right-hand side.
    pub bound: f64,
}

/// Finds the forces.
pub trait ForceSolver {
    /// Writes the optimal forces, or says why there are none and leaves `forces` in any state.
    fn solve(&mut self, problem: &ForceProblem, forces: &mut Forces) -> Result<(), ForceFailure>;
}

impl ForceProblem {
    /// Number of unknowns.
    pub const fn unknowns(&self) -> usize {
        3 * self.feet
    }

    /// Number of constraints.
    pub const fn rows(&self) -> usize {
        ROWS_PER_FOOT * self.feet
    }

    /// W f >= bound, one row of it: four sides of the pyramid, least and greatest vertical force, foot by
    /// foot.
    pub fn row(&self, index: usize) -> Row {
        let foot = index / ROWS_PER_FOOT;
        let mu = self.friction;
        let (normal, bound) = match index % ROWS_PER_FOOT {
            0 => ([-1.0, 0.0, mu], 0.0),
            1 => ([1.0, 0.0, mu], 0.0),
            2 => ([0.0, -1.0, mu], 0.0),
            3 => ([0.0, 1.0, mu], 0.0),
            4 => ([0.0, 0.0, 1.0], self.min_vertical[foot]),
            _ => ([0.0, 0.0, -1.0], -self.max_vertical[foot]),
        };
        Row { foot, normal, bound }
    }

    /// How far the forces are inside the constraint (negative: outside).
    pub fn slack(&self, index: usize, forces: &Forces) -> f64 {
        let row = self.row(index);
        let force = &forces[3 * row.foot..3 * row.foot + 3];
        row.normal[0] * force[0] + row.normal[1] * force[1] + row.normal[2] * force[2] - row.bound
    }

    /// H f + h
    pub fn cost_gradient(&self, forces: &Forces) -> Forces {
        let mut gradient = self.gradient;
        for row in 0..self.unknowns() {
            for column in 0..self.unknowns() {
                gradient[row] += self.hessian[row][column] * forces[column];
            }
        }
        gradient
    }

    /// Whether all numbers in use are finite.
    pub fn is_finite(&self) -> bool {
        let used = self.unknowns();
        self.gradient[..used].iter().all(|entry| entry.is_finite())
            && self.hessian[..used].iter().all(|row| row[..used].iter().all(|entry| entry.is_finite()))
    }
}
