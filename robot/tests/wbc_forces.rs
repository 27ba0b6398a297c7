//! The two solvers of the contact-force problem against each other.

use locoman_robot::wbc::force::{ActiveSet, ForceProblem, ForceSolver, Forces, InteriorPoint, MAX_FORCES};
use proptest::prelude::*;

const FRICTION: f64 = 0.6;
/// The robot weighs 131 N; the two may differ by 0.01 N.
const AGREEMENT: f64 = 0.01 / 131.0;
/// N; see `force::active_set`.
const INSIDE: f64 = 1e-7;

/// H = B^T Q_2 B + Q_1 of random torso balances, as the controller makes them.
fn problem() -> impl Strategy<Value = ForceProblem> {
    let lever = prop::collection::vec(-0.3..0.3_f64, 12);
    let wanted = prop::collection::vec(-1.0..1.0_f64, 6);
    (1_usize..=4, lever, wanted, 0.0..0.05_f64, 0.2..1.5_f64).prop_map(build)
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
    problem.feet = feet;
    (problem.min_vertical, problem.max_vertical) = ([least; 4], [most; 4]);
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
