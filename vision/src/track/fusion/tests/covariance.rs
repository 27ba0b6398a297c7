//! What the tracker says of its errors is true, shell after shell, while all of them move.

use nalgebra::Vector6;

use super::*;
use crate::testing::Hand;

/// What the issue asks for.
const NEES: std::ops::RangeInclusive<f64> = 0.8..=1.25;
const COVERED: std::ops::RangeInclusive<f64> = 0.93..=0.97;
/// 95 % of χ² with six degrees of freedom.
const CHI2_6: f64 = 12.592;
const STEPS: u64 = 400;
/// Steps until motions and their noise are known.
const SETTLED: u64 = 30;

/// Errors of the reported poses of all shells while each moves as `pose_at` has it.
fn measured(pose_at: &dyn Fn(usize, f64) -> Isometry3<f64>) -> Figures {
    let mut sut = sut();
    let mut noise = Noise(7);
    let mut sums = Figures::default();
    for step in 0..STEPS {
        let cameras =
            (0..4).map(|camera| moving_frame(&sut, camera, step, &[0, 1, 2, 3, 4], pose_at, &mut noise));
        let cameras = cameras.collect();
        let update = sut.update(cameras);
        for (shell, seen) in update.shells.iter().enumerate().filter(|_| step >= SETTLED) {
            assert_eq!(seen.verdict, Verdict::Tracked, "{shell} at {step}");
            let truth = pose_at(shell, update.time_ns as f64 * 1e-9);
            let estimate = seen.world_from_shell.expect("tracked");
            let shift = truth.translation.vector - estimate.translation.vector;
            let turn = (estimate.rotation.inverse() * truth.rotation).scaled_axis();
            let error = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
            let nees = error.dot(&(seen.covariance.try_inverse().expect("regular") * error));
            sums.count += 1.0;
            sums.nees += nees / 6.0;
            sums.covered += if nees < CHI2_6 { 1.0 } else { 0.0 };
            sums.position_m += shift.norm_squared();
            sums.rotation_rad += turn.norm_squared();
        }
    }
    let n = sums.count;
    Figures {
        count: n,
        nees: sums.nees / n,
        covered: sums.covered / n,
        position_m: (sums.position_m / n).sqrt(),
        rotation_rad: (sums.rotation_rad / n).sqrt(),
    }
}

/// Means over all shells and steps; root mean squares of the errors.
#[derive(Debug, Default)]
struct Figures {
    count: f64,
    nees: f64,
    covered: f64,
    position_m: f64,
    rotation_rad: f64,
}

#[test]
fn hands_are_tracked_with_errors_as_large_as_the_covariance_says() {
    let hands: Vec<Hand> = (1..6).map(|seed| Hand::new(&mut Noise(seed))).collect();
    // Small reaches: the tags stay in view.
    let pose_at = |shell: usize, t_s: f64| testing::worn()[shell] * hands[shell].at(t_s);
    let figures = measured(&pose_at);
    println!("hands: {figures:?}");
    assert!(NEES.contains(&figures.nees), "{figures:?}");
    assert!(COVERED.contains(&figures.covered), "{figures:?}");
}

#[test]
fn one_metre_and_one_turn_a_second_before_unsynchronised_rolling_cameras_cost_less_than_a_millimetre() {
    /// What the issue asks for.
    const RMS_M: f64 = 1e-3;
    const RMS_RAD: f64 = 7e-3;
    let figures = measured(&pose_at);
    println!("1 m/s, 360 deg/s: {figures:?}");
    assert!(figures.position_m < RMS_M && figures.rotation_rad < RMS_RAD, "{figures:?}");
    // So regular a motion is smoother than any that the filter expects: its doubt is a little too large.
    assert!(NEES.contains(&figures.nees), "{figures:?}");
}

#[test]
fn what_is_not_seen_is_predicted_within_its_growing_covariance_and_then_lost() {
    let mut sut = sut();
    let mut noise = Noise(9);
    for step in 0..60 {
        let cameras = frames(&sut, step, &[1], &mut noise);
        sut.update(cameras);
    }
    let mut last = 0.0;
    let mut verdicts = Vec::new();
    for step in 60..70 {
        let update = sut.update(frames(&sut, step, &[], &mut Noise(1)));
        let seen = &update.shells[1];
        verdicts.push(seen.verdict);
        if seen.verdict == Verdict::Predicted {
            let doubt = seen.covariance.fixed_view::<3, 3>(0, 0).trace();
            assert!(doubt > last);
            let (error_m, _) = error(&update, 1);
            assert!(error_m < 5.0 * doubt.sqrt(), "{error_m} {}", doubt.sqrt());
            last = doubt;
        }
    }
    assert_eq!(verdicts[..7], [Verdict::Predicted; 7]);
    assert_eq!(verdicts[8..], [Verdict::Lost; 2]);
}
