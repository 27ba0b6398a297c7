//! The controller on the simulated robot, in lockstep: it stands up, changes modes, and follows the operator
//! within the figures of the demo, by the simulator's truth, with the imperfections of the hardware profile.
#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::Path;

use locoman_protocol::messages::Mode;
use locoman_sim::eval::demo::report;
use locoman_sim::eval::drive::{Drive, Motion, Script};
use locoman_sim::robot::Options;
use nalgebra::{Isometry3, Vector3};

fn drive(profile: &str, seed: u64) -> Drive {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    Drive::new(&configs, &Options { profile: profile.into(), seed, ..Options::default() }).unwrap()
}

/// Smooth, as a person moves: it starts and ends at rest.
fn wave(t: f64, hz: f64) -> f64 {
    (std::f64::consts::TAU * hz * t).sin() * (1.0 - (-t).exp())
}

fn hand(t: f64) -> Isometry3<f64> {
    Isometry3::new(
        Vector3::new(
            0.06 * wave(t, 0.25),
            0.04 * wave(t, 0.35),
            0.03 + 0.05 * wave(t, 0.3) - 0.03 * (-t).exp(),
        ),
        Vector3::new(0.2 * wave(t, 0.3), 0.2 * wave(t, 0.2), 0.2 * wave(t, 0.25)),
    )
}

fn torso(t: f64) -> Isometry3<f64> {
    Isometry3::new(
        Vector3::new(0.01 * wave(t, 0.2), 0.008 * wave(t, 0.3), 0.012 * wave(t, 0.25)),
        Vector3::new(0.04 * wave(t, 0.2), 0.05 * wave(t, 0.25), 0.06 * wave(t, 0.15)),
    )
}

#[test]
fn the_gripper_and_the_torso_follow_the_operator() {
    for (mode, side) in [(Mode::RightGripper, 0), (Mode::LeftGripper, 1)] {
        let mut sut = drive("hw", 1);
        let motion = |t: f64| {
            let mut motion = Motion { torso: Some(torso(t)), ..Motion::default() };
            motion.palms[side] = Some(hand(t));
            motion.openings[side] = Some(0.5 + 0.5 * wave(t, 0.3));
            motion
        };
        let outcome = sut.run(&Script { mode, seconds: 12.0, motion });
        let figures = report(sut.session(), 1);
        println!("{mode:?}\n{figures}");
        outcome.unwrap();
        for figure in figures.figures.iter().filter(|figure| figure.name != "tracker.rate") {
            if let Some(must) = &figure.must {
                assert!(must.is_met_by(figure.value), "{mode:?}: {} = {}", figure.name, figure.value);
            }
        }
    }
}
