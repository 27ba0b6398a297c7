//! Self-collision of the real model: distances, their gradients, and the pairs that are left out.

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::{Path, PathBuf};

use locoman_robot::{
    collision::{Altitude, Capsule, Clearances, CollisionModel, Ground, Link, Part, separation},
    joints::{JointVector, Leg},
    kinematics::{Bodies, BodyPoses, body_poses},
    model::Model,
};
use nalgebra::Isometry3;
use proptest::prelude::*;

fn configs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/robot")
}

fn model() -> Model {
    Model::load(&configs()).unwrap()
}

/// A posture from shares of the joints' ranges; rear legs stand, more or less.
fn posture(model: &Model, shares: &[f64]) -> JointVector {
    let mut joints = JointVector::from_fn(|joint, _| {
        model.lower[joint] + shares[joint] * (model.upper[joint] - model.lower[joint])
    });
    for leg in [Leg::RearRight, Leg::RearLeft] {
        let first = leg.first_joint();
        joints[first] = shares[first] - 0.5;
        joints[first + 1] = 0.3 + 1.2 * shares[first + 1];
        joints[first + 2] = -2.6 + 1.6 * shares[first + 2];
    }
    joints
}

fn shares() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(0.0..1.0_f64, 18)
}

/// Every shape in the torso's frame.
fn placed(model: &Model, bodies: &BodyPoses) -> Vec<(Link, Capsule)> {
    let shapes = model.collision.shapes().iter();
    shapes
        .map(|shape| {
            let Some(joint) = shape.link.joint() else { return (shape.link, shape.capsule) };
            let (rotation, origin) = bodies.pose(joint);
            let at = |point| (rotation * point) + origin;
            let Capsule { a, b, radius } = shape.capsule;
            (shape.link, Capsule { a: at(a), b: at(b), radius })
        })
        .collect()
}

fn near(model: &Model, joints: &JointVector, within: f64) -> Clearances {
    let mut clearances = Clearances::new();
    let bodies = body_poses(model, joints);
    clearances.update(&model.collision, model.collision.pairs(), &bodies, within);
    clearances
}

proptest! {
    #[test]
    fn the_nearest_pair_is_found_whatever_is_rejected_early(shares in shares()) {
        let model = model();
        let bodies = body_poses(&model, &posture(&model, &shares));
        let shapes = placed(&model, &bodies);
        let can_meet = |a: Link, b: Link| {
            model.collision.pairs().iter().any(|pair| {
                let links = pair.links(&model.collision);
                links == [a, b] || links == [b, a]
            })
        };
        // Allowances only lengthen distances.
        let mut least = f64::INFINITY;
        for (index, (second, capsule)) in shapes.iter().enumerate() {
            for (first, other) in &shapes[..index] {
                if can_meet(*first, *second) {
                    least = least.min(separation(other, capsule).distance);
                }
            }
        }
        let found = near(&model, &posture(&model, &shares), 0.2).least().unwrap_or(f64::INFINITY);
        prop_assert!(found > least - 1e-12 && (found < least + 0.1 || least > 0.1), "{found} {least}");
    }

    #[test]
    fn the_gradient_is_that_of_finite_differences(shares in shares()) {
        const STEP: f64 = 1e-6;
        let model = model();
        let joints = posture(&model, &shares);
        let bodies = body_poses(&model, &joints);
        for clearance in near(&model, &joints, 0.03).near() {
            let gradient = clearance.gradient(&bodies);
            for joint in 0..18 {
                let distance = |by: f64| {
                    let mut moved = joints;
                    moved[joint] += by;
                    let all = near(&model, &moved, 0.04);
                    // Two capsules of a link may be near: the one that has moved least.
                    let same = all.near().iter().filter(|other| other.links == clearance.links);
                    same.map(|other| other.distance)
                        .min_by(|a, b| (a - clearance.distance).abs().total_cmp(&(b - clearance.distance).abs()))
                };
                if let (Some(ahead), Some(behind)) = (distance(STEP), distance(-STEP)) {
                    let slope = (ahead - behind) / (2.0 * STEP);
                    prop_assert!((slope - gradient[joint]).abs() < 1e-4, "{slope} {} {joint}", gradient[joint]);
                }
            }
        }
    }
}

/// Links that are next to each other, or whose distance one joint alone decides.
fn are_neighbours(first: Link, second: Link) -> bool {
    use Part::{Calf, Forearm, Gripper, Hip, Motor, Mount, Thigh, Trunk, Wrist};
    let same_limb = first.leg == second.leg || first.leg.is_none() || second.leg.is_none();
    let pairs = [
        (Trunk, Hip),
        (Trunk, Motor),
        (Hip, Motor),
        (Hip, Thigh),
        (Motor, Thigh),
        (Motor, Calf),
        (Motor, Mount),
        (Thigh, Calf),
        (Thigh, Mount),
        (Calf, Mount),
        (Calf, Forearm),
        (Mount, Forearm),
        (Mount, Wrist),
        (Mount, Gripper),
        (Forearm, Wrist),
        (Forearm, Gripper),
        (Wrist, Gripper),
    ];
    let parts = (first.part, second.part);
    same_limb && pairs.iter().any(|(a, b)| parts == (*a, *b) || parts == (*b, *a))
        || (first.part, second.part) == (Hip, Hip)
}

#[test]
fn pairs_that_are_left_out_are_neighbours_or_never_meet() {
    let model = model();
    let is_front = |link: &Link| matches!(link.leg, Some(Leg::FrontRight | Leg::FrontLeft));
    let watched: Vec<_> = model.collision.pairs().iter().map(|pair| pair.links(&model.collision)).collect();
    let mut state: u64 = 7;
    let mut share = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    for _ in 0..3000 {
        let shares: Vec<_> = (0..18).map(|_| share()).collect();
        let bodies = body_poses(&model, &posture(&model, &shares));
        let shapes = placed(&model, &bodies);
        for (index, (second, capsule)) in shapes.iter().enumerate() {
            for (first, other) in &shapes[..index] {
                let skip = first == second
                    || are_neighbours(*first, *second)
                    || watched.contains(&[*first, *second])
                    || !(is_front(first) || is_front(second));
                if !skip {
                    let distance = separation(other, capsule).distance;
                    assert!(distance > 0.0, "{first} and {second}: {distance}");
                }
            }
        }
    }
}

#[test]
fn standing_and_ready_postures_are_free() {
    let model = model();
    let posture = |leg: [f64; 3], arm: [f64; 3]| {
        let mut joints = JointVector::zeros();
        for first in [0, 3, 6, 9] {
            joints.fixed_rows_mut::<3>(first).copy_from_slice(&leg);
        }
        joints.fixed_rows_mut::<3>(12).copy_from_slice(&[arm[0], -arm[1], arm[2]]);
        joints.fixed_rows_mut::<3>(15).copy_from_slice(&arm);
        joints
    };
    let stow = [-std::f64::consts::PI, 0.05, 0.0];
    for (leg, arm) in [
        ([0.0, 0.9, -1.8], stow),
        ([0.0, 1.2, -2.4], stow),
        ([0.0, 0.9, -1.8], [-0.1, 0.0, 0.0]),
        // Unfolding while lifted.
        ([0.0, 1.12, -2.24], [-2.1, 0.05, 0.0]),
        ([0.0, 1.12, -2.24], [-1.8, 0.05, 0.0]),
        ([0.0, 1.12, -2.24], [-0.1, 0.0, 0.0]),
    ] {
        let least = near(&model, &posture(leg, arm), 0.05).least();
        assert!(least.is_none_or(|least| least > 0.014), "{leg:?} {arm:?}: {least:?}");
    }
}

/// Replaces a piece of the file's text; returns the refusal.
fn refusal(name: &str, from: &str, to: &str) -> String {
    let text = std::fs::read_to_string(configs().join("collision.toml")).unwrap();
    assert!(text.contains(from), "{from} is not in the file");
    let path = std::env::temp_dir().join(format!("locoman-{}-{name}.toml", std::process::id()));
    std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
    let error = CollisionModel::load(&path).unwrap_err().to_string();
    std::fs::remove_file(path).unwrap();
    error
}

#[test]
fn shapes_that_make_no_sense_are_refused_by_name() {
    for (from, to, expected) in [
        ("radius = 0.058", "radius = -0.058", "capsule 1 of link `trunk`: needs a radius"),
        ("a = [-0.0176", "a = [-17.6", "of link `hip`: needs ends"),
        ("link = \"wrist\"", "link = \"elbow\"", "elbow"),
        ("link = \"gripper\"", "link = \"wrist\"", "link `gripper`: has no capsule"),
        ("by = 0.04 ", "by = 0.5 ", "allowance of `trunk` and `thigh`"),
        ("radius = 0.0243", "radios = 0.0243", "radios"),
    ] {
        let error = refusal("collision", from, to);
        assert!(error.contains(expected), "{error}");
    }
}

/// The ground 0.3 m under a tilted torso, and how far the front right limb is above it.
fn altitudes(model: &Model, joints: &JointVector, tilt: &Isometry3<f64>) -> (Ground, Vec<Altitude>) {
    let ground = Ground::at(-0.3, tilt);
    let limb = ground.altitudes(Leg::FrontRight, &model.collision, &body_poses(model, joints)).collect();
    (ground, limb)
}

#[test]
fn a_foot_is_the_lowest_of_a_standing_leg() {
    let model = model();
    let mut joints = JointVector::zeros();
    joints.fixed_rows_mut::<3>(0).copy_from_slice(&[0.0, 0.9, -1.8]);
    let (_, limb) = altitudes(&model, &joints, &Isometry3::identity());
    let lowest = |part| {
        let of_part = limb.iter().filter(|end| end.link.part == part);
        of_part.map(|end| end.height).fold(f64::INFINITY, f64::min)
    };
    // The foot's centre is 2 * 0.213 cos 0.9 below the hip, the capsule's radius 0.0233.
    let foot = 0.3 - 0.426 * 0.9_f64.cos() - 0.0233;
    assert!((lowest(Part::Calf) - foot).abs() < 1e-3, "{} {foot}", lowest(Part::Calf));
    assert!((0.02..0.06).contains(&(lowest(Part::Mount) - foot)), "{}", lowest(Part::Mount));
}

proptest! {
    #[test]
    fn an_altitude_grows_along_its_gradient(
        shares in shares(), tilt in prop::array::uniform3(-0.3..0.3f64), joint in 0..3usize, arm in any::<bool>(),
    ) {
        const STEP: f64 = 1e-6;
        let model = model();
        let joint = if arm { 12 + joint } else { joint };
        let tilt = Isometry3::rotation(tilt.into());
        let at = |by: f64| {
            let mut joints = posture(&model, &shares);
            joints[joint] += by;
            altitudes(&model, &joints, &tilt).1
        };
        let joints = posture(&model, &shares);
        let (ground, limb) = altitudes(&model, &joints, &tilt);
        let bodies = body_poses(&model, &joints);
        for ((end, before), after) in limb.iter().zip(at(-STEP)).zip(at(STEP)) {
            let slope = (after.height - before.height) / (2.0 * STEP);
            prop_assert!((slope - end.gradient(&ground, &bodies)[joint]).abs() < 1e-6, "{}", end.link);
        }
    }
}
