//! On projected corners with known noise: what goes in must come out.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::*;
use crate::testing::{self, Noise};

mod ambiguity;
mod honesty;
mod moving;

/// Small against any noise: exact corners stay exact.
fn exact() -> SolverSettings {
    SolverSettings { corner_floor_px: 0.01, ..SolverSettings::default() }
}

/// The noise of these tests is all that there is.
fn floorless() -> SolverSettings {
    SolverSettings { corner_floor_px: 0.0, ..SolverSettings::default() }
}

/// What the whole rig sees of a shell at rest.
fn observe(shell: &Shell, pose: &Isometry3<f64>, sigma_px: f64, noise: &mut Noise) -> Vec<Observation> {
    let cameras = testing::rig().cameras;
    let still = |_| *pose;
    (0..cameras.len())
        .flat_map(|camera| testing::observe(shell, &cameras, camera, 0, &still, sigma_px, noise))
        .collect()
}

fn afresh(
    shell: &Shell,
    observations: &[Observation],
    settings: &SolverSettings,
) -> (Result<Solution, Refusal>, Vec<Fate>) {
    let cameras = testing::rig().cameras;
    let views = Views { shell, cameras: &cameras, observations, time_ns: 0, variance: 1.0 };
    let mut sut = Solver::default();
    let outcome = sut.afresh(&views, settings);
    (outcome, sut.fates().to_vec())
}

fn error_m_rad(solution: &Solution, truth: &Isometry3<f64>) -> (f64, f64) {
    let error = truth.inverse() * solution.state.world_from_shell;
    (error.translation.vector.norm(), error.rotation.angle())
}

fn perturbed(pose: &Isometry3<f64>, shift: [f64; 3], turn: [f64; 3]) -> Isometry3<f64> {
    let step = shift.into_iter().chain(turn).chain([0.0; 6]);
    State::still(*pose).moved(&Vector12::from_iterator(step)).world_from_shell
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_pose_is_recovered_exactly_from_exact_corners_without_a_guess(
        shell in 0_usize..5,
        shift in prop::array::uniform3(-0.12_f64..0.12),
        turn in prop::array::uniform3(-0.6_f64..0.6),
    ) {
        let truth = perturbed(&testing::worn()[shell], shift, turn);
        let shell = &testing::shells().shells[shell];
        let observations = observe(shell, &truth, 0.0, &mut Noise(1));
        prop_assume!(observations.len() >= 2);
        let (solution, fates) = afresh(shell, &observations, &exact());
        let (position_m, rotation_rad) = error_m_rad(&solution.expect("solvable"), &truth);
        prop_assert!(position_m < 1e-7 && rotation_rad < 1e-6, "{position_m} m {rotation_rad} rad");
        prop_assert!(fates.iter().all(|fate| *fate == Fate::Used));
    }
}

#[test]
fn a_false_tag_does_not_move_the_pose_and_is_named() {
    let shell = &testing::shells().shells[1];
    let truth = testing::worn()[1];
    let mut observations = observe(shell, &truth, 0.05, &mut Noise(3));
    let clean = afresh(shell, &observations, &exact()).0.expect("solvable");
    for (victim, harm_px) in [(0, 4.0), (2, 60.0), (3, 1.5)] {
        let before = observations[victim].clone();
        for corner in &mut observations[victim].corners_px {
            corner.x += harm_px;
        }
        let (solution, fates) = afresh(shell, &observations, &exact());
        let (moved_m, _) = error_m_rad(&solution.expect("solvable"), &clean.state.world_from_shell);
        assert!(moved_m < 2e-4, "{harm_px} px: {moved_m}");
        let named: Vec<usize> = (0..fates.len()).filter(|k| fates[*k] == Fate::Outlier).collect();
        assert_eq!(named, [victim]);
        observations[victim] = before;
    }
}

#[test]
fn a_half_covered_tag_is_left_out_whole() {
    let shell = &testing::shells().shells[1];
    let truth = testing::worn()[1];
    let mut observations = observe(shell, &truth, 0.05, &mut Noise(3));
    // A finger lies over one corner: the detector closes the square where the finger ends.
    observations[4].corners_px[1] += nalgebra::Vector2::new(-3.0, 2.0);
    let (solution, fates) = afresh(shell, &observations, &exact());
    assert!(error_m_rad(&solution.expect("solvable"), &truth).0 < 2e-4);
    assert_eq!(fates[4], Fate::Outlier);
    assert_eq!(fates.iter().filter(|fate| **fate != Fate::Used).count(), 1);
}

#[test]
fn swapped_ids_are_left_out() {
    let shell = &testing::shells().shells[1];
    let truth = testing::worn()[1];
    let mut observations = observe(shell, &truth, 0.05, &mut Noise(3));
    assert!(observations.len() > 6);
    let (a, b) = (observations[0].tag, observations[1].tag);
    observations[0].tag = b;
    observations[1].tag = a;
    let (solution, fates) = afresh(shell, &observations, &exact());
    assert!(error_m_rad(&solution.expect("solvable"), &truth).0 < 5e-4);
    assert!(fates[0] != Fate::Used && fates[1] != Fate::Used, "{fates:?}");
}

#[test]
fn nonsense_is_refused() {
    let shell = &testing::shells().shells[0];
    assert_eq!(afresh(shell, &[], &exact()).0, Err(Refusal::NothingSeen));
    let seen = observe(shell, &testing::worn()[0], 0.0, &mut Noise(1));
    // Four corners on one spot determine nothing.
    let spot = Observation { corners_px: [Point2::new(640.0, 360.0); 4], ..seen[0].clone() };
    assert!(afresh(shell, &[spot], &exact()).0.is_err());
    let unknown = [
        Observation { camera: 77, ..seen[0].clone() },
        Observation { tag: 777, ..seen[0].clone() },
        Observation { corners_px: [Point2::new(f64::NAN, 0.0); 4], ..seen[0].clone() },
        Observation { covariance_px2: -seen[0].covariance_px2.map(|_| 1.0), ..seen[0].clone() },
    ];
    for observation in unknown {
        let (outcome, fates) = afresh(shell, &[observation], &floorless());
        assert!(outcome.is_err());
        assert_eq!(fates, [Fate::Unusable]);
    }
}

#[test]
fn noise_of_a_tenth_of_a_pixel_is_a_tenth_of_a_millimetre() {
    let shell = &testing::shells().shells[1];
    let truth = testing::worn()[1];
    let observations = observe(shell, &truth, 0.1, &mut Noise(23));
    let solution = afresh(shell, &observations, &floorless()).0.expect("solvable");
    let (position_m, rotation_rad) = error_m_rad(&solution, &truth);
    assert!(position_m < 1.5e-4, "{position_m}");
    assert!(rotation_rad < 3e-3, "{rotation_rad}");
    assert!((solution.rms_px - 0.14).abs() < 0.04, "{}", solution.rms_px);
    assert_eq!(solution.cameras, 4);
}

#[test]
fn steps_are_in_world_axes_for_position_and_in_shell_axes_for_rotation() {
    let pose = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.0, 0.0, 1.5));
    let moved = perturbed(&pose, [0.1, 0.0, 0.0], [0.0, 0.2, 0.0]);
    assert!((moved.translation.vector - Vector3::new(1.1, 2.0, 3.0)).norm() < 1e-12);
    let turn: UnitQuaternion<f64> = pose.rotation.inverse() * moved.rotation;
    assert!((turn.scaled_axis() - Vector3::new(0.0, 0.2, 0.0)).norm() < 1e-12);
}
