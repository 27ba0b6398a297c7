//! Strict priorities: each task moves only what all tasks before it leave free.
//!
//! The paper projects with N_i; here no 24x24 projector is ever built. The rows that are already used span a
//! subspace with orthonormal basis Q, so N = 1 - Q Qᵀ, and what is left of a task's Jacobian is
//!
//! ```text
//! J_pre = J N = J - (J Q) Qᵀ = U Σ Vᵀ
//! x    += J_pre† (target - J x)          x stays in the span of Q and V
//! Q    ← [Q V]                           the exact recursion N ← N (1 - J_pre† J_pre)
//! ```
//! so that J x of every earlier task is unchanged to rounding. (With the paper's product of the N_{i|i-1},
//! which do not commute, lower tasks move stance feet.)
//!
//! The dynamically consistent inverse is the same recursion in other coordinates: with A = LᵀL and y = L q̈,
//! J‡ = A⁻¹Jᵀ(J A⁻¹Jᵀ)⁻¹ becomes (J L⁻¹)† (see [`super::inertia`]).

use nalgebra::{Matrix3, Vector3};

use crate::dynamics::DOF;

/// Three rows of a Jacobian.
pub(super) type Rows = [[f64; DOF]; 3];

/// Directions whose singular value is below this share of the task's Jacobian are none.
const RANK_TOLERANCE: f64 = 1e-7;

/// Above this share one pass of Gram-Schmidt leaves directions orthogonal to 1e-14.
const WELL_CONDITIONED: f64 = 0.1;

/// Solutions of a stack of tasks, for `N` right-hand sides at once.
#[derive(Debug, Clone)]
pub(super) struct TaskChain<const N: usize> {
    basis: [[f64; DOF]; DOF],
    rank: usize,
    solutions: [[f64; DOF]; N],
}

/// A chain as it was after some of its tasks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mark<const N: usize> {
    rank: usize,
    solutions: [[f64; DOF]; N],
}

/// J_pre = U Σ Vᵀ of a task of three rows.
#[derive(Debug, Clone)]
pub(super) struct Projected {
    /// U, by columns.
    left: Matrix3<f64>,
    /// Σ; zero where no direction is left.
    singular: [f64; 3],
    /// V, a row for each singular value that is not zero.
    directions: Rows,
}

impl Projected {
    /// How much of an error along each left direction is to be followed: all of it when the singular value σ
    /// is at least `start`, and (σ / start)² below.
    ///
    /// It makes of 1/σ the damped σ / (σ² + λ²) with λ² = start² - σ²: exact away from singularities,
    /// continuous into them, and never above 1 / start.
    pub(super) fn damping(&self, start: f64) -> Matrix3<f64> {
        let kept = self.singular.map(|sigma| if sigma >= start { 1.0 } else { (sigma / start).powi(2) });
        self.left * Matrix3::from_diagonal(&Vector3::from(kept)) * self.left.transpose()
    }
}

impl<const N: usize> TaskChain<N> {
    pub(super) const fn new() -> Self {
        Self { basis: [[0.0; DOF]; DOF], rank: 0, solutions: [[0.0; DOF]; N] }
    }

    /// Forgets all tasks.
    pub(super) fn clear(&mut self) {
        self.rank = 0;
        self.solutions = [[0.0; DOF]; N];
    }

    /// To come back to with [`Self::rewind`].
    pub(super) const fn mark(&self) -> Mark<N> {
        Mark { rank: self.rank, solutions: self.solutions }
    }

    /// Forgets the tasks since a mark.
    pub(super) const fn rewind(&mut self, mark: &Mark<N>) {
        self.rank = mark.rank;
        self.solutions = mark.solutions;
    }

    pub(super) fn solution(&self, index: usize) -> &[f64; DOF] {
        &self.solutions[index]
    }

    /// J_pre and its singular value decomposition.
    pub(super) fn project(&self, rows: &Rows) -> Projected {
        let mut free = *rows;
        self.remove_used(&mut free);
        let gram = Matrix3::from_fn(|row, column| dot(&free[row], &free[column]));
        let (left, squares) = eigen(gram);
        let size = rows.iter().map(|row| dot(row, row)).sum::<f64>().sqrt();

        let mut projected = Projected { left, singular: [0.0; 3], directions: [[0.0; DOF]; 3] };
        for index in 0..3 {
            let singular = squares[index].max(0.0).sqrt();
            // The last condition keeps rounding from offering more directions than there are.
            if singular <= RANK_TOLERANCE * size || self.rank + index >= DOF {
                continue;
            }
            let mut direction = [0.0; DOF];
            for row in 0..3 {
                add(&mut direction, left[(row, index)] / singular, &free[row]);
            }
            // Where 1/σ blew rounding up, once more.
            if singular < WELL_CONDITIONED * size {
                self.remove_used(std::array::from_mut(&mut direction));
            }
            for sibling in 0..index {
                let along = dot(&projected.directions[sibling], &direction);
                add(&mut direction, -along, &projected.directions[sibling]);
            }
            let length = dot(&direction, &direction).sqrt();
            projected.singular[index] = singular;
            projected.directions[index] = direction.map(|entry| entry / length);
        }
        projected
    }

    /// x += J_pre† D (target - J x) for each right-hand side, with D from [`Projected::damping`]; then the
    /// task's directions are used up.
    pub(super) fn track(
        &mut self,
        rows: &Rows,
        projected: &Projected,
        damping: &Matrix3<f64>,
        targets: &[Vector3<f64>; N],
    ) {
        for (solution, target) in self.solutions.iter_mut().zip(targets) {
            let reached = Vector3::from_fn(|row, _| dot(&rows[row], solution));
            let step = projected.left.transpose() * (damping * (target - reached));
            for index in 0..3 {
                if projected.singular[index] > 0.0 {
                    add(solution, step[index] / projected.singular[index], &projected.directions[index]);
                }
            }
        }
        for index in 0..3 {
            if projected.singular[index] > 0.0 && self.rank < DOF {
                self.basis[self.rank] = projected.directions[index];
                self.rank += 1;
            }
        }
    }

    /// rows ← rows (1 - Q Qᵀ), by modified Gram-Schmidt; the rows side by side keep the processor busy.
    fn remove_used<const ROWS: usize>(&self, rows: &mut [[f64; DOF]; ROWS]) {
        for used in &self.basis[..self.rank] {
            let along: [f64; ROWS] = std::array::from_fn(|row| dot(used, &rows[row]));
            for (row, along) in rows.iter_mut().zip(along) {
                add(row, -along, used);
            }
        }
    }
}

/// Eigenvectors (columns) and eigenvalues, greatest first, of a symmetric matrix, by cyclic Jacobi rotations.
fn eigen(mut matrix: Matrix3<f64>) -> (Matrix3<f64>, [f64; 3]) {
    /// Converges quadratically: three or four sweeps are the rule.
    const SWEEPS: usize = 12;
    let mut vectors = Matrix3::identity();
    for _ in 0..SWEEPS {
        let off = matrix[(0, 1)].powi(2) + matrix[(0, 2)].powi(2) + matrix[(1, 2)].powi(2);
        if off <= f64::EPSILON.powi(2) * matrix.diagonal().norm_squared() {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut matrix, &mut vectors, p, q);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_unstable_by(|a, b| matrix[(*b, *b)].total_cmp(&matrix[(*a, *a)]));
    let sorted = Matrix3::from_fn(|row, column| vectors[(row, order[column])]);
    (sorted, order.map(|index| matrix[(index, index)]))
}

/// One Jacobi rotation: makes entry (p, q) zero.
fn rotate(matrix: &mut Matrix3<f64>, vectors: &mut Matrix3<f64>, p: usize, q: usize) {
    let off = matrix[(p, q)];
    if off == 0.0 {
        return;
    }
    let theta = (matrix[(q, q)] - matrix[(p, p)]) / (2.0 * off);
    let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let cos = 1.0 / tangent.hypot(1.0);
    let sin = tangent * cos;
    for index in 0..3 {
        let (a, b) = (matrix[(index, p)], matrix[(index, q)]);
        matrix[(index, p)] = cos * a - sin * b;
        matrix[(index, q)] = sin * a + cos * b;
    }
    for index in 0..3 {
        let (a, b) = (matrix[(p, index)], matrix[(q, index)]);
        matrix[(p, index)] = cos * a - sin * b;
        matrix[(q, index)] = sin * a + cos * b;
        let (a, b) = (vectors[(index, p)], vectors[(index, q)]);
        vectors[(index, p)] = cos * a - sin * b;
        vectors[(index, q)] = sin * a + cos * b;
    }
}

/// a · b, with partial sums that the processor can keep apart.
pub(super) fn dot(a: &[f64; DOF], b: &[f64; DOF]) -> f64 {
    let mut sums = [0.0; 4];
    for block in 0..DOF / 4 {
        for lane in 0..4 {
            sums[lane] += a[4 * block + lane] * b[4 * block + lane];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// a += factor b
fn add(a: &mut [f64; DOF], factor: f64, b: &[f64; DOF]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a += factor * b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(seed: usize) -> [f64; DOF] {
        std::array::from_fn(|index| ((seed * 37 + index * 17) % 23) as f64 / 11.5 - 1.0)
    }

    #[test]
    fn the_eigenvectors_of_a_symmetric_matrix_rebuild_it() {
        let matrix = Matrix3::new(4.0, 1.0, -2.0, 1.0, 3.0, 0.5, -2.0, 0.5, 1.0);
        let (vectors, values) = eigen(matrix);
        let rebuilt = vectors * Matrix3::from_diagonal(&Vector3::from(values)) * vectors.transpose();
        assert!((rebuilt - matrix).amax() < 1e-14);
        assert!(values[0] >= values[1] && values[1] >= values[2]);
    }

    #[test]
    fn a_lower_task_does_not_disturb_a_higher_one() {
        let mut sut = TaskChain::<1>::new();
        let high = [row(1), row(2), row(3)];
        // Shares a direction with the higher task.
        let low = [row(4), row(1), row(5)];
        let wish = Vector3::new(1.0, -2.0, 3.0);
        for rows in [&high, &low] {
            let projected = sut.project(rows);
            let damping = projected.damping(1e-3);
            sut.track(rows, &projected, &damping, &[wish]);
        }
        let reached = Vector3::from_fn(|index, _| dot(&high[index], sut.solution(0)));
        assert!((reached - wish).amax() < 1e-12);
        assert_eq!(sut.rank, 5);
    }

    #[test]
    fn damping_bounds_the_solution_and_is_continuous_where_it_starts() {
        const START: f64 = 0.05;
        let answer = |sigma: f64| {
            let mut rows = [[0.0; DOF]; 3];
            (rows[0][0], rows[1][1], rows[2][2]) = (1.0, 1.0, sigma);
            let mut sut = TaskChain::<1>::new();
            let projected = sut.project(&rows);
            let damping = projected.damping(START);
            sut.track(&rows, &projected, &damping, &[Vector3::new(0.0, 0.0, 1.0)]);
            sut.solution(0)[2]
        };
        assert!((answer(0.2) - 5.0).abs() < 1e-12);
        assert!((answer(START * 1.0001) - answer(START * 0.9999)).abs() < 0.01);
        for sigma in [0.049, 0.03, 0.01, 1e-3, 1e-9, 0.0] {
            assert!(answer(sigma) <= 1.0 / START);
        }
        assert!(answer(1e-4) < 0.05);
    }
}
