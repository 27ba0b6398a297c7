//! The two solvers of the contact-force problem against each other.

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

mod situations;

use locoman_robot::{
    dynamics::Dynamics,
    wbc::{
        ForceFailure, WbcOutput, WbcSettings, WholeBodyController,
        force::{ActiveSet, ForceProblem, ForceSolver, Forces, InteriorPoint, MAX_FORCES, MAX_POINTS},
    },
};
use proptest::prelude::*;
use situations::Random;

const FRICTION: f64 = 0.6;
/// The robot weighs 131 N; the two may differ by 0.01 N.
const AGREEMENT: f64 = 0.01 / 131.0;
/// N; see `force::active_set`.
const INSIDE: f64 = 1e-7;

/// H = B^T Q_2 B + Q_1 of random torso balances, as the controller makes them.
fn problem() -> impl Strategy<Value = ForceProblem> {
    let lever = prop::collection::vec(-0.3..0.3_f64, MAX_FORCES);
    let wanted = prop::collection::vec(-1.0..1.0_f64, 6);
    (1_usize..=MAX_POINTS, lever, wanted, 0.0..0.05_f64, 0.2..1.5_f64).prop_map(build)
}

fn build((feet, lever, wanted, least, most): (usize, Vec<f64>, Vec<f64>, f64, f64)) -> ForceProblem {
    let weights = [20.0, 20.0, 5.0, 1.0, 1.0, 0.2];
    // Acceleration of a 13 kg block of the robot's size per body weight of force.
    let mut columns = [[0.0; 6]; MAX_FORCES];
    for foot in 0..feet {
        let at = [lever[3 * foot], lever[3 * foot + 1], -0.28 + 0.1 * lever[3 * foot + 2]];
        for axis in 0..3 {
            let column = &mut columns[3 * foot + axis];
            column[axis] = 9.81;
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            // at x unit(axis), over the moments of inertia.
            column[3 + next] = at[last] * 131.0 / 0.4;
            column[3 + last] = -at[next] * 131.0 / 0.4;
        }
    }
    let d: [f64; 6] = std::array::from_fn(|row| wanted[row] * 5.0 + if row == 2 { 9.81 } else { 0.0 });
    let mut problem = ForceProblem::new(FRICTION);
    problem.points = feet;
    (problem.min_vertical, problem.max_vertical) = ([least; MAX_POINTS], [most; MAX_POINTS]);
    for row in 0..3 * feet {
        for column in 0..3 * feet {
            problem.hessian[row][column] =
                (0..6).map(|k| weights[k] * columns[row][k] * columns[column][k]).sum::<f64>()
                    / (131.0 * 131.0);
        }
        problem.hessian[row][row] += 1e-5;
        problem.gradient[row] =
            -(0..6).map(|k| weights[k] * columns[row][k] * d[k]).sum::<f64>() / (131.0 * 131.0);
    }
    problem
}

fn cost(problem: &ForceProblem, forces: &Forces) -> f64 {
    let gradient = problem.cost_gradient(forces);
    (0..problem.unknowns()).map(|k| 0.5 * forces[k] * (gradient[k] + problem.gradient[k])).sum()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn both_solvers_find_the_same_forces(problem in problem()) {
        let (mut fast, mut slow) = ([0.0; MAX_FORCES], [0.0; MAX_FORCES]);
        let proved = ActiveSet::default().solve(&problem, &mut fast);
        prop_assert!(proved.is_ok(), "{proved:?}");
        let solved = InteriorPoint::new(FRICTION).solve(&problem, &mut slow);
        prop_assert!(solved.is_ok(), "{solved:?}");
        for k in 0..problem.unknowns() {
            prop_assert!((fast[k] - slow[k]).abs() < AGREEMENT, "{fast:?} against {slow:?}");
        }
        prop_assert!(cost(&problem, &fast) <= cost(&problem, &slow) + 1e-9);
        for row in 0..problem.rows() {
            prop_assert!(problem.slack(row, &fast) >= -INSIDE);
        }
    }
}

/// Problems of the recorded kind that were met.
#[derive(Debug, Default)]
struct Met {
    within_all_limits: u32,
    friction_limited: u32,
    load_limited: u32,
    torque_limited: u32,
    infeasible: u32,
    worst_n: f64,
}

impl Met {
    fn sort(&mut self, problem: &ForceProblem, forces: &Forces) {
        let active = |row: &usize| problem.slack(*row, forces) < INSIDE;
        let (mut friction, mut load, mut torque) = (false, false, false);
        for row in (0..problem.rows()).filter(active) {
            match row {
                _ if row >= problem.point_rows() => torque = true,
                _ if row % 6 < 4 => friction = true,
                _ => load = true,
            }
        }
        self.friction_limited += u32::from(friction);
        self.load_limited += u32::from(load);
        self.torque_limited += u32::from(torque);
        self.within_all_limits += u32::from(!(friction || load || torque));
    }
}

#[test]
fn both_solvers_agree_on_100_000_recorded_problems() {
    const PROBLEMS: u32 = 100_000;
    let (nominal, cases) = (situations::model(), situations::cases());
    let mut model = nominal.clone();
    let mut random = Random(3);
    let mut dynamics = Dynamics::new();
    let mut controller = WholeBodyController::new(WbcSettings::default());
    let (mut fast_solver, mut slow_solver) = (ActiveSet::default(), InteriorPoint::new(FRICTION));
    let mut met = Met::default();
    for index in 0..PROBLEMS {
        let case = &cases[index as usize % cases.len()];
        let state = situations::state(&mut random, &nominal, &case.stance);
        dynamics.update(&nominal, &state);
        let objectives = situations::objectives(&mut random, &case.objectives, &state, &dynamics);
        let contacts = situations::contacts(&mut random, &case.stance);
        // Torque limits rarely act: weaker motors, in two of five problems, show them acting.
        let strength = if random.share() < 0.6 { 1.0 } else { 0.005 + 0.6 * random.share().powi(2) };
        model.max_torque = nominal.max_torque * strength;
        let mut output = WbcOutput::hold(state.position);
        controller.step(&model, &state, &objectives, &contacts, &mut output);
        let problem = controller.force_problem();

        let (mut fast, mut slow) = ([0.0; MAX_FORCES], [0.0; MAX_FORCES]);
        let proved = fast_solver.solve(problem, &mut fast);
        let solved = slow_solver.solve(problem, &mut slow);
        match (proved, solved) {
            (Ok(()), Ok(())) => {
                let apart = (0..problem.unknowns()).map(|k| (fast[k] - slow[k]).abs()).fold(0.0, f64::max);
                met.worst_n = met.worst_n.max(131.0 * apart);
                assert!(apart < AGREEMENT, "{index}, {}: {fast:?} against {slow:?}", case.name);
                met.sort(problem, &fast);
            }
            (Err(ForceFailure::Infeasible), Err(ForceFailure::Infeasible)) => met.infeasible += 1,
            // Neither leaves a problem undecided.
            _ => panic!("{index}, {}: {proved:?} against {solved:?}: {problem:?}", case.name),
        }
        assert_eq!(output.status.torques_relaxed, proved == Err(ForceFailure::Infeasible));
    }
    println!("{met:?}");
    let kinds = [met.friction_limited, met.load_limited, met.torque_limited, met.infeasible];
    assert!(kinds.into_iter().all(|count| count > PROBLEMS / 500), "{met:?}");
}

#[test]
fn one_interior_point_solver_serves_problem_after_problem() {
    let mut sut = InteriorPoint::new(FRICTION);
    for step in 0..200 {
        let sway = (f64::from(step) * 0.1).sin();
        let feet = 1 + step as usize % 4;
        let lever = (0..12).map(|k| 0.3 * (f64::from(k) + sway).sin()).collect();
        let problem = build((feet, lever, vec![sway; 6], 0.01, 1.5));
        let (mut fast, mut slow) = ([0.0; MAX_FORCES], [0.0; MAX_FORCES]);
        ActiveSet::default().solve(&problem, &mut fast).unwrap();
        sut.solve(&problem, &mut slow).unwrap();
        for k in 0..problem.unknowns() {
            assert!((fast[k] - slow[k]).abs() < AGREEMENT, "step {step}");
        }
    }
}

#[test]
fn a_problem_with_a_number_that_is_not_finite_is_refused() {
    let mut problem = build((4, vec![0.1; 12], vec![0.0; 6], 0.01, 1.5));
    problem.gradient[3] = f64::NAN;
    let mut forces = [0.0; MAX_FORCES];
    assert!(ActiveSet::default().solve(&problem, &mut forces).is_err());
    assert!(InteriorPoint::new(FRICTION).solve(&problem, &mut forces).is_err());
}
