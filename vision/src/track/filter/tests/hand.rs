//! How well a hand is predicted 40 ms ahead, beside holding its last pose.

use super::*;
use crate::testing::Hand;

/// What the issue asks for.
const MOST_M: f64 = 4e-3;
const MOST_RAD: f64 = 0.0262;
const TIMES_BETTER: f64 = 3.0;
const AHEAD_NS: u64 = 40_000_000;

fn seconds(time_ns: u64) -> f64 {
    time_ns as f64 * 1e-9
}

/// RMS of (position, rotation) errors, 40 ms ahead, of prediction and of holding.
fn errors(rate_hz: f64, seed: u64) -> [(f64, f64); 2] {
    let settings = FilterSettings::default();
    let mut noise = Noise(seed);
    let hand = Hand::new(&mut noise);
    let step_ns = (1e9 / rate_hz) as u64;
    let mut sut = begun(&hand.at(0.0), &settings);
    let mut sums = [(0.0, 0.0); 2];
    let mut count = 0.0;
    for k in 1..(55.0 * rate_hz) as u64 {
        let time_ns = k * step_ns;
        let evidence = measured(time_ns, &hand.at(seconds(time_ns)), &mut noise);
        let base = sut;
        sut = base.predicted(time_ns, &settings);
        if sut.correct(&evidence, &settings) == Judgement::Jump {
            sut = base.loosened(&settings).predicted(time_ns, &settings);
            assert_eq!(sut.correct(&evidence, &settings), Judgement::Accepted);
        }
        let truth = hand.at(seconds(time_ns + AHEAD_NS));
        let ahead = sut.predicted(time_ns + AHEAD_NS, &settings).world_from_shell;
        for (sum, pose) in sums.iter_mut().zip([ahead, evidence.about.world_from_shell]) {
            sum.0 += (pose.translation.vector - truth.translation.vector).norm_squared();
            sum.1 += pose.rotation.angle_to(&truth.rotation).powi(2);
        }
        count += 1.0;
    }
    sums.map(|(position, rotation): (f64, f64)| ((position / count).sqrt(), (rotation / count).sqrt()))
}

#[test]
fn a_hand_is_predicted_far_better_than_by_holding_its_last_pose() {
    for rate_hz in [30.0, 60.0] {
        let [(position_m, rotation_rad), (held_m, held_rad)] = errors(rate_hz, 5);
        println!(
            "{rate_hz} Hz, 40 ms ahead: {:.2} mm, {:.2} deg; held {:.2} mm, {:.2} deg",
            1e3 * position_m,
            rotation_rad.to_degrees(),
            1e3 * held_m,
            held_rad.to_degrees()
        );
        assert!(position_m < MOST_M && rotation_rad < MOST_RAD, "{position_m} {rotation_rad}");
        assert!(TIMES_BETTER * position_m < held_m && TIMES_BETTER * rotation_rad < held_rad);
    }
}
