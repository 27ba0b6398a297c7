//! Clarabel behind the active set: slower, but it decides every problem.
//!
//! One solver for each number of feet, set up once and updated in place, which needs a stored dense pattern
//! and no presolve. There is no time limit, because Clarabel's clock runs on over updates; the cap on
//! iterations bounds the time instead. A solve allocates a little inside Clarabel; that happens only in the
//! rare step whose active set was not proved.

use clarabel::{
    algebra::CscMatrix,
    solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus},
};

use super::{ForceFailure, ForceProblem, ForceSolver, Forces, MAX_FORCES};

/// Of the duality gap. A gap ε leaves the forces uncertain by √(2ε / Q_1), for they are nearly free where
/// only Q_1 weighs them: at 1e-13, 0.02 N at worst and far less in practice (at the usual 1e-8, newtons).
const GAP_TOLERANCE: f64 = 1e-13;
/// Of the constraints, in body weights.
const FEASIBILITY: f64 = 1e-8;
/// A dozen is the rule.
const MAX_ITERATIONS: u32 = 50;

/// The interior-point method, ready for one to four feet.
pub struct InteriorPoint {
    /// For one, two, three and four feet; nothing if Clarabel refused its setup.
    prepared: [Option<Prepared>; 4],
}

/// A solver, and the numbers that it gets before each solve.
struct Prepared {
    solver: DefaultSolver<f64>,
    /// Upper triangle of H, by columns.
    hessian: Vec<f64>,
    gradient: Vec<f64>,
    bounds: Vec<f64>,
}

impl InteriorPoint {
    /// Sets up all solvers for a friction coefficient.
    pub fn new(friction: f64) -> Self {
        Self { prepared: std::array::from_fn(|index| set_up(index + 1, friction)) }
    }
}

impl ForceSolver for InteriorPoint {
    fn solve(&mut self, problem: &ForceProblem, forces: &mut Forces) -> Result<(), ForceFailure> {
        if !problem.is_finite() {
            return Err(ForceFailure::NotFinite);
        }
        let prepared = problem.feet.checked_sub(1).and_then(|index| self.prepared.get_mut(index));
        let Some(Some(Prepared { solver, hessian, gradient, bounds })) = prepared else {
            return Err(ForceFailure::Numerical);
        };
        let n = problem.unknowns();
        let upper = (0..n).flat_map(|column| (0..=column).map(move |row| (row, column)));
        for (entry, (row, column)) in hessian.iter_mut().zip(upper) {
            *entry = problem.hessian[row][column];
        }
        gradient.copy_from_slice(&problem.gradient[..n]);
        // Clarabel's rows are W f + s = bound with s >= 0, ours W f >= bound.
        for (index, bound) in bounds.iter_mut().enumerate() {
            *bound = -problem.row(index).bound;
        }
        let updated = solver.update_P(hessian).is_ok()
            && solver.update_q(gradient).is_ok()
            && solver.update_b(bounds).is_ok();
        if !updated {
            return Err(ForceFailure::Numerical);
        }
        solver.solve();
        match solver.solution.status {
            SolverStatus::Solved => {
                forces[..n].copy_from_slice(&solver.solution.x);
                Ok(())
            }
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
                Err(ForceFailure::Infeasible)
            }
            SolverStatus::MaxIterations => Err(ForceFailure::Iterations),
            _ => Err(ForceFailure::Numerical),
        }
    }
}

/// A solver for `feet` feet, on a problem of the right pattern whose numbers are replaced before each solve.
fn set_up(feet: usize, friction: f64) -> Option<Prepared> {
    let pattern = ForceProblem {
        feet,
        hessian: [[0.0; MAX_FORCES]; MAX_FORCES],
        gradient: [0.0; MAX_FORCES],
        friction,
        min_vertical: [0.0; 4],
        max_vertical: [1.0; 4],
    };
    let n = pattern.unknowns();
    let mut hessian = (Vec::new(), Vec::new(), Vec::new());
    for column in 0..n {
        for row in 0..=column {
            hessian.0.push(row);
            hessian.1.push(column);
            hessian.2.push(if row == column { 1.0 } else { 0.0 });
        }
    }
    let mut constraints = (Vec::new(), Vec::new(), Vec::new());
    let mut bounds = Vec::new();
    for index in 0..pattern.rows() {
        let row = pattern.row(index);
        bounds.push(-row.bound);
        for (axis, entry) in row.normal.into_iter().enumerate() {
            if entry != 0.0 {
                constraints.0.push(index);
                constraints.1.push(3 * row.foot + axis);
                constraints.2.push(-entry);
            }
        }
    }
    let settings = DefaultSettings {
        verbose: false,
        max_iter: MAX_ITERATIONS,
        tol_gap_abs: GAP_TOLERANCE,
        tol_gap_rel: GAP_TOLERANCE,
        tol_feas: FEASIBILITY,
        presolve_enable: false,
        input_sparse_dropzeros: false,
        // The problem comes scaled, and a scaling of the setup's numbers would not fit later ones.
        equilibrate_enable: false,
        ..DefaultSettings::default()
    };
    let entries = hessian.2.len();
    let solver = DefaultSolver::new(
        &CscMatrix::new_from_triplets(n, n, hessian.0, hessian.1, hessian.2),
        &vec![0.0; n],
        &CscMatrix::new_from_triplets(pattern.rows(), n, constraints.0, constraints.1, constraints.2),
        &bounds,
        &[NonnegativeConeT(pattern.rows())],
        settings,
    )
    .ok()?;
    Some(Prepared { solver, hessian: vec![0.0; entries], gradient: vec![0.0; n], bounds })
}
