//! Dense dual active-set method on fixed arrays.
//!
//! Goldfarb and Idnani, "A numerically stable dual method for solving strictly convex quadratic programs",
//! Mathematical Programming 27 (1983): start at the unconstrained optimum, add one violated constraint at a
//! time, and drop those whose multiplier turns negative. In most control steps no more than a few are active,
//! and it takes a microsecond; torques are looked at when all feet are within their pyramids. It is trusted
//! only if its result proves the optimality conditions; otherwise the interior-point method decides.

use super::{ForceFailure, ForceProblem, ForceSolver, Forces, MAX_FORCES, ROWS_PER_POINT};

/// A constraint counts as violated beyond this, in body weights (1.3 µN for this robot).
const FEASIBILITY: f64 = 1e-8;
/// H f + h - Wᵀ u may differ from zero by this share of the greatest |h|.
const STATIONARITY: f64 = 1e-9;
/// Squared length below which a constraint's normal depends on those of the active ones.
const DEPENDENT: f64 = 1e-18;
/// Steps before giving up; each adds or drops a constraint. The most that one of three million problems took is 109.
const MAX_STEPS: usize = 200;

/// The method's workspace.
#[derive(Debug, Clone)]
pub struct ActiveSet {
    /// J = L⁻ᵀ Q: its first columns span the active normals (in the metric of H), the others their null space.
    basis: [[f64; MAX_FORCES]; MAX_FORCES],
    /// R: upper triangular, Qᵀ L⁻¹ times the active normals.
    upper: [[f64; MAX_FORCES]; MAX_FORCES],
    active: [usize; MAX_FORCES],
    multipliers: [f64; MAX_FORCES],
    /// The active constraints, a bit for each.
    members: u64,
    count: usize,
    unknowns: usize,
}

impl Default for ActiveSet {
    fn default() -> Self {
        Self {
            basis: [[0.0; MAX_FORCES]; MAX_FORCES],
            upper: [[0.0; MAX_FORCES]; MAX_FORCES],
            active: [0; MAX_FORCES],
            multipliers: [0.0; MAX_FORCES],
            members: 0,
            count: 0,
            unknowns: 0,
        }
    }
}

impl ForceSolver for ActiveSet {
    fn solve(&mut self, problem: &ForceProblem, forces: &mut Forces) -> Result<(), ForceFailure> {
        if !problem.is_finite() {
            return Err(ForceFailure::NotFinite);
        }
        self.start(problem, forces)?;
        let mut steps = 0;
        while let Some(violated) = self.most_violated(problem, forces) {
            self.satisfy(problem, violated, forces, &mut steps)?;
        }
        if self.proves(problem, forces) { Ok(()) } else { Err(ForceFailure::Numerical) }
    }
}

impl ActiveSet {
    /// Cholesky factor H = L Lᵀ, J = L⁻ᵀ, and f = -H⁻¹ h = -J Jᵀ h.
    fn start(&mut self, problem: &ForceProblem, forces: &mut Forces) -> Result<(), ForceFailure> {
        let n = problem.unknowns();
        self.unknowns = n;
        (self.count, self.members) = (0, 0);
        let mut lower = problem.hessian;
        let mut inverse = [0.0; MAX_FORCES];
        for row in 0..n {
            for column in 0..row {
                let known: f64 = (0..column).map(|k| lower[row][k] * lower[column][k]).sum();
                lower[row][column] = (lower[row][column] - known) * inverse[column];
            }
            let known: f64 = lower[row][..row].iter().map(|entry| entry * entry).sum();
            let pivot = lower[row][row] - known;
            if !(pivot.is_finite() && pivot > 0.0) {
                return Err(ForceFailure::Numerical);
            }
            inverse[row] = 1.0 / pivot.sqrt();
        }
        // Column by column of L⁻¹, which is row by row of J.
        self.basis = [[0.0; MAX_FORCES]; MAX_FORCES];
        for column in 0..n {
            self.basis[column][column] = inverse[column];
            for row in column + 1..n {
                let known: f64 = (column..row).map(|k| lower[row][k] * self.basis[column][k]).sum();
                self.basis[column][row] = -known * inverse[row];
            }
        }
        let weighed = self.transformed(&problem.gradient);
        *forces = [0.0; MAX_FORCES];
        for row in 0..n {
            for k in row..n {
                forces[row] -= self.basis[row][k] * weighed[k];
            }
        }
        Ok(())
    }

    /// Jᵀ n
    fn transformed(&self, normal: &Forces) -> Forces {
        let mut result = [0.0; MAX_FORCES];
        for row in 0..self.unknowns {
            if normal[row] == 0.0 {
                continue;
            }
            for column in 0..self.unknowns {
                result[column] += self.basis[row][column] * normal[row];
            }
        }
        result
    }

    /// The constraint that is furthest outside: of the points', else of the torques'.
    fn most_violated(&self, problem: &ForceProblem, forces: &Forces) -> Option<usize> {
        let mut worst = Worst { members: self.members, slack: -FEASIBILITY, index: None };
        for (point, force) in forces.as_chunks::<3>().0.iter().enumerate().take(problem.points) {
            let [x, y, z] = *force;
            let side = problem.friction * z;
            let slacks = [
                side - x,
                side + x,
                side - y,
                side + y,
                z - problem.min_vertical[point],
                problem.max_vertical[point] - z,
            ];
            worst.consider(ROWS_PER_POINT * point, &slacks);
        }
        if worst.index.is_none() {
            for joint in 0..problem.torque.joints {
                let torque = problem.torque.torque(joint, forces);
                let slacks = [torque - problem.torque.lower[joint], problem.torque.upper[joint] - torque];
                worst.consider(problem.point_rows() + 2 * joint, &slacks);
            }
        }
        worst.index
    }

    /// Moves until one violated constraint is active, dropping those that stand in the way.
    fn satisfy(
        &mut self,
        problem: &ForceProblem,
        violated: usize,
        forces: &mut Forces,
        steps: &mut usize,
    ) -> Result<(), ForceFailure> {
        let normal = problem.normal(violated);
        let mut multiplier = 0.0;
        loop {
            *steps += 1;
            if *steps > MAX_STEPS {
                return Err(ForceFailure::Iterations);
            }
            let n = self.unknowns;
            let d = self.transformed(&normal);
            let free: f64 = d[self.count..n].iter().map(|entry| entry * entry).sum();
            let dual = self.back_substituted(&d);

            // The longest step that keeps all multipliers positive, and the one that reaches the constraint.
            let mut partial = f64::INFINITY;
            let mut blocking = None;
            for index in 0..self.count {
                if dual[index] > 0.0 && self.multipliers[index] / dual[index] < partial {
                    partial = self.multipliers[index] / dual[index];
                    blocking = Some(index);
                }
            }
            let full = if free > DEPENDENT { -problem.slack(violated, forces) / free } else { f64::INFINITY };
            let step = partial.min(full);
            if step.is_infinite() {
                return Err(ForceFailure::Infeasible);
            }
            if full.is_finite() {
                for row in 0..n {
                    for column in self.count..n {
                        forces[row] += step * self.basis[row][column] * d[column];
                    }
                }
            }
            for index in 0..self.count {
                self.multipliers[index] -= step * dual[index];
            }
            multiplier += step;
            match blocking {
                Some(index) if partial < full => self.drop(index),
                _ => return self.add(violated, multiplier, d),
            }
        }
    }

    /// R⁻¹ d over the active constraints.
    fn back_substituted(&self, d: &Forces) -> Forces {
        let mut result = [0.0; MAX_FORCES];
        for row in (0..self.count).rev() {
            let mut sum = d[row];
            for column in row + 1..self.count {
                sum -= self.upper[row][column] * result[column];
            }
            result[row] = sum / self.upper[row][row];
        }
        result
    }

    /// Makes a constraint active: rotates J until the normal's part in the null space lies in one column.
    fn add(&mut self, constraint: usize, multiplier: f64, mut d: Forces) -> Result<(), ForceFailure> {
        if self.count >= self.unknowns {
            return Err(ForceFailure::Numerical);
        }
        for column in (self.count + 1..self.unknowns).rev() {
            let (cos, sin, length) = givens(d[column - 1], d[column]);
            d[column - 1] = length;
            for row in &mut self.basis[..self.unknowns] {
                turn(row, column - 1, cos, sin);
            }
        }
        for row in 0..=self.count {
            self.upper[row][self.count] = d[row];
        }
        self.active[self.count] = constraint;
        self.members |= 1 << constraint;
        self.multipliers[self.count] = multiplier;
        self.count += 1;
        Ok(())
    }

    /// Makes an active constraint inactive: removes its column of R and restores the triangle.
    fn drop(&mut self, index: usize) {
        self.members &= !(1 << self.active[index]);
        self.count -= 1;
        for column in index..self.count {
            self.active[column] = self.active[column + 1];
            self.multipliers[column] = self.multipliers[column + 1];
            for row in 0..=column + 1 {
                self.upper[row][column] = self.upper[row][column + 1];
            }
        }
        for column in index..self.count {
            let (cos, sin, length) = givens(self.upper[column][column], self.upper[column + 1][column]);
            self.upper[column][column] = length;
            self.upper[column + 1][column] = 0.0;
            for later in column + 1..self.count {
                let (a, b) = (self.upper[column][later], self.upper[column + 1][later]);
                self.upper[column][later] = cos * a + sin * b;
                self.upper[column + 1][later] = cos * b - sin * a;
            }
            for row in &mut self.basis[..self.unknowns] {
                turn(row, column, cos, sin);
            }
        }
    }

    /// The Karush-Kuhn-Tucker conditions: within the constraints, multipliers not negative and only on active
    /// constraints, and H f + h = Wᵀ u.
    fn proves(&self, problem: &ForceProblem, forces: &Forces) -> bool {
        let mut rest = problem.cost_gradient(forces);
        for index in 0..self.count {
            let normal = problem.normal(self.active[index]);
            for entry in 0..self.unknowns {
                rest[entry] -= self.multipliers[index] * normal[entry];
            }
        }
        let scale =
            problem.gradient[..self.unknowns].iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
        let stationary = rest[..self.unknowns].iter().all(|entry| entry.abs() <= STATIONARITY * scale);
        let dual = self.multipliers[..self.count].iter().all(|multiplier| *multiplier >= 0.0);
        let primal = (0..problem.rows()).all(|index| problem.slack(index, forces) >= -2.0 * FEASIBILITY);
        stationary && dual && primal
    }
}

/// The worst of the constraints seen so far that are not active.
struct Worst {
    members: u64,
    slack: f64,
    index: Option<usize>,
}

impl Worst {
    fn consider(&mut self, first: usize, slacks: &[f64]) {
        for (index, slack) in (first..).zip(slacks) {
            if *slack < self.slack && self.members & (1 << index) == 0 {
                (self.slack, self.index) = (*slack, Some(index));
            }
        }
    }
}

/// cos and sin that turn (a, b) into (length, 0).
fn givens(a: f64, b: f64) -> (f64, f64, f64) {
    if b == 0.0 {
        return (1.0, 0.0, a);
    }
    let length = (a * a + b * b).sqrt();
    (a / length, b / length, length)
}

/// Turns two neighbouring columns in one row.
fn turn(row: &mut [f64; MAX_FORCES], column: usize, cos: f64, sin: f64) {
    let (a, b) = (row[column], row[column + 1]);
    row[column] = cos * a + sin * b;
    row[column + 1] = cos * b - sin * a;
}
