//! The robot sits up on the shanks of its rear legs, and comes down again. By the simulator's truth, imperfections on.

mod session;

use locoman_robot::{
    joints::Side,
    modes::{Mode, Phase},
};
use locoman_sim::robot::Disturbance;
use nalgebra::Vector3;
use session::Session;

fn standing(seed: u64) -> Session {
    let mut sut = Session::new("standing", "hw", seed);
    sut.run_until("stance", 5.0, |s| s.mode == Mode::Stance);
    sut.join();
    sut
}

fn ask(sut: &mut Session, mode: Mode) {
    let operator = sut.operator();
    operator.mode = Some(mode);
    operator.mode_request += 1;
}

#[test]
fn it_sits_upright_and_still_and_comes_down_to_four_feet() {
    let mut sut = standing(1);
    sut.request(Mode::Bimanual);
    let before = sut.truth.world_from_gripper.map(|gripper| gripper.translation.vector);
    sut.run(1.0);
    let nose = sut.truth.world_from_torso.rotation * Vector3::x();
    assert!(nose.z > 0.995, "{nose}");
    for (before, now) in before.iter().zip(&sut.truth.world_from_gripper) {
        let moved = (now.translation.vector - before).norm();
        assert!(moved < 0.005, "{moved}");
        assert!(now.translation.z > 0.35);
    }
    sut.request(Mode::Stance);
    let up = sut.truth.world_from_torso.rotation * Vector3::z();
    assert!(up.z > 0.999 && sut.truth.foot_force_n.iter().all(|force| *force > 15.0));
}

#[test]
fn pushed_at_a_gripper_it_stays_upright() {
    let mut sut = standing(2);
    sut.request(Mode::Bimanual);
    sut.run(0.5);
    for (side, force) in [(Side::Right, Vector3::y() * 30.0), (Side::Left, Vector3::x() * -30.0)] {
        sut.plant.disturb(&Disturbance::push_gripper(side, force, 0.2)).unwrap();
        sut.run(2.0);
        assert_eq!(sut.snapshot().phase, Phase::Bimanual);
    }
    sut.request(Mode::Stance);
}

#[test]
fn r_safe_037_a_mind_changed_at_any_instant_on_the_way_up_ends_on_four_feet() {
    for (seed, after_s) in [0.4, 2.1, 3.0, 4.4, 5.0, 6.2, 8.0].into_iter().enumerate() {
        let mut sut = standing(seed as u64);
        ask(&mut sut, Mode::Bimanual);
        sut.run(after_s);
        sut.request(Mode::Stance);
    }
}

#[test]
fn r_safe_037_upright_without_its_station_it_comes_down_by_itself() {
    let mut sut = standing(3);
    sut.request(Mode::Bimanual);
    sut.speaks = false;
    sut.run_until("stance", 20.0, |s| s.mode == Mode::Stance && s.goal == Mode::Stance);
}

#[test]
fn it_sits_up_after_other_modes_too() {
    for mode in [Mode::Locomotion, Mode::Foot(Side::Right), Mode::Gripper(Side::Left)] {
        let mut sut = standing(1);
        sut.request(mode);
        sut.run(0.5);
        sut.request(Mode::Bimanual);
        sut.request(mode);
        sut.request(Mode::Stance);
    }
}
