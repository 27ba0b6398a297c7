//! A trajectory on the whole controller in lockstep: followed exactly, stopped when nobody speaks, let go at will.
#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::Path;

use locoman_robot::joints::Side;
use locoman_robot::modes::Mode;
use locoman_robot::trajectory::{Trajectory, Waypoint};
use locoman_sim::eval::lockstep::Lockstep;
use locoman_sim::robot::{EXCHANGE_S, Options};
use nalgebra::{Isometry3, Vector3};

const DURATION_S: f64 = 2.0;

/// The gripper goes forwards and turns, the torso rises.
fn trajectory() -> Trajectory {
    let mut end = Waypoint::still(DURATION_S);
    end.limbs[0] = Isometry3::new(Vector3::new(0.05, -0.02, 0.03), Vector3::new(0.0, 0.2, 0.1));
    end.torso = Isometry3::translation(0.0, 0.0, 0.01);
    Trajectory::new([end]).unwrap()
}

fn ready() -> Lockstep {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    let options =
        Options { posture: "standing".into(), profile: "ideal".into(), seed: 1, ..Options::default() };
    let mut sut = Lockstep::new(&configs, &options).unwrap();
    sut.go_to(Mode::Gripper(Side::Right)).unwrap();
    sut.run(0.5).unwrap();
    sut
}

fn gripper(sut: &Lockstep) -> Isometry3<f64> {
    sut.snapshot().grippers[0].target
}

#[test]
fn the_references_are_the_trajectory_at_every_tick() {
    let (mut sut, trajectory) = (ready(), trajectory());
    let anchor = gripper(&sut);
    sut.engage(&trajectory).unwrap();
    for tick in 1..=1000 {
        sut.tick().unwrap();
        let wanted = trajectory.at(f64::from(tick) * EXCHANGE_S).limbs[0].displacing(&anchor).pose();
        let error = gripper(&sut).inverse() * wanted;
        assert!(error.translation.vector.norm() < 1e-5 && error.rotation.angle() < 1e-5, "{tick}: {error}");
    }
}

#[test]
fn without_commands_it_stops_on_its_way_and_goes_on_when_they_return() {
    let mut sut = ready();
    sut.engage(&trajectory()).unwrap();
    sut.run(0.8).unwrap();
    sut.set_silent(true);
    let mut before = gripper(&sut);
    let mut way = before;
    // Held after 100 ms, at rest 250 ms later; disengaged after 500 ms.
    for tick in 0..180 {
        sut.tick().unwrap();
        let now = gripper(&sut);
        let step_m = (now.translation.vector - before.translation.vector).norm();
        assert!(step_m < 0.06 * EXCHANGE_S, "{tick}: {step_m}");
        if tick == 160 {
            way = now;
        }
        before = now;
    }
    let crept_m = (before.translation.vector - way.translation.vector).norm();
    assert!(crept_m < 1e-5, "it has come to rest: {crept_m}");
    sut.set_silent(false);
    sut.run(3.0).unwrap();
    let gone = gripper(&sut).translation.vector - before.translation.vector;
    assert!(gone.norm() > 0.01, "it goes on: {gone}");
    assert!(sut.snapshot().engagement != 0, "one engagement");
}

#[test]
fn let_go_it_comes_to_rest_and_a_new_engagement_begins_anew() {
    let mut sut = ready();
    sut.engage(&trajectory()).unwrap();
    sut.run(1.0).unwrap();
    let there = gripper(&sut);
    sut.release();
    sut.run(0.5).unwrap();
    let rest = gripper(&sut);
    assert!((rest.translation.vector - there.translation.vector).norm() < 0.01, "brakes at once");
    sut.run(0.5).unwrap();
    assert!((gripper(&sut).translation.vector - rest.translation.vector).norm() < 1e-6, "at rest");
    sut.engage(&trajectory()).unwrap();
    sut.run(DURATION_S + 0.1).unwrap();
    let gone = gripper(&sut).translation.vector - rest.translation.vector;
    let whole = trajectory().at(DURATION_S).limbs[0].point.position;
    assert!((gone - whole).norm() < 1e-4, "{gone} of {whole}");
}
