//! The scenes that are meant to be hard move as they say.

#![expect(clippy::expect_used, reason = "helpers of tests: a panic there is the report")]

use std::path::Path;

use locoman_sim::operator::motion::{Body, Motion};
use locoman_sim::operator::scene::Scene;

const PALMS: [Body; 2] = [Body::RightPalm, Body::LeftPalm];

fn text(name: &str) -> String {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    std::fs::read_to_string(configs.join("scenes").join(name)).expect("a committed scene")
}

fn motion(text: &str) -> Motion {
    toml::from_str::<Scene>(text).expect("a good scene").motion
}

#[test]
fn the_fast_scene_moves_at_1_m_s_and_360_deg_s_without_a_pause() {
    let sut = motion(&text("fast.toml"));
    for body in PALMS {
        let pace = sut.pace(body, 2.0, 18.0);
        println!("{}: {pace:?}", body.name());
        assert!((0.99..1.05).contains(&pace.rms_m_s) && pace.peak_m_s < 1.05, "{pace:?}");
        let (rms, peak) = (pace.rms_rad_s.to_degrees(), pace.peak_rad_s.to_degrees());
        assert!((340.0..380.0).contains(&rms) && peak < 460.0, "{rms}, {peak} deg/s");
    }
}

#[test]
fn the_wandering_hands_move_like_hands() {
    let sut = motion(&text("hand.toml"));
    for body in PALMS {
        let pace = sut.pace(body, 0.0, sut.period_s);
        println!("{}: {pace:?}", body.name());
        assert!((0.7..1.6).contains(&pace.peak_m_s), "{pace:?}");
        assert!((5.0..12.0).contains(&pace.peak_m_s2), "{pace:?}");
        assert!((2.0..8.0).contains(&pace.peak_rad_s), "{pace:?}");
    }
}

#[test]
fn the_wandering_begins_and_ends_at_rest() {
    let sut = motion(&text("hand.toml"));
    for body in Body::ALL {
        for t_s in [0.0, 0.9, 59.1, 59.9] {
            assert_eq!(sut.posture(t_s).of(body), sut.posture(0.0).of(body), "{} at {t_s} s", body.name());
        }
        let pace = sut.pace(body, 1.0, 59.0);
        assert!(pace.peak_m_s > 0.02, "{} moves: {pace:?}", body.name());
    }
}

#[test]
fn a_seed_makes_one_wandering_and_another_makes_another() {
    let (scene, other) = (text("hand.toml"), text("hand.toml").replace("seed = 1", "seed = 2"));
    let at = |text: &str| *motion(text).posture(20.0).of(Body::RightPalm);
    assert_eq!(at(&scene), at(&scene));
    assert!((at(&scene).translation.vector - at(&other).translation.vector).norm() > 1e-3);
}

#[test]
fn a_wandering_that_is_too_short_or_too_shaky_is_refused() {
    for (good, bad) in [("end_s = 59.0", "end_s = 2.0"), ("tremor_m = 0.0003", "tremor_m = 0.3")] {
        let error =
            toml::from_str::<Scene>(&text("hand.toml").replace(good, bad)).expect_err(bad).to_string();
        assert!(error.contains("wander") || error.contains("tremor_m"), "{error}");
    }
}
