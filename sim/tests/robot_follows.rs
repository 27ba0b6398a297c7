//! The controller on the simulated robot, in lockstep, under the very motion that the demo's recording shows:
//! it follows within the demo's figures, by the simulator's truth, with the hardware profile's imperfections.
//! Also tells whether the script stays within the robot's reach, before anything is rendered.
#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::Path;

use locoman_protocol::messages::Mode;
use locoman_sim::eval::demo::report;
use locoman_sim::eval::drive::{Drive, Motion, Script};
use locoman_sim::operator::motion::Body;
use locoman_sim::operator::scene::Scene;
use locoman_sim::robot::Options;
use nalgebra::{Isometry3, UnitQuaternion};

/// How the station maps the torso's translation by default (configs/teleop.toml); all else is 1 to 1.
const TORSO_SCALE: f64 = 0.5;

/// Displacement from `begin` to `now`, as the station sends it for an operator who faces along x.
fn displacement(begin: &Isometry3<f64>, now: &Isometry3<f64>, scale: f64) -> Isometry3<f64> {
    let moved = now.translation.vector - begin.translation.vector;
    let turned: UnitQuaternion<f64> = now.rotation * begin.rotation.inverse();
    Isometry3::from_parts((scale * moved).into(), turned)
}

fn follows(mode: Mode, side: usize, palm: Body, seed: u64) {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    let script = Scene::read(&configs.join("scenes/operator.toml")).unwrap().motion;
    let begin = script.posture(0.0);
    let motion = |t: f64| {
        let now = script.posture(t);
        let moved = |body, scale| Some(displacement(begin.of(body), now.of(body), scale));
        let mut motion = Motion { torso: moved(Body::Torso, TORSO_SCALE), ..Motion::default() };
        motion.palms[side] = moved(palm, 1.0);
        motion.openings[side] = Some(0.5);
        motion
    };
    let mut sut = Drive::new(&configs, &Options { seed, ..Options::default() }).unwrap();
    let outcome = sut.run(&Script { mode, seconds: script.period_s, motion });
    let figures = report(sut.session(), seed);
    println!("{mode:?}\n{figures}");
    outcome.unwrap();
    // No cameras here: what they measure is not judged.
    for figure in figures.figures.iter().filter(|figure| figure.name != "tracker.rate") {
        if let Some(must) = &figure.must {
            assert!(must.is_met_by(figure.value), "{mode:?}: {} = {}", figure.name, figure.value);
        }
    }
}

#[test]
fn the_right_gripper_and_the_torso_follow_the_demos_operator() {
    follows(Mode::RightGripper, 0, Body::RightPalm, 1);
}

#[test]
fn the_left_gripper_and_the_torso_follow_the_demos_operator() {
    follows(Mode::LeftGripper, 1, Body::LeftPalm, 2);
}
