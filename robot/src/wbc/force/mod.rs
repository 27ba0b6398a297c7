//! Contact forces: the paper's quadratic program with the slack δ_t eliminated, and with torque limits.
//!
//! The torso's six equations of motion, with the joints' accelerations in them,
//!
//! ```text
//! A_tt (q̈_t + δ_t) + A_tj q̈_j + b_t + g_t = J_ctᵀ f
//! ```
//! give δ_t = B f - d with B = A_tt⁻¹ J_ctᵀ and d = A_tt⁻¹ (A_t q̈ + b_t + g_t). What remains is
//!
//! ```text
//! min  fᵀ Q_1 f + (B f - d)ᵀ Q_2 (B f - d)
//! s.t. |f_x|, |f_y| <= µ f_z,   f_min <= f_z <= f_max,   τ_min <= τ_0 + T f <= τ_max
//! ```
//! over the 3n forces of n points. The torques of the loaded legs' joints are affine in the forces: with
//! τ = A (q̈ + δ_t) + b + g - J_cᵀ f, τ_0 is the torque without forces and T = A_jt B - J_cjᵀ.
//!
//! Forces and d are in units of the robot's weight, torques in body weights times a metre: solvers stop at
//! absolute tolerances, and in newtons they stop newtons away. There are always forces within pyramids and
//! normal forces; the torque limits may leave none.

mod active_set;
mod interior_point;

pub use active_set::ActiveSet;
pub use interior_point::InteriorPoint;

use super::ForceFailure;

/// Most points of contact: four feet, two knees.
pub const MAX_POINTS: usize = 6;
/// Most unknowns: three for each point.
pub const MAX_FORCES: usize = 3 * MAX_POINTS;
/// Most joints with torque limits: those of four legs.
pub const MAX_TORQUES: usize = 12;
/// Constraints of each point's force.
pub const ROWS_PER_POINT: usize = 6;
/// Forces of the points in contact, three for each point, in body weights.
pub type Forces = [f64; MAX_FORCES];

/// min ½ fᵀ H f + hᵀ f within pyramids and torque limits; entries beyond 3 `feet` are not used.
#[derive(Debug, Clone)]
pub struct ForceProblem {
    /// How many points stand on the ground.
    pub points: usize,
    /// H = Q_1 + Bᵀ Q_2 B, symmetric and positive definite.
    pub hessian: [[f64; MAX_FORCES]; MAX_FORCES],
    /// h = -Bᵀ Q_2 d.
    pub gradient: Forces,
    /// µ
    pub friction: f64,
    /// Least vertical force of each point.
    pub min_vertical: [f64; MAX_POINTS],
    /// Greatest vertical force of each point.
    pub max_vertical: [f64; MAX_POINTS],
    /// Torque limits of the loaded legs.
    pub torque: TorqueLimits,
}

/// lower <= T f <= upper for some joints.
#[derive(Debug, Clone)]
pub struct TorqueLimits {
    /// How many joints: three for each leg that stands, or none.
    pub joints: usize,
    /// T, a row for each joint, m.
    pub from_forces: [[f64; MAX_FORCES]; MAX_TORQUES],
    /// τ_min - τ_0, body weights times a metre.
    pub lower: [f64; MAX_TORQUES],
    /// τ_max - τ_0, body weights times a metre.
    pub upper: [f64; MAX_TORQUES],
}

/// Finds the forces.
pub trait ForceSolver {
    /// Writes the optimal forces, or says why there are none and leaves `forces` in any state.
    fn solve(&mut self, problem: &ForceProblem, forces: &mut Forces) -> Result<(), ForceFailure>;
}

impl ForceProblem {
    /// Of no points.
    pub const fn new(friction: f64) -> Self {
        Self {
            points: 0,
            hessian: [[0.0; MAX_FORCES]; MAX_FORCES],
            gradient: [0.0; MAX_FORCES],
            friction,
            min_vertical: [0.0; MAX_POINTS],
            max_vertical: [0.0; MAX_POINTS],
            torque: TorqueLimits::NONE,
        }
    }

    /// Number of unknowns.
    pub const fn unknowns(&self) -> usize {
        3 * self.points
    }

    /// Number of constraints on single points; those on torques follow.
    pub const fn point_rows(&self) -> usize {
        ROWS_PER_POINT * self.points
    }

    /// Number of constraints.
    pub const fn rows(&self) -> usize {
        self.point_rows() + 2 * self.torque.joints
    }

    /// Right-hand side of a constraint n · f >= bound.
    ///
    /// First come, point by point, the four sides of the pyramid, least and greatest vertical force; then,
    /// joint by joint, least and greatest torque.
    pub fn bound(&self, index: usize) -> f64 {
        if index < self.point_rows() {
            let point = index / ROWS_PER_POINT;
            return match index % ROWS_PER_POINT {
                4 => self.min_vertical[point],
                5 => -self.max_vertical[point],
                _ => 0.0,
            };
        }
        let row = index - self.point_rows();
        if row.is_multiple_of(2) { self.torque.lower[row / 2] } else { -self.torque.upper[row / 2] }
    }

    /// n of a constraint.
    pub fn normal(&self, index: usize) -> Forces {
        let mut normal = [0.0; MAX_FORCES];
        if index < self.point_rows() {
            let mu = self.friction;
            let own = match index % ROWS_PER_POINT {
                0 => [-1.0, 0.0, mu],
                1 => [1.0, 0.0, mu],
                2 => [0.0, -1.0, mu],
                3 => [0.0, 1.0, mu],
                4 => [0.0, 0.0, 1.0],
                _ => [0.0, 0.0, -1.0],
            };
            let point = index / ROWS_PER_POINT;
            normal[3 * point..3 * point + 3].copy_from_slice(&own);
            return normal;
        }
        let row = index - self.point_rows();
        let sign = if row.is_multiple_of(2) { 1.0 } else { -1.0 };
        for (entry, from) in normal.iter_mut().zip(&self.torque.from_forces[row / 2][..self.unknowns()]) {
            *entry = sign * from;
        }
        normal
    }

    /// How far forces are inside a constraint (negative: outside).
    pub fn slack(&self, index: usize, forces: &Forces) -> f64 {
        let normal = self.normal(index);
        normal.iter().zip(forces).map(|(entry, force)| entry * force).sum::<f64>() - self.bound(index)
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
        let finite = |entries: &[f64]| entries.iter().all(|entry| entry.is_finite());
        finite(&self.gradient[..used])
            && self.hessian[..used].iter().all(|row| finite(&row[..used]))
            && self.torque.from_forces[..self.torque.joints].iter().all(|row| finite(&row[..used]))
            && finite(&self.torque.lower[..self.torque.joints])
            && finite(&self.torque.upper[..self.torque.joints])
    }
}

impl TorqueLimits {
    /// Of no joints.
    pub const NONE: Self = Self {
        joints: 0,
        from_forces: [[0.0; MAX_FORCES]; MAX_TORQUES],
        lower: [0.0; MAX_TORQUES],
        upper: [0.0; MAX_TORQUES],
    };

    /// T f of a joint.
    pub fn torque(&self, joint: usize, forces: &Forces) -> f64 {
        self.from_forces[joint].iter().zip(forces).map(|(from, force)| from * force).sum()
    }
}
