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
//! so that J x of every earlier task is unchanged to rounding. x is kept along Q, where J x is (J Q) times its
//! coordinates, and J Q is known from the projection. (With the paper's product of the N_{i|i-1},
//! which do not commute, lower tasks move stance feet.)
//!
//! The dynamically consistent inverse is the same recursion in other coordinates: with A = LᵀL and y = L q̈,
//! J‡ = A⁻¹Jᵀ(J A⁻¹Jᵀ)⁻¹ becomes (J L⁻¹)† (see [`super::inertia`]).

use nalgebra::{Matrix3, Vector3};

use crate::dynamics::DOF;

/// Three rows of a Jacobian; rows that are zero come last.
pub(super) type Rows = [[f64; DOF]; 3];

/// Directions whose singular value is below this share of the task's Jacobian are not followed; but they are used up,
/// so that no lower task moves along them what this one controls.
const RANK_TOLERANCE: f64 = 1e-7;

/// What is below this share is rounding, and no direction.
const ROUNDING: f64 = 1e-11;

/// Below this share a task's triangular factor is not inverted: its singular values are looked at.
const REGULAR: f64 = 1e-4;

/// Where Gram-Schmidt leaves less than this share of a row, rounding is left too, and it goes over it again:
/// directions are orthogonal to 1e-14.
const CANCELLED: f64 = 0.02;

/// Solutions of a stack of tasks, for `N` right-hand sides at once.
#[derive(Debug, Clone)]
pub(super) struct TaskChain<const N: usize> {
    /// Q by rows, and room for the directions of the next task.
    basis: [[f64; DOF]; DOF + 3],
    /// How many directions are used up.
    rank: usize,
    /// J Q of the task that was projected last.
    seen: Rows,
    /// x of each right-hand side, along Q.
    coordinates: [[f64; DOF + 3]; N],
}

/// What is left of a task: J_pre† = V S with V the directions that the chain keeps for it.
#[derive(Debug, Clone)]
pub(super) struct Projected {
    /// How many directions.
    count: usize,
    /// S, a row for each direction.
    inverse: Matrix3<f64>,
    /// D: how much of the error is to be followed; nothing stands for all of it.
    pub(super) damping: Option<Matrix3<f64>>,
}

impl<const N: usize> TaskChain<N> {
    pub(super) const fn new() -> Self {
        Self {
            basis: [[0.0; DOF]; DOF + 3],
            rank: 0,
            seen: [[0.0; DOF]; 3],
            coordinates: [[0.0; DOF + 3]; N],
        }
    }

    /// Forgets all tasks.
    pub(super) const fn clear(&mut self) {
        self.rank = 0;
    }

    /// x of a right-hand side.
    pub(super) fn solution(&self, index: usize) -> [f64; DOF] {
        let mut solution = [0.0; DOF];
        for (direction, coordinate) in self.basis.iter().zip(&self.coordinates[index]).take(self.rank) {
            add(&mut solution, *coordinate, direction);
        }
        solution
    }

    /// J_pre, its directions and its inverse; `start` says where damping starts, 0 for none.
    ///
    /// J_preᵀ = V Lᵀ by Gram-Schmidt gives J_pre† = V L⁻¹. Only where the least singular value σ of L may be
    /// below `start`, or L is nearly singular, are singular values computed: see [`Self::fade`].
    pub(super) fn project(&mut self, rows: &Rows, start: f64) -> Projected {
        let sizes = rows.each_ref().map(|row| dot(row, row));
        let size = (sizes[0] + sizes[1] + sizes[2]).sqrt();
        let lower = self.orthogonalized(rows, &sizes);
        let count = sizes.iter().filter(|size| **size > 0.0).count();
        let leading = sizes[..count].iter().all(|size| *size > 0.0);
        let regular = leading && self.rank + count <= DOF;
        if regular && least_singular_value_exceeds(&lower, count, start.max(REGULAR * size)) {
            return Projected { count, inverse: inverse_of(&lower, count), damping: None };
        }
        self.fade(&lower, start, size)
    }

    /// Splits rows into what the chain has used (J Q, kept in `seen`) and what is left, L V with orthonormal
    /// directions V, kept at the end of the basis. Returns L.
    fn orthogonalized(&mut self, rows: &Rows, sizes: &[f64; 3]) -> Matrix3<f64> {
        let (used, free) = self.basis.split_at_mut(self.rank);
        let mut left = *rows;
        for (k, direction) in used.iter().enumerate() {
            let along: [f64; 3] = std::array::from_fn(|row| dot(direction, &left[row]));
            for row in 0..3 {
                add(&mut left[row], -along[row], direction);
                self.seen[row][k] = along[row];
            }
        }
        let mut lower = Matrix3::zeros();
        for row in 0..3 {
            let (before, rest) = free.split_at_mut(row);
            let direction = &mut left[row];
            let mut length = sizes[row].sqrt();
            for pass in 0..3 {
                if pass > 0 {
                    for unit in used.iter() {
                        remove(direction, unit);
                    }
                }
                for (column, sibling) in before.iter().enumerate() {
                    lower[(row, column)] += remove(direction, sibling);
                }
                let longer = std::mem::replace(&mut length, dot(direction, direction).sqrt());
                if length >= CANCELLED * longer {
                    break;
                }
            }
            // What is left of a row that depends on others is rounding.
            let something = length > ROUNDING * sizes[row].sqrt();
            lower[(row, row)] = if something { length } else { 0.0 };
            let scale = if something { 1.0 / length } else { 0.0 };
            rest[0] = direction.map(|entry| entry * scale);
        }
        lower
    }

    /// The same from the singular values, L = U Σ Wᵀ: of an error along the left direction of σ, all is
    /// followed when σ is at least `start`, and (σ / start)² below.
    ///
    /// It makes of 1/σ the damped σ / (σ² + λ²) with λ² = start² - σ²: exact away from singularities,
    /// continuous into them, and never above 1 / start. `size` is that of the task's Jacobian.
    fn fade(&mut self, lower: &Matrix3<f64>, start: f64, size: f64) -> Projected {
        let left = eigenvectors(lower * lower.transpose());
        let mut projected = Projected { count: 0, inverse: Matrix3::zeros(), damping: None };
        let mut kept = [0.0; 3];
        let mut turn = Matrix3::zeros();
        for index in 0..3 {
            let image = left.column(index).transpose() * lower;
            // The eigenvalue's root would be off by 1e-8.
            let singular = image.norm();
            kept[index] = if singular >= start { 1.0 } else { (singular / start).powi(2) };
            // The last condition keeps rounding from offering more directions than there are.
            if singular <= ROUNDING * size || self.rank + projected.count >= DOF {
                continue;
            }
            let mut row = image / singular;
            for sibling in 0..projected.count {
                let along = turn.row(sibling).dot(&row);
                row -= turn.row(sibling) * along;
            }
            let length = row.norm();
            // Of two that are nearly nothing, the second may be the first again.
            if length < CANCELLED {
                continue;
            }
            turn.set_row(projected.count, &(row / length));
            if singular > RANK_TOLERANCE * size {
                projected.inverse.set_row(projected.count, &(left.column(index).transpose() / singular));
            }
            projected.count += 1;
        }
        if start > 0.0 {
            projected.damping = Some(left * Matrix3::from_diagonal(&Vector3::from(kept)) * left.transpose());
        }
        self.turn(&turn);
        projected
    }

    /// Combines the directions of the last task.
    fn turn(&mut self, turn: &Matrix3<f64>) {
        let mut turned = [[0.0; DOF]; 3];
        for row in 0..3 {
            for column in 0..3 {
                add(&mut turned[row], turn[(row, column)], &self.basis[self.rank + column]);
            }
        }
        self.basis[self.rank..self.rank + 3].copy_from_slice(&turned);
    }

    /// x += J_pre† D (target - J x) for each right-hand side; then the directions of the task, which was
    /// projected last, are used up.
    pub(super) fn track(
        &mut self,
        projected: &Projected,
        damping: Option<&Matrix3<f64>>,
        targets: &[Vector3<f64>; N],
    ) {
        for (coordinates, target) in self.coordinates.iter_mut().zip(targets) {
            let reached = Vector3::from_fn(|row, _| {
                self.seen[row].iter().zip(&*coordinates).take(self.rank).map(|(seen, x)| seen * x).sum()
            });
            let missing = target - reached;
            let step = projected.inverse * damping.map_or(missing, |damping| damping * missing);
            for index in 0..projected.count {
                coordinates[self.rank + index] = step[index];
            }
        }
        self.rank += projected.count;
    }
}

/// Whether L Lᵀ - least² 1 is positive definite, for the first rows of L.
fn least_singular_value_exceeds(lower: &Matrix3<f64>, count: usize, least: f64) -> bool {
    let mut rest = lower * lower.transpose() - Matrix3::identity() * (least * least);
    for pivot in 0..count {
        if rest[(pivot, pivot)] <= 0.0 {
            return false;
        }
        for row in pivot + 1..count {
            let factor = rest[(row, pivot)] / rest[(pivot, pivot)];
            for column in pivot + 1..=row {
                rest[(row, column)] -= factor * rest[(column, pivot)];
            }
        }
    }
    true
}

/// L⁻¹ of the first rows of a lower triangle.
fn inverse_of(lower: &Matrix3<f64>, count: usize) -> Matrix3<f64> {
    let mut inverse = Matrix3::zeros();
    for row in 0..count {
        let pivot = 1.0 / lower[(row, row)];
        for column in 0..row {
            let sum: f64 = (column..row).map(|k| lower[(row, k)] * inverse[(k, column)]).sum();
            inverse[(row, column)] = -sum * pivot;
        }
        inverse[(row, row)] = pivot;
    }
    inverse
}

/// Eigenvectors (columns) of a symmetric matrix, that of the greatest eigenvalue first, by cyclic Jacobi rotations.
fn eigenvectors(mut matrix: Matrix3<f64>) -> Matrix3<f64> {
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
    Matrix3::from_fn(|row, column| vectors[(row, order[column])])
}

/// One Jacobi rotation: makes entry (p, q) zero.
fn rotate(matrix: &mut Matrix3<f64>, vectors: &mut Matrix3<f64>, p: usize, q: usize) {
    let off = matrix[(p, q)];
    if off == 0.0 {
        return;
    }
    let theta = (matrix[(q, q)] - matrix[(p, p)]) / (2.0 * off);
    let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let cos = 1.0 / (tangent * tangent + 1.0).sqrt();
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

/// a · b, with partial sums side by side for the processor's wide registers.
#[inline]
fn dot(a: &[f64; DOF], b: &[f64; DOF]) -> f64 {
    let mut sums = [0.0; 8];
    for (a, b) in a.as_chunks::<8>().0.iter().zip(b.as_chunks::<8>().0) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let halves: [f64; 4] = std::array::from_fn(|lane| sums[lane] + sums[4 + lane]);
    (halves[0] + halves[2]) + (halves[1] + halves[3])
}

/// a += factor b
fn add(a: &mut [f64; DOF], factor: f64, b: &[f64; DOF]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a += factor * b;
    }
}

/// Takes from a vector its part along a unit vector; returns how long that was.
fn remove(vector: &mut [f64; DOF], unit: &[f64; DOF]) -> f64 {
    let along = dot(vector, unit);
    add(vector, -along, unit);
    along
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
        let vectors = eigenvectors(matrix);
        let values = (vectors.transpose() * matrix * vectors).diagonal();
        let rebuilt = vectors * Matrix3::from_diagonal(&values) * vectors.transpose();
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
            let projected = sut.project(rows, 1e-3);
            sut.track(&projected, projected.damping.as_ref(), &[wish]);
        }
        let reached = Vector3::from_fn(|index, _| dot(&high[index], &sut.solution(0)));
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
            let projected = sut.project(&rows, START);
            sut.track(&projected, projected.damping.as_ref(), &[Vector3::new(0.0, 0.0, 1.0)]);
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
