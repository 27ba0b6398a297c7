//! The covariance says how large the errors are, no less and no more.

use super::*;

const RUNS: usize = 1000;
const SIGMA_PX: f64 = 0.1;
/// What the issue asks for: mean of eᵀ P⁻¹ e for each degree of freedom.
const NEES: std::ops::RangeInclusive<f64> = 0.8..=1.25;
/// Share of errors inside the 95 % ellipsoid.
const COVERED: std::ops::RangeInclusive<f64> = 0.93..=0.97;
/// χ² with six degrees of freedom: 95 %.
const CHI2_6: f64 = 12.592;

/// NEES for each degree of freedom, and the share of poses inside the 95 % ellipsoid.
fn measured(shell: usize, sigma_px: f64, seed: u64) -> (f64, f64) {
    let truth = testing::worn()[shell];
    let shell = &testing::shells().shells[shell];
    let cameras = testing::rig().cameras;
    let mut noise = Noise(seed);
    let mut sut = Solver::default();
    let (mut sum, mut covered) = (0.0, 0.0);
    for _ in 0..RUNS {
        let mut observations = observe(shell, &truth, sigma_px, &mut noise);
        for observation in &mut observations {
            observation.covariance_px2 = CornerCovariance::from_diagonal_element(SIGMA_PX.powi(2));
        }
        let views =
            Views { shell, cameras: &cameras, observations: &observations, time_ns: 0, variance: 1.0 };
        let prior = Prior::of_speed(truth, 1.0, 5.0);
        let solution = sut.near(&views, &prior, &floorless()).expect("solvable");
        let error = solution.state.step_to(&State::still(truth)).fixed_rows::<6>(0).into_owned();
        let covariance = solution.covariance.fixed_view::<6, 6>(0, 0).into_owned();
        let nees = error.dot(&(covariance.try_inverse().expect("regular") * error));
        sum += nees / 6.0;
        covered += if nees < CHI2_6 { 1.0 } else { 0.0 };
    }
    (sum / RUNS as f64, covered / RUNS as f64)
}

#[test]
fn errors_are_as_large_as_the_covariance_says() {
    for shell in 0..5 {
        let (nees, covered) = measured(shell, SIGMA_PX, 17 + shell as u64);
        println!("{}: NEES {nees:.3}, covered {covered:.3}", testing::shells().shells[shell].name);
        assert!(NEES.contains(&nees), "{shell}: {nees}");
        assert!(COVERED.contains(&covered), "{shell}: {covered}");
    }
}

#[test]
fn corners_that_are_worse_than_promised_widen_the_covariance() {
    let (nees, _) = measured(1, 3.0 * SIGMA_PX, 29);
    // Nine times too large without widening.
    assert!(nees < 2.0, "{nees}");
}
