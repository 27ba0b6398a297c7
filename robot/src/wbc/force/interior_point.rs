//! Clarabel behind the active set: slower, but it decides every problem.
//!
//! One solver for each number of points and legs, with and without torque limits, set up once and updated in place,
//! which needs a stored dense pattern and no presolve. The torque limits are left out first: forces that
//! satisfy them all the same are optimal with them too. There is no time limit, because Clarabel's clock runs
//! on over updates; the cap on iterations bounds the time instead. A solve allocates a little inside
//! Clarabel; that happens only in the rare step whose active set was not proved.
//!
//! Clarabel corrects its steps after Mehrotra, and such a method can run in circles: Cartis, "Some disadvantages
//! of a Mehrotra-type primal-dual corrector interior point algorithm for linear programming", Applied Numerical
//! Mathematics 59 (2009). In one of ten thousand problems the constraints hold, but the same four or five steps
//! repeat and the duality gap stays. Shorter steps lead out of the circle; as they take nearly twice as many
//! iterations, they are left to a second attempt.

use clarabel::{
    algebra::CscMatrix,
    solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus},
};

use super::{ForceFailure, ForceProblem, ForceSolver, Forces, MAX_FORCES, MAX_POINTS, MAX_TORQUES};

/// What the rows of the points are multiplied with: slacks are then about 1, where Clarabel starts from. This and
/// the next two save a third of the iterations.
const POINT_SCALE: f64 = 3.0;
/// What the rows of the torques are multiplied with, 1/m: a torque is a force on a lever of a tenth of a metre.
const TORQUE_SCALE: f64 = 10.0 * POINT_SCALE;
/// What the cost is multiplied with, so that multipliers are about 1.
const COST_SCALE: f64 = 3000.0;
/// Of the duality gap of the scaled cost. A gap ε of the cost itself leaves the forces uncertain by √(2ε / Q_1),
/// for they are nearly free where only Q_1 weighs them: at 1e-14, 0.006 N at worst and far less in practice.
const GAP_TOLERANCE: f64 = 1e-14 * COST_SCALE;
/// Of the scaled constraints.
const FEASIBILITY: f64 = 1e-8;
/// How the first attempt goes: six to eight iterations are the rule.
const SWIFT: Pace = Pace { step: 0.999, iterations: 20 };
/// How the second attempt goes.
const CAUTIOUS: Pace = Pace { step: 0.9, iterations: 50 };

/// Most legs with torque limits.
const LEGS: usize = MAX_TORQUES / 3;

/// How far and how often Clarabel may step.
struct Pace {
    /// Share of the way to the constraints that a step may go.
    step: f64,
    /// Iterations before giving up.
    iterations: u32,
}

/// The interior-point method, ready for all that may stand on the ground.
pub struct InteriorPoint {
    /// For one point, two, and so on; nothing if Clarabel refused its setup.
    points_alone: [Option<Prepared>; MAX_POINTS],
    /// The same, and then for one leg, two, and so on; nothing too where legs and points do not fit.
    with_torques: [[Option<Prepared>; LEGS]; MAX_POINTS],
}

/// A solver, and the numbers that it gets before each solve.
struct Prepared {
    solver: DefaultSolver<f64>,
    /// Upper triangle of H, scaled, by columns.
    hessian: Vec<f64>,
    gradient: Vec<f64>,
    /// -W, scaled, by columns.
    constraints: Vec<f64>,
    /// Where each column of W ends.
    ends: Vec<usize>,
    bounds: Vec<f64>,
}

impl InteriorPoint {
    /// Sets up all solvers for a friction coefficient.
    pub fn new(friction: f64) -> Self {
        let set_up = |points: usize, legs: usize| {
            let mut pattern = ForceProblem::new(friction);
            (pattern.points, pattern.torque.joints) = (points, 3 * legs);
            Prepared::new(&pattern)
        };
        // A foot for each leg, and at most two knees.
        let fit = |points: usize, legs: usize| (legs..=legs + 2).contains(&points);
        Self {
            points_alone: std::array::from_fn(|index| set_up(index + 1, 0)),
            with_torques: std::array::from_fn(|index| {
                let points = index + 1;
                std::array::from_fn(|index| {
                    let legs = index + 1;
                    if fit(points, legs) { set_up(points, legs) } else { None }
                })
            }),
        }
    }
}

impl ForceSolver for InteriorPoint {
    fn solve(&mut self, problem: &ForceProblem, forces: &mut Forces) -> Result<(), ForceFailure> {
        if !problem.is_finite() {
            return Err(ForceFailure::NotFinite);
        }
        let points = problem.points.wrapping_sub(1);
        let Some(Some(points_alone)) = self.points_alone.get_mut(points) else {
            return Err(ForceFailure::Numerical);
        };
        points_alone.solve(problem, forces)?;
        let torque = &problem.torque;
        let within = (0..torque.joints)
            .all(|joint| (torque.lower[joint]..=torque.upper[joint]).contains(&torque.torque(joint, forces)));
        if within {
            return Ok(());
        }
        let legs = (torque.joints / 3).wrapping_sub(1);
        match self.with_torques.get_mut(points).and_then(|of| of.get_mut(legs)) {
            Some(Some(with_torques)) => with_torques.solve(problem, forces),
            _ => Err(ForceFailure::Numerical),
        }
    }
}

impl Prepared {
    /// A solver for problems of a pattern; their numbers come before each solve.
    fn new(pattern: &ForceProblem) -> Option<Self> {
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
        for row in 0..pattern.rows() {
            for (column, entry) in pattern.normal(row).into_iter().enumerate().take(n) {
                if entry != 0.0 || row >= pattern.point_rows() {
                    constraints.0.push(row);
                    constraints.1.push(column);
                    constraints.2.push(-POINT_SCALE * entry);
                }
            }
        }
        let settings = DefaultSettings {
            verbose: false,
            max_iter: SWIFT.iterations,
            max_step_fraction: SWIFT.step,
            tol_gap_abs: GAP_TOLERANCE,
            tol_gap_rel: 0.0,
            tol_feas: FEASIBILITY,
            presolve_enable: false,
            input_sparse_dropzeros: false,
            // The problem comes scaled, and a scaling of the setup's numbers would not fit later ones.
            equilibrate_enable: false,
            // Refinement takes three tenths of a solve and gains nothing here.
            iterative_refinement_enable: false,
            ..DefaultSettings::default()
        };
        let (hessian_entries, bounds) = (hessian.2.len(), vec![1.0; pattern.rows()]);
        let constraints =
            CscMatrix::new_from_triplets(pattern.rows(), n, constraints.0, constraints.1, constraints.2);
        let solver = DefaultSolver::new(
            &CscMatrix::new_from_triplets(n, n, hessian.0, hessian.1, hessian.2),
            &vec![0.0; n],
            &constraints,
            &bounds,
            &[NonnegativeConeT(pattern.rows())],
            settings,
        )
        .ok()?;
        Some(Self {
            solver,
            hessian: vec![0.0; hessian_entries],
            gradient: vec![0.0; n],
            constraints: constraints.nzval,
            ends: constraints.colptr[1..].to_vec(),
            bounds,
        })
    }

    fn solve(&mut self, problem: &ForceProblem, forces: &mut Forces) -> Result<(), ForceFailure> {
        let n = problem.unknowns();
        let upper = (0..n).flat_map(|column| (0..=column).map(move |row| (row, column)));
        for (entry, (row, column)) in self.hessian.iter_mut().zip(upper) {
            *entry = COST_SCALE * problem.hessian[row][column];
        }
        for (entry, gradient) in self.gradient.iter_mut().zip(&problem.gradient) {
            *entry = COST_SCALE * gradient;
        }
        // Clarabel's rows are -W f + s = -bound with s >= 0.
        for (index, bound) in self.bounds.iter_mut().enumerate() {
            let scale = if index < problem.point_rows() { POINT_SCALE } else { TORQUE_SCALE };
            *bound = -scale * problem.bound(index);
        }
        let torques = self.bounds.len() - problem.point_rows();
        let updated = self.solver.update_P(&self.hessian).is_ok()
            && self.solver.update_q(&self.gradient).is_ok()
            && self.solver.update_b(&self.bounds).is_ok()
            && (torques == 0 || self.update_torques(problem, torques));
        if !updated {
            return Err(ForceFailure::Numerical);
        }
        self.solver.solve();
        if !matches!(self.solver.solution.status, SolverStatus::Solved | SolverStatus::PrimalInfeasible) {
            self.solve_cautiously();
        }
        match self.solver.solution.status {
            SolverStatus::Solved => {
                *forces = [0.0; MAX_FORCES];
                forces[..n].copy_from_slice(&self.solver.solution.x);
                Ok(())
            }
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
                Err(ForceFailure::Infeasible)
            }
            SolverStatus::MaxIterations => Err(ForceFailure::Iterations),
            _ => Err(ForceFailure::Numerical),
        }
    }

    /// The second attempt, with shorter steps.
    fn solve_cautiously(&mut self) {
        let swift = self.solver.settings().clone();
        let cautious = DefaultSettings {
            max_iter: CAUTIOUS.iterations,
            max_step_fraction: CAUTIOUS.step,
            ..swift.clone()
        };
        if self.solver.update_settings(cautious).is_ok() {
            self.solver.solve();
            // Clarabel refuses only settings that it never had.
            let _ = self.solver.update_settings(swift);
        }
    }

    /// The torques' rows stand at the end of each column.
    fn update_torques(&mut self, problem: &ForceProblem, rows: usize) -> bool {
        for (column, end) in self.ends.iter().enumerate() {
            for (joint, pair) in
                self.constraints[end - rows..*end].as_chunks_mut::<2>().0.iter_mut().enumerate()
            {
                let from = TORQUE_SCALE * problem.torque.from_forces[joint][column];
                *pair = [-from, from];
            }
        }
        self.solver.update_A(&self.constraints).is_ok()
    }
}
