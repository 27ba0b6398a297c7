//! The robot walks: by the simulator's truth, with all imperfections on.

mod session;

use locoman_robot::{
    joints::Side,
    locomotion::Velocity,
    modes::{Arms, Mode, Phase},
    supervisor::Stop,
};
use locoman_sim::robot::Disturbance;
use nalgebra::{Isometry3, Vector2, Vector3};
use session::Session;

/// Standing in a mode that walks, with an operator who is engaged.
fn ready(mode: Mode, seed: u64) -> Session {
    let mut sut = Session::new("standing", "hw", seed);
    sut.run_until("stance", 10.0, |s| s.phase == Phase::Stance);
    sut.join();
    sut.request(mode);
    sut.operator().engagement = 1;
    sut
}

fn go(sut: &mut Session, forward: f64, left: f64, turn: f64) {
    sut.operator().walk = Some(Velocity { linear: Vector2::new(forward, left), turn });
}

/// All four feet carry the robot and it rests.
fn stands(sut: &mut Session) -> bool {
    let before = sut.truth.world_from_torso.translation.vector;
    sut.run(0.5);
    let moved = (sut.truth.world_from_torso.translation.vector - before).norm();
    moved < 0.003 && sut.truth.foot_force_n.iter().all(|force| *force > 10.0)
}

#[test]
fn it_goes_where_it_is_told_and_stops_on_four_feet() {
    let mut sut = ready(Mode::Locomotion, 1);
    assert!(stands(&mut sut), "nobody has told it to go");
    go(&mut sut, 0.4, 0.0, 0.0);
    sut.run(2.0);
    let start = sut.truth.world_from_torso;
    sut.run(2.0);
    let way = start.inv_mul(&sut.truth.world_from_torso).translation.vector;
    assert!((way.x - 0.8).abs() < 0.04, "{way}");
    assert!(way.y.abs() < 0.05, "{way}");
    go(&mut sut, 0.0, 0.0, 0.0);
    sut.run(2.0);
    assert!(stands(&mut sut));
}

#[test]
fn r_safe_018_a_robot_that_walks_stands_still_when_commands_cease_or_the_operator_lets_go() {
    for lets_go in [false, true] {
        let mut sut = ready(Mode::Locomotion, 2);
        go(&mut sut, 0.5, 0.0, 0.5);
        sut.run(2.0);
        if lets_go {
            sut.operator().engagement = 0;
        } else {
            sut.speaks = false;
        }
        let before = sut.truth.world_from_torso.translation.vector;
        sut.run(2.5);
        let way_m = (sut.truth.world_from_torso.translation.vector - before).norm();
        assert!(way_m < 0.5, "{way_m}");
        assert!(stands(&mut sut), "lets go: {lets_go}");
    }
}

#[test]
fn whatever_it_does_it_lies_down_when_it_is_stopped() {
    for mode in [Mode::Locomotion, Mode::LocoManipulation(Arms::Both)] {
        let mut sut = ready(mode, 3);
        go(&mut sut, 0.3, 0.1, 0.0);
        sut.run(2.0);
        sut.tick(Stop::Settle);
        sut.run_until("damped", 20.0, |s| s.phase == Phase::Damped);
        assert!(sut.truth.world_from_torso.translation.z < 0.15);
    }
}

#[test]
fn pushed_with_130_newtons_it_steps_and_goes_on() {
    for (seed, direction) in [(1, Vector3::y()), (2, -Vector3::y()), (3, Vector3::x()), (4, -Vector3::x())] {
        let mut sut = ready(Mode::Locomotion, seed);
        go(&mut sut, 0.2, 0.0, 0.0);
        sut.run(1.5);
        sut.plant.disturb(&Disturbance::push_torso(direction * 130.0, 0.2)).unwrap();
        sut.run(3.0);
        assert_eq!(sut.snapshot().phase, Phase::Walk);
    }
}

#[test]
fn pushed_where_it_stands_it_steps_without_being_told() {
    let mut sut = ready(Mode::Locomotion, 1);
    sut.plant.disturb(&Disturbance::push_torso(Vector3::y() * 80.0, 0.2)).unwrap();
    let before = sut.truth.feet_in_world;
    sut.run(3.0);
    let moved = |place: usize| (sut.truth.feet_in_world[place] - before[place]).y / 4.0;
    let moved_m: f64 = (0..4).map(moved).sum();
    assert!(moved_m > 0.02, "{moved_m}");
    assert!(stands(&mut sut));
}

#[test]
fn a_gripper_keeps_its_orientation_in_the_world_while_the_robot_trots() {
    let mut sut = ready(Mode::LocoManipulation(Arms::One(Side::Right)), 1);
    let held = sut.truth.world_from_gripper[0].rotation;
    go(&mut sut, 0.15, 0.05, 0.0);
    let mut worst: f64 = 0.0;
    for _ in 0..(4 * 400) {
        sut.tick(Stop::None);
        worst = worst.max(sut.truth.world_from_gripper[0].rotation.angle_to(&held));
    }
    assert!(worst < 0.06, "{worst}");
}

#[test]
fn it_walks_low_and_high() {
    for (height_m, seed) in [(0.16, 1), (0.34, 2)] {
        let mut sut = ready(Mode::Locomotion, seed);
        go(&mut sut, 0.2, 0.0, 0.0);
        sut.operator().torso = Some(Isometry3::translation(0.0, 0.0, height_m - 0.285));
        sut.run(3.0);
        let height = sut.truth.world_from_torso.translation.z;
        assert!((height - height_m).abs() < 0.012, "{height}");
    }
}
