//! On motions that are known: laws of the prediction, and how well a hand is predicted.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::*;
use crate::testing::Noise;

mod hand;

const STEP_NS: u64 = 33_333_333;
/// What a palm's solve leaves: 0.05 mm and 0.05 degrees.
const POSITION_M: f64 = 5e-5;
const ROTATION_RAD: f64 = 9e-4;

fn helix(time_ns: u64) -> Isometry3<f64> {
    let t = time_ns as f64 * 1e-9;
    Isometry3::from_parts(
        Vector3::new(0.4 * t, 0.1 - 0.3 * t, 1.0).into(),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 2.0 * t, 0.0)),
    )
}

/// A pose that was measured, with its noise; nothing is said of the twist.
fn measured(time_ns: u64, pose: &Isometry3<f64>, noise: &mut Noise) -> Evidence {
    let mut information = Matrix12::zeros();
    let mut step = Vector12::zeros();
    for k in 0..6 {
        let sigma = if k < 3 { POSITION_M } else { ROTATION_RAD };
        information[(k, k)] = sigma.powi(-2);
        step[k] = sigma * noise.normal();
    }
    Evidence { time_ns, about: State::still(*pose).moved(&step), information, gradient: Vector12::zeros() }
}

fn begun(pose: &Isometry3<f64>, settings: &FilterSettings) -> Motion {
    let mut covariance = Matrix12::identity();
    for k in 0..6 {
        covariance[(k, k)] = if k < 3 { POSITION_M } else { ROTATION_RAD }.powi(2);
    }
    for k in 9..12 {
        covariance[(k, k)] = 25.0;
    }
    Motion::begin(0, &State::still(*pose), &covariance, settings)
}

fn followed(steps: u64) -> Motion {
    let settings = FilterSettings::default();
    let mut sut = begun(&helix(0), &settings);
    let mut noise = Noise(1);
    for k in 1..=steps {
        sut = sut.predicted(k * STEP_NS, &settings);
        let evidence = measured(k * STEP_NS, &helix(k * STEP_NS), &mut noise);
        assert_eq!(sut.correct(&evidence, &settings), Judgement::Accepted, "step {k}");
    }
    sut
}

#[test]
fn constant_motion_is_predicted_once_it_is_known() {
    let sut = followed(60);
    let later = 60 * STEP_NS + 40_000_000;
    let error = sut.predicted(later, &FilterSettings::default()).world_from_shell.inverse() * helix(later);
    assert!(error.translation.vector.norm() < 3e-4, "{error}");
    assert!(error.rotation.angle() < 6e-3, "{error}");
    assert!((sut.velocity_m_s - Vector3::new(0.4, -0.3, 0.0)).norm() < 5e-3, "{}", sut.velocity_m_s);
    assert!((sut.rate_rad_s - Vector3::new(0.0, 2.0, 0.0)).norm() < 0.1, "{}", sut.rate_rad_s);
}

#[test]
fn doubt_grows_while_nothing_is_seen() {
    let sut = followed(10);
    let settings = FilterSettings::default();
    let mut last = 0.0;
    for ahead_ms in [0, 10, 50, 200] {
        let doubt = sut.predicted(sut.time_ns + ahead_ms * 1_000_000, &settings);
        let trace = doubt.pose_covariance().trace();
        assert!(trace > last, "{ahead_ms} ms: {trace}");
        last = trace;
    }
}

#[test]
fn two_short_predictions_are_one_long_one() {
    let settings = FilterSettings::default();
    let mut sut = followed(10);
    sut.acceleration_m_s2 = Vector3::new(1.0, -2.0, 0.5);
    let (half, whole) = (sut.time_ns + 20_000_000, sut.time_ns + 40_000_000);
    let once = sut.predicted(whole, &settings);
    let twice = sut.predicted(half, &settings).predicted(whole, &settings);
    let apart = once.state().step_to(&twice.state());
    assert!(apart.norm() < 2e-3, "{apart}");
    assert!(apart.fixed_rows::<3>(0).norm() < 1e-9, "{apart}");
    let (a, b) = (once.pose_covariance(), twice.pose_covariance());
    assert!((a - b).norm() < 1e-2 * a.norm(), "{a} {b}");
}

#[test]
fn a_jump_is_left_aside() {
    let settings = FilterSettings::default();
    let sut = followed(10).predicted(11 * STEP_NS, &settings);
    let mut after = sut.clone();
    let far = Isometry3::translation(0.2, 0.0, 0.0) * helix(11 * STEP_NS);
    let judgement = after.correct(&measured(sut.time_ns, &far, &mut Noise(1)), &settings);
    assert_eq!(judgement, Judgement::Jump);
    assert_eq!(after, sut);
}

#[test]
fn the_process_noise_grows_small_at_rest_and_large_in_wild_motion() {
    let settings = FilterSettings::default();
    let rest = |_: u64| helix(0);
    let shaken = |time_ns: u64| {
        let phase = 20.0 * time_ns as f64 * 1e-9;
        Isometry3::translation(0.05 * phase.sin(), 0.0, 0.0) * helix(0)
    };
    let variance = |pose_at: &dyn Fn(u64) -> Isometry3<f64>| {
        let mut sut = begun(&pose_at(0), &settings);
        let mut noise = Noise(3);
        for k in 1..90 {
            sut = sut.predicted(k * STEP_NS, &settings);
            sut.correct(&measured(k * STEP_NS, &pose_at(k * STEP_NS), &mut noise), &settings);
        }
        sut.variance[0]
    };
    let (still, wild) = (variance(&rest), variance(&shaken));
    assert!(still < 0.1, "{still}");
    assert!(wild > 1.0, "{wild}");
}
