//! Laws of the mapping, over random poses and scales.

use super::*;
use proptest::prelude::*;

/// Of displacements: products of a few rotations in double precision.
const EXACT: f64 = 1e-9;

prop_compose! {
    fn rotation()(axis in prop::array::uniform3(-1.0..1.0f64), angle in -3.1..3.1f64) -> UnitQuaternion<f64> {
        let axis = nalgebra::Unit::try_new(Vector3::from(axis), 1e-3).unwrap_or_else(Vector3::z_axis);
        UnitQuaternion::from_axis_angle(&axis, angle)
    }
}

prop_compose! {
    fn pose()(xyz in prop::array::uniform3(-3.0..3.0f64), rotation in rotation()) -> Isometry3<f64> {
        Isometry3::from_parts(Translation3::from(Vector3::from(xyz)), rotation)
    }
}

prop_compose! {
    fn observation()(shells in prop::array::uniform5(prop::option::of(pose()))) -> Observation {
        Observation { capture_ns: 1_000_000_000, world_from_shell: shells }
    }
}

prop_compose! {
    fn config()(s in prop::array::uniform4(0.01..2.0f64)) -> Config {
        let scale = Scale {
            torso_translation: s[0], torso_rotation: s[1], hand_translation: s[2], hand_rotation: s[3],
        };
        Config { scale, ..Config::default() }
    }
}

fn distance(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    (a.translation.vector - b.translation.vector).norm() + a.rotation.angle_to(&b.rotation)
}

/// Everything seen from another place in the room.
fn moved_by(observation: &Observation, by: &Isometry3<f64>) -> Observation {
    Observation { world_from_shell: observation.world_from_shell.map(|s| s.map(|s| by * s)), ..*observation }
}

fn palm_at(pose: Isometry3<f64>) -> Observation {
    let mut observation = Observation { capture_ns: 1_000_000_000, ..Observation::default() };
    observation.world_from_shell[Shell::RightPalm as usize] = Some(pose);
    observation
}

proptest! {
    #[test]
    fn engaging_never_moves_anything(config in config(), seen in observation(), openings in prop::array::uniform2(0.0..1.0f64)) {
        let motion = Mapper::engage(&config, &seen, openings).map(&seen).unwrap();
        for body in Body::ALL {
            prop_assert_eq!(motion.body(body).is_some(), seen.shell(shell_of(body)).is_some());
            if let Some(displacement) = motion.body(body) {
                prop_assert!(distance(displacement, &Isometry3::identity()) < EXACT);
            }
        }
        for (commanded, robot) in motion.openings.into_iter().zip(openings) {
            prop_assert!(commanded.is_none_or(|commanded| commanded == robot));
        }
    }

    #[test]
    fn the_place_of_the_rig_does_not_matter(
        start in prop::array::uniform5(pose()), step in pose(), yaw in -3.0..3.0f64, xyz in prop::array::uniform3(-2.0..2.0f64),
    ) {
        let mut config = Config::default();
        config.tracking.jump_m = f64::INFINITY;
        config.tracking.jump_rad = f64::INFINITY;
        let a = Observation { capture_ns: 1, world_from_shell: start.map(Some) };
        prop_assume!((start[0].rotation * Vector3::x()).xy().norm() > 0.11);
        let b = Observation { capture_ns: 2, world_from_shell: start.map(|s| Some(s * step)) };
        let elsewhere = Isometry3::from_parts(
            Translation3::from(Vector3::from(xyz)), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw));
        let run = |a: &Observation, b: &Observation| Mapper::engage(&config, a, [0.5; 2]).map(b).unwrap();
        let first = run(&a, &b);
        let second = run(&moved_by(&a, &elsewhere), &moved_by(&b, &elsewhere));
        for (first, second) in first.bodies.iter().flatten().zip(second.bodies.iter().flatten()) {
            // Near half a turn the axis of a rotation may flip: compare below that.
            prop_assume!(step.rotation.angle() < 3.0);
            prop_assert!(distance(first, second) < 1e-6);
        }
    }

    #[test]
    fn a_palm_moves_its_gripper_by_the_scaled_step_in_the_heading_frame(
        start in pose(), step in prop::array::uniform3(-0.05..0.05f64), turn in -0.2..0.2f64, s in 0.1..2.0f64,
    ) {
        let mut config = Config::default();
        config.scale.hand_translation = s;
        config.tracking.jump_m = 1.0;
        config.tracking.jump_rad = 1.0;
        let step = Vector3::from(step);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * turn);
        let mut sut = Mapper::engage(&config, &palm_at(start), [0.0; 2]);
        let end = Isometry3::from_parts(Translation3::from(start.translation.vector + step), turn * start.rotation);
        let motion = sut.map(&palm_at(end)).unwrap();
        // No torso: the heading is the world's.
        let got = motion.body(Body::RightPalm).copied().unwrap();
        prop_assert!((got.translation.vector - step * s).norm() < EXACT);
        prop_assert!(got.rotation.angle_to(&turn) < 1e-7);
    }

    #[test]
    fn lifting_and_engaging_again_is_the_same_as_never_having_moved(config in config(), a in observation(), b in observation()) {
        let first = Mapper::engage(&config, &a, [0.0; 2]).map(&a).unwrap();
        let mut again = Mapper::engage(&config, &b, [0.0; 2]);
        again.map(&b).ok();
        let second = Mapper::engage(&config, &a, [0.0; 2]).map(&a).unwrap();
        prop_assert_eq!(first, second);
    }
}

#[test]
fn heading_turns_forward_into_the_operators_forward() {
    // The operator faces the world's +y; a palm that moves along +y moves the gripper forward.
    let mut start = palm_at(Isometry3::identity());
    start.world_from_shell[Shell::Torso as usize] =
        Some(Isometry3::rotation(Vector3::z() * std::f64::consts::FRAC_PI_2));
    let mut sut = Mapper::engage(&Config::default(), &start, [0.0; 2]);
    let mut end = start;
    end.world_from_shell[Shell::RightPalm as usize] = Some(Isometry3::translation(0.0, 0.05, 0.0));
    let got = *sut.map(&end).unwrap().body(Body::RightPalm).unwrap();
    assert!((got.translation.vector - Vector3::new(0.05, 0.0, 0.0)).norm() < EXACT, "{got}");
}

#[test]
fn a_body_that_returns_nearby_goes_on_and_one_that_returns_far_away_is_a_jump() {
    let mut sut = Mapper::engage(&Config::default(), &palm_at(Isometry3::identity()), [0.0; 2]);
    assert_eq!(sut.map(&Observation::default()).unwrap(), Motion::default(), "lost: absent");
    let near = sut.map(&palm_at(Isometry3::translation(0.05, 0.0, 0.0))).unwrap();
    assert!((near.body(Body::RightPalm).unwrap().translation.x - 0.05).abs() < EXACT);
    sut.map(&Observation::default()).unwrap();
    let jump = sut.map(&palm_at(Isometry3::translation(0.3, 0.0, 0.0))).unwrap_err();
    assert_eq!(jump.body, Body::RightPalm);
    assert!((jump.distance_m - 0.25).abs() < EXACT);
}

#[test]
fn the_longer_a_body_was_not_seen_the_further_it_may_have_gone_up_to_a_limit() {
    let after = |gap_ms: u64, x_m: f64| {
        let start = palm_at(Isometry3::identity());
        let mut end = palm_at(Isometry3::translation(x_m, 0.0, 0.0));
        end.capture_ns = start.capture_ns + gap_ms * 1_000_000;
        Mapper::engage(&Config::default(), &start, [0.0; 2]).map(&end).is_ok()
    };
    assert!(after(0, 0.059) && !after(0, 0.061));
    assert!(after(200, 0.159) && !after(200, 0.161));
    assert!(after(10_000, 0.184) && !after(10_000, 0.186));
}

#[test]
fn the_opening_follows_the_thumb_no_faster_than_allowed() {
    let config = Config::default();
    let hand = |t_ns: u64, angle: f64| {
        let mut o = palm_at(Isometry3::identity());
        o.capture_ns = t_ns;
        o.world_from_shell[Shell::RightThumb as usize] = Some(Isometry3::rotation(Vector3::z() * angle));
        o
    };
    let open = config.opening.open_rad;
    let mut sut = Mapper::engage(&config, &hand(0, open), [0.0; 2]);
    assert_eq!(sut.map(&hand(0, open)).unwrap().openings[0], Some(0.0));
    let after = sut.map(&hand(100_000_000, open)).unwrap().openings[0].unwrap();
    assert!((after - 0.3).abs() < EXACT, "{after}");
    let wide = sut.map(&hand(2_000_000_000, open)).unwrap().openings[0].unwrap();
    assert!((wide - 1.0).abs() < EXACT, "{wide}");
    let half = (config.opening.open_rad + config.opening.closed_rad) / 2.0;
    let middle = sut.map(&hand(4_000_000_000, half)).unwrap().openings[0].unwrap();
    assert!((middle - 0.5).abs() < EXACT, "{middle}");
}
