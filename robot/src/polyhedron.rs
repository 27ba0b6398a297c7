//! The nearest point of a polyhedron: how the motion of a limb or of the torso is brought inside its limits, by the
//! whole-body controller and by the commander.
//!
//! ```text
//! minimize   ½ (d - w)ᵀ M (d - w) + ½/ρ Σ s_i²      over d in R⁶, s
//! subject to a_i · d + s_i ≥ b_i
//! ```
//! With M = L Lᵀ and z = Lᵀ (d - w) this is a least-norm problem, solved by the dual active-set method of Goldfarb and
//! Idnani ("A numerically stable dual method for solving strictly convex quadratic programs", Mathematical
//! Programming 27, 1983). A projection onto a convex set: the result is unique and moves no more than what is
//! projected does, so that limits which begin or cease to act cause no jump. The slack s, with its small ρ, makes
//! limits that contradict each other give way to each other in place of having no solution.

use nalgebra::{Matrix6, Vector6};

/// ρ, against rows of about length 1 in z: what is permitted is exceeded by a millionth of the multiplier.
const SOFTNESS: f64 = 1e-6;
/// Rows shorter than this in z cannot be changed by the joints.
const SHORTEST: f64 = 1e-6;
/// Excess that is none, as a share of a row's length in z.
const TOLERANCE: f64 = 1e-9;

/// Constraints a_i · d ≥ b_i on a motion.
#[derive(Debug, Clone)]
pub(crate) struct Polyhedron {
    rows: [Vector6<f64>; Self::MOST],
    bounds: [f64; Self::MOST],
    count: usize,
}

impl Polyhedron {
    /// The most constraints.
    pub(crate) const MOST: usize = 72;

    pub(crate) fn new() -> Self {
        Self { rows: [Vector6::zeros(); Self::MOST], bounds: [0.0; Self::MOST], count: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a · d ≥ b.
    pub(crate) fn push(&mut self, row: Vector6<f64>, bound: f64) {
        if self.count < Self::MOST && bound.is_finite() {
            self.rows[self.count] = row;
            self.bounds[self.count] = bound;
            self.count += 1;
        }
    }

    /// Whether a motion satisfies all.
    pub(crate) fn contains(&self, motion: &Vector6<f64>) -> bool {
        let constraints = self.rows.iter().zip(&self.bounds).take(self.count);
        constraints.into_iter().all(|(row, bound)| row.dot(motion) >= bound - 1e-12)
    }

    /// The motion nearest to a wanted one, w, in the metric M; nothing if M is not positive definite.
    pub(crate) fn nearest(&self, wanted: &Vector6<f64>, metric: &Matrix6<f64>) -> Option<Vector6<f64>> {
        if self.contains(wanted) {
            return Some(*wanted);
        }
        let lower = metric.cholesky()?.unpack();
        let mut rows = [Vector6::zeros(); Self::MOST];
        let mut bounds = [f64::NEG_INFINITY; Self::MOST];
        for (index, row) in self.rows[..self.count].iter().enumerate() {
            let mut z = *row;
            // L z = a; then of length 1.
            lower.solve_lower_triangular_mut(&mut z);
            let length = z.norm();
            if length > SHORTEST {
                rows[index] = z / length;
                bounds[index] = (self.bounds[index] - row.dot(wanted)) / length;
            }
        }
        let mut z = least_norm(&rows[..self.count], &bounds[..self.count]);
        lower.tr_solve_lower_triangular_mut(&mut z);
        let nearest = wanted + z;
        nearest.iter().all(|entry| entry.is_finite()).then_some(nearest)
    }
}

/// The constraints that act, and their multipliers: with the slack there may be more of them than dimensions.
struct Active {
    index: [usize; Polyhedron::MOST],
    multiplier: [f64; Polyhedron::MOST],
    count: usize,
}

/// The shortest z with c_i · z + s_i ≥ b_i, for rows c_i of length 1.
fn least_norm(rows: &[Vector6<f64>], bounds: &[f64]) -> Vector6<f64> {
    /// Far more than are ever needed.
    const ROUNDS: usize = 4 * Polyhedron::MOST;
    let mut z = Vector6::zeros();
    let mut active = Active { index: [0; Polyhedron::MOST], multiplier: [0.0; Polyhedron::MOST], count: 0 };
    let mut entering: Option<(usize, f64)> = None;
    for _ in 0..ROUNDS {
        let Some((new, multiplier)) = entering.or_else(|| Some((active.worst(rows, bounds, &z)?, 0.0)))
        else {
            break;
        };
        let Some(falls) = active.falls(rows, &rows[new]) else { break };
        // Along `way` the new constraint is approached while those that act stay as they are.
        let way = falls * SOFTNESS;
        let gain = rows[new].dot(&way) + SOFTNESS;
        let full = (bounds[new] - rows[new].dot(&z) - SOFTNESS * multiplier) / gain;
        let (blocking, longest) = active.longest_step(rows, &falls);
        let step = full.min(longest);
        z += way * step;
        for slot in 0..active.count {
            active.multiplier[slot] -= step * rows[active.index[slot]].dot(&falls);
        }
        let multiplier = multiplier + step;
        if longest < full {
            active.remove(blocking);
            entering = Some((new, multiplier));
        } else {
            active.add(new, multiplier);
            entering = None;
        }
    }
    z
}

impl Active {
    /// The constraint that is exceeded most.
    fn worst(&self, rows: &[Vector6<f64>], bounds: &[f64], z: &Vector6<f64>) -> Option<usize> {
        let mut worst = (TOLERANCE, None);
        for (index, (row, bound)) in rows.iter().zip(bounds).enumerate() {
            let excess = bound - row.dot(z);
            if excess > worst.0 && !self.index[..self.count].contains(&index) {
                worst = (excess, Some(index));
            }
        }
        worst.1
    }

    /// y = (ρ + Cᵀ C)⁻¹ c. With each unit of the new multiplier, those that act fall by
    /// (C Cᵀ + ρ)⁻¹ C c = C y, and z moves by c - Cᵀ C y = ρ y.
    fn falls(&self, rows: &[Vector6<f64>], new: &Vector6<f64>) -> Option<Vector6<f64>> {
        let mut square = Matrix6::identity() * SOFTNESS;
        for index in &self.index[..self.count] {
            square.ger(1.0, &rows[*index], &rows[*index], 1.0);
        }
        square.cholesky().map(|factor| factor.solve(new))
    }

    /// The first multiplier to become zero, and after which step.
    fn longest_step(&self, rows: &[Vector6<f64>], falls: &Vector6<f64>) -> (usize, f64) {
        let mut longest = (0, f64::INFINITY);
        for slot in 0..self.count {
            let fall = rows[self.index[slot]].dot(falls);
            if fall > 1e-12 {
                let step = (self.multiplier[slot] / fall).max(0.0);
                if step < longest.1 {
                    longest = (slot, step);
                }
            }
        }
        longest
    }

    fn add(&mut self, index: usize, multiplier: f64) {
        self.index[self.count] = index;
        self.multiplier[self.count] = multiplier;
        self.count += 1;
    }

    fn remove(&mut self, slot: usize) {
        self.count -= 1;
        self.index[slot] = self.index[self.count];
        self.multiplier[slot] = self.multiplier[self.count];
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn vector() -> impl Strategy<Value = Vector6<f64>> {
        prop::array::uniform6(-1.0..1.0f64).prop_map(Vector6::from)
    }

    fn metric() -> impl Strategy<Value = Matrix6<f64>> {
        prop::array::uniform6(prop::array::uniform6(-0.3..0.3f64)).prop_map(|rows| {
            let root = Matrix6::from_fn(|row, column| rows[row][column]);
            root * root.transpose() + Matrix6::identity() * 0.01
        })
    }

    fn polyhedron(rows: &[(Vector6<f64>, f64)]) -> Polyhedron {
        let mut sut = Polyhedron::new();
        for (row, bound) in rows {
            sut.push(*row, *bound);
        }
        sut
    }

    proptest! {
        #[test]
        fn the_nearest_point_satisfies_the_conditions_of_karush_kuhn_and_tucker(
            rows in prop::collection::vec((vector(), -0.5..0.3f64), 1..9), metric in metric(),
        ) {
            let sut = polyhedron(&rows);
            let d = sut.nearest(&Vector6::zeros(), &metric).unwrap();
            // Feasible up to the slack, for these random rows nearly always possible.
            let excess = |(row, bound): &(Vector6<f64>, f64)| bound - row.dot(&d);
            prop_assume!(rows.iter().all(|row| excess(row) < 1e-3));
            // No feasible direction lowers the cost: compare with many other feasible points.
            let cost = |d: &Vector6<f64>| 0.5 * d.dot(&(metric * d));
            for scale in [0.3, 0.03, 0.003] {
                for (way, _) in &rows {
                    for sign in [-1.0, 1.0] {
                        let other = d + way * (sign * scale);
                        let feasible = rows.iter().all(|(row, bound)| row.dot(&other) >= *bound);
                        prop_assert!(!feasible || cost(&other) > cost(&d) - 1e-4, "{} {}", cost(&other), cost(&d));
                    }
                }
            }
        }

        #[test]
        fn a_wanted_motion_is_where_it_is_measured_from(
            rows in prop::collection::vec((vector(), -0.5..0.3f64), 1..9), metric in metric(), wanted in vector(),
        ) {
            let shifted: Vec<_> = rows.iter().map(|(row, bound)| (*row, bound - row.dot(&wanted))).collect();
            let there = polyhedron(&rows).nearest(&wanted, &metric).unwrap();
            let change = polyhedron(&shifted).nearest(&Vector6::zeros(), &metric).unwrap();
            prop_assert!((there - wanted - change).norm() < 1e-6 * (1.0 + there.norm()), "{there} {change}");
        }

        #[test]
        fn it_moves_no_more_than_the_bounds(
            rows in prop::collection::vec((vector(), -0.5..0.3f64), 1..12),
            shift in prop::collection::vec(-1e-4..1e-4f64, 12),
            metric in metric(),
        ) {
            let moved: Vec<_> = rows.iter().zip(&shift).map(|((row, bound), by)| (*row, bound + by)).collect();
            let nearest = |rows: &[_]| polyhedron(rows).nearest(&Vector6::zeros(), &metric).unwrap();
            let (a, b) = (nearest(&rows), nearest(&moved));
            prop_assume!(a.norm() < 3.0);
            prop_assert!((a - b).norm() < 0.05, "{}", (a - b).norm());
        }
    }

    #[test]
    fn what_is_inside_stays() {
        let sut = polyhedron(&[(Vector6::x(), -0.1), (-Vector6::x(), -0.1)]);
        let inside = Vector6::y() * 3.0 + Vector6::x() * 0.1;
        assert_eq!(sut.nearest(&inside, &Matrix6::identity()).unwrap(), inside);
        assert!(sut.contains(&inside) && !sut.contains(&Vector6::x()));
    }

    #[test]
    fn limits_that_contradict_each_other_share_the_excess() {
        let sut = polyhedron(&[(Vector6::x(), 1.0), (-Vector6::x(), 1.0)]);
        let d = sut.nearest(&Vector6::zeros(), &Matrix6::identity()).unwrap();
        assert!(d.norm() < 1e-6, "{d}");
    }

    #[test]
    fn a_stopped_joint_is_made_up_for_by_the_others() {
        // Two joints move one point: stopping the first lets the second do all.
        let row = Vector6::x() + Vector6::y();
        let metric = row * row.transpose() + Matrix6::identity() * 1e-4;
        // The first is to go back by 0.1.
        let d = polyhedron(&[(-Vector6::x(), 0.1)]).nearest(&Vector6::zeros(), &metric).unwrap();
        assert!((d.x + 0.1).abs() < 1e-5 && (d.y - 0.1).abs() < 1e-3, "{d}");
    }
}
