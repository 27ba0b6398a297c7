//! How well a hand is predicted 40 ms ahead, beside holding its last pose.
//!
//! The hand reaches from place to place as hands do, with least jerk (Flash and Hogan, "The coordination of arm
//! movements", 1985), each reach begun before the last has quite ended, with rests between some, and it trembles.

use super::*;

/// What the issue asks for.
const MOST_M: f64 = 4e-3;
const MOST_RAD: f64 = 0.0262;
const TIMES_BETTER: f64 = 3.0;
const AHEAD_NS: u64 = 40_000_000;

/// A reach from here to there: begins, lasts, shifts and turns.
struct Reach {
    begin_s: f64,
    duration_s: f64,
    shift_m: Vector3<f64>,
    turn_rad: Vector3<f64>,
}

/// A minute of a hand.
struct Hand(Vec<Reach>);

impl Hand {
    fn new(noise: &mut Noise) -> Self {
        let mut begin_s = 0.0;
        let mut reaches = Vec::new();
        let (mut place, mut facing) = (Vector3::zeros(), Vector3::zeros());
        while begin_s < 60.0 {
            let mut within = |reach: f64| Vector3::from_fn(|_, _| reach * (2.0 * noise.uniform() - 1.0));
            let (to, face) = (within(0.25), within(0.6));
            let shift_m: Vector3<f64> = to - place;
            // 0.45 s and 1.5 s for each metre: peak speeds about 1 m/s.
            let duration_s = 0.45 + 1.5 * shift_m.norm() * (0.7 + 0.6 * noise.uniform());
            reaches.push(Reach { begin_s, duration_s, shift_m, turn_rad: face - facing });
            (place, facing) = (to, face);
            let rest_s = if noise.uniform() < 0.3 { 0.6 } else { -0.1 * duration_s };
            begin_s += duration_s + rest_s;
        }
        Self(reaches)
    }

    fn at(&self, time_ns: u64) -> Isometry3<f64> {
        let t_s = time_ns as f64 * 1e-9;
        let (mut place, mut facing) = (Vector3::zeros(), Vector3::zeros());
        for reach in &self.0 {
            let x = ((t_s - reach.begin_s) / reach.duration_s).clamp(0.0, 1.0);
            let share = x * x * x * (10.0 + x * (6.0 * x - 15.0));
            place += reach.shift_m * share;
            facing += reach.turn_rad * share;
        }
        // Physiological tremor: 9 Hz, a tenth of a millimetre.
        let tremor = 1e-4 * (std::f64::consts::TAU * 9.0 * t_s).sin();
        place += Vector3::new(tremor, 0.5 * tremor, -0.7 * tremor);
        Isometry3::from_parts(place.into(), UnitQuaternion::from_scaled_axis(facing))
    }
}

/// RMS of (position, rotation) errors, 40 ms ahead, of prediction and of holding.
fn errors(rate_hz: f64, seed: u64) -> [(f64, f64); 2] {
    let settings = FilterSettings::default();
    let mut noise = Noise(seed);
    let hand = Hand::new(&mut noise);
    let step_ns = (1e9 / rate_hz) as u64;
    let mut sut = begun(&hand.at(0), &settings);
    let mut sums = [(0.0, 0.0); 2];
    let mut count = 0.0;
    for k in 1..(55.0 * rate_hz) as u64 {
        let time_ns = k * step_ns;
        let evidence = measured(time_ns, &hand.at(time_ns), &mut noise);
        let base = sut;
        sut = base.predicted(time_ns, &settings);
        if sut.correct(&evidence, &settings) == Judgement::Jump {
            sut = base.loosened(&settings).predicted(time_ns, &settings);
            assert_eq!(sut.correct(&evidence, &settings), Judgement::Accepted);
        }
        let truth = hand.at(time_ns + AHEAD_NS);
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
