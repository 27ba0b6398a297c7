//! The switchers on the whole robot, in lockstep with physics, with the sensors' imperfections on: from every
//! mode to every other, minds changed on the way, and the margin over three feet.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic in a test is the report")]

mod session;

use locoman_robot::{
    commander::{from_above, push_inside},
    dynamics::{Dynamics, State},
    joints::{Leg, Side},
    model::Model,
    modes::{Mode, Phase},
};
use nalgebra::{Isometry3, Vector2, Vector3};
use session::{Session, configs};

const MODES: [Mode; 5] = [
    Mode::Stance,
    Mode::Foot(Side::Right),
    Mode::Foot(Side::Left),
    Mode::Gripper(Side::Right),
    Mode::Gripper(Side::Left),
];

fn standing(seed: u64) -> Session {
    let mut session = Session::new("standing", "hw", seed);
    session.run_until("stance", 10.0, |s| s.phase == Phase::Stance);
    session.join();
    session
}

fn ask(sut: &mut Session, mode: Mode) {
    sut.operator().mode = Some(mode);
    sut.operator().mode_request += 1;
}

/// Numbers that look random.
struct Dice(u64);

impl Dice {
    /// From 0 to 1.
    fn throw(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / (1_u64 << 24) as f64
    }
}

#[test]
fn each_switch_takes_about_as_long_as_in_the_authors_program() {
    let mut sut = standing(1);
    // s there, s back: what their program takes.
    for (mode, there, back) in [
        (Mode::Foot(Side::Right), 2.2, 2.9),
        (Mode::Foot(Side::Left), 2.2, 2.9),
        (Mode::Gripper(Side::Right), 3.2, 4.8),
        (Mode::Gripper(Side::Left), 3.2, 4.8),
    ] {
        for (goal, theirs) in [(mode, there), (Mode::Stance, back)] {
            let start_ns = sut.time_ns;
            sut.request(goal);
            let ours = (sut.time_ns - start_ns) as f64 * 1e-9;
            println!("{mode:?} to {goal:?}: {ours:.2} s (theirs {theirs} s), tilt {:.3} rad", sut.worst_tilt);
            assert!(ours < 1.25 * theirs, "{goal:?}: {ours}");
            sut.run(0.3);
        }
    }
    assert!(sut.worst_tilt < 0.1, "{}", sut.worst_tilt);
}

/// From each mode to each other, in an order that differs by seed; half of the requests come while the robot
/// is still on its way.
fn all_pairs(seed: u64) {
    let mut sut = standing(seed);
    let mut dice = Dice(seed);
    let mut pairs: Vec<(Mode, Mode)> =
        MODES.into_iter().flat_map(|from| MODES.map(|to| (from, to))).filter(|(a, b)| a != b).collect();
    // A few of the twenty for each seed: each of them about three times over the seeds.
    for _ in 0..3 {
        let (from, to) = pairs.swap_remove((dice.throw() * pairs.len() as f64) as usize);
        sut.request(from);
        ask(&mut sut, to);
        let interrupted = dice.throw() < 0.5;
        let patience_s = if interrupted { 4.0 * dice.throw() } else { 0.0 };
        sut.run(patience_s);
        let goal = if interrupted { MODES[(dice.throw() * 5.0) as usize] } else { to };
        sut.request(goal);
        sut.run(0.3);
        let up = goal.effector().map(|effector| effector.side().leg().index());
        for (leg, force) in sut.truth.foot_force_n.iter().enumerate() {
            let loaded = *force > 8.0;
            assert_eq!(
                loaded,
                up != Some(leg),
                "seed {seed}, {from:?} to {goal:?}: {:?}",
                sut.truth.foot_force_n
            );
        }
    }
    assert!(sut.worst_tilt < 0.15, "seed {seed}: {}", sut.worst_tilt);
}

#[test]
fn from_every_mode_every_other_is_reached_also_when_minds_change_on_the_way() {
    std::thread::scope(|scope| {
        for part in 0..2 {
            scope.spawn(move || (part..20).step_by(2).for_each(all_pairs));
        }
    });
}

/// How far the true centre of mass is inside the feet that stand, by the unspoilt model, m.
fn margin(sut: &Session, model: &Model, up: Leg) -> f64 {
    let truth = &sut.truth;
    let mut dynamics = Dynamics::new();
    let state = State { world_from_torso: truth.world_from_torso, ..State::at_rest(truth.joint_position) };
    dynamics.update(model, &state);
    let com = from_above(dynamics.com());
    let mut feet = Vec::new();
    for leg in Leg::ALL.into_iter().filter(|leg| *leg != up) {
        feet.push(truth.feet_in_world[leg.index()].coords.xy());
    }
    let inside = |mm: u32| push_inside(&com, &feet, f64::from(mm) * 1e-3) == Vector2::zeros();
    f64::from((0..100).take_while(|mm| inside(*mm)).count() as u32) * 1e-3
}

#[test]
fn the_torso_makes_way_for_a_limb_that_reaches_out_and_keeps_the_margin() {
    let model = Model::load(&configs().join("robot")).unwrap();
    for (mode, torso) in [
        // The operator pulls the torso towards the lifted foot; then only the limb moves.
        (Mode::Gripper(Side::Right), Some(Vector3::new(0.06, -0.06, 0.0))),
        (Mode::Gripper(Side::Left), Some(Vector3::new(0.06, 0.06, 0.0))),
        (Mode::Foot(Side::Right), Some(Vector3::new(0.06, -0.06, 0.0))),
        (Mode::Gripper(Side::Right), None),
    ] {
        let mut sut = standing(2);
        sut.request(mode);
        let side = mode.effector().unwrap().side();
        sut.operator().engagement = 1;
        sut.operator().torso = torso.map(|way| Isometry3::from_parts(way.into(), Default::default()));
        sut.operator().palms[side.index()] = Some(Isometry3::identity());
        sut.run(1.5);
        let (mut least, mut fastest) = (f64::INFINITY, 0.0_f64);
        let outwards = if side == Side::Left { 1.0 } else { -1.0 };
        let mut before = sut.snapshot().torso.target;
        for tick in 0..(6.0 * 400.0) as usize {
            let reach = 0.2 * (1.0 - (std::f64::consts::PI * tick as f64 / 1200.0).cos()) / 2.0;
            let way = Vector3::new(0.6 * reach, outwards * reach, 0.3 * reach);
            sut.operator().palms[side.index()] = Some(Isometry3::from_parts(way.into(), Default::default()));
            sut.tick(Default::default());
            let target = sut.snapshot().torso.target;
            let step = (target.translation.vector - before.translation.vector).norm();
            (before, fastest) = (target, fastest.max(step / 0.0025));
            if tick % 8 == 0 {
                least = least.min(margin(&sut, &model, side.leg()));
            }
        }
        println!("{mode:?} {torso:?}: margin at least {least:.3} m, torso's target at most {fastest:.3} m/s");
        assert!(least >= 0.012, "{mode:?}: {least}");
        assert!(fastest < 0.16, "{mode:?}: {fastest}");
    }
}
