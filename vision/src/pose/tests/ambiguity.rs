//! One tag in one view looks nearly alike from two sides.

use super::*;

/// A prediction as a filter gives it: position to 3 mm, rotation to 3 degrees.
fn prior(pose: &Isometry3<f64>) -> Prior {
    let mut prior = Prior::of_speed(*pose, 1.0, 5.0);
    for k in 0..3 {
        prior.information[(k, k)] = 0.003_f64.powi(-2);
        prior.information[(3 + k, 3 + k)] = 0.05_f64.powi(-2);
    }
    prior
}

fn near(
    shell: &Shell,
    observations: &[Observation],
    prior: &Prior,
) -> (Result<Solution, Refusal>, Vec<Fate>) {
    let cameras = testing::rig().cameras;
    let views = Views { shell, cameras: &cameras, observations, time_ns: 0, variance: 1.0 };
    let mut sut = Solver::default();
    let outcome = sut.near(&views, prior, &floorless());
    (outcome, sut.fates().to_vec())
}

#[test]
fn a_single_tag_in_one_view_is_two_fold_and_a_prediction_decides() {
    let shell = &testing::shells().shells[3];
    let truth = testing::worn()[3];
    let all = observe(shell, &truth, 0.1, &mut Noise(5));
    // The smallest tags: perspective is too weak to tell the two poses apart.
    let one = &all[..1];
    assert_eq!(afresh(shell, one, &floorless()), (Err(Refusal::Ambiguous), vec![Fate::Ambiguous]));
    let guess = perturbed(&truth, [0.003, 0.0, 0.002], [0.05, -0.05, 0.02]);
    let solution = near(shell, one, &prior(&guess)).0.expect("the prediction decides");
    let (_, rotation_rad) = error_m_rad(&solution, &truth);
    assert!(rotation_rad < 0.15, "{rotation_rad}");
}

#[test]
fn a_prediction_that_knows_little_does_not_decide() {
    let shell = &testing::shells().shells[3];
    let truth = testing::worn()[3];
    let one = &observe(shell, &truth, 0.1, &mut Noise(5))[..1];
    let mut vague = prior(&truth);
    for k in 0..3 {
        vague.information[(k, k)] = 0.1_f64.powi(-2);
        vague.information[(3 + k, 3 + k)] = 1.0;
    }
    assert_eq!(near(shell, one, &vague), (Err(Refusal::Ambiguous), vec![Fate::Ambiguous]));
}

#[test]
fn no_single_tag_ever_flips_while_there_is_a_prediction() {
    let mut noise = Noise(11);
    let mut solved = 0;
    for shell in 1..5 {
        let truth = testing::worn()[shell];
        let shell = &testing::shells().shells[shell];
        for observation in observe(shell, &truth, 0.15, &mut noise) {
            let mut off = |sigma: f64| [(); 3].map(|()| sigma * noise.normal());
            let guess = perturbed(&truth, off(0.003), off(0.05));
            let Ok(solution) = near(shell, &[observation], &prior(&guess)).0 else { continue };
            let (_, rotation_rad) = error_m_rad(&solution, &truth);
            assert!(rotation_rad < 0.25, "{}: {rotation_rad}", shell.name);
            solved += 1;
        }
    }
    assert!(solved > 20, "{solved}");
}
