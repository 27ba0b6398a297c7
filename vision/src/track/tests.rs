//! The whole chain on rendered images.

mod allocation;

use nalgebra::{Isometry3, Vector3};

use super::*;
use crate::image::{GrayImage, Pixels};
use crate::testing;

const STEP_NS: u64 = 33_333_333;

fn frames(time_ns: u64, poses: &[Isometry3<f64>]) -> FrameSet {
    let shells = testing::shells();
    let frame = |(camera, described)| Frame {
        camera,
        capture_ns: time_ns,
        pixels: Pixels::Gray(testing::render(described, &shells, poses)),
    };
    FrameSet { frames: testing::rig().cameras.iter().enumerate().map(frame).collect() }
}

fn blank(time_ns: u64) -> FrameSet {
    let image = GrayImage::new(1280, 720, vec![110; 1280 * 720]).expect("size");
    let frame = |camera| Frame { camera, capture_ns: time_ns, pixels: Pixels::Gray(image.clone()) };
    FrameSet { frames: (0..4).map(frame).collect() }
}

/// All shells on a slow arc; hands move at 0.25 m/s.
fn moved(time_ns: u64) -> Vec<Isometry3<f64>> {
    let t = time_ns as f64 * 1e-9;
    let shift = Vector3::new(0.02 * (3.0 * t).sin(), 0.05 * (5.0 * t).sin(), 0.03 * (4.0 * t).sin());
    let turn = Isometry3::new(Vector3::zeros(), Vector3::new(0.0, 0.2 * (3.0 * t).sin(), 0.0));
    let place = |pose: &Isometry3<f64>| Isometry3::from(shift) * pose * turn;
    testing::worn().iter().map(place).collect()
}

fn sut() -> Tracker {
    Tracker::new(testing::rig(), testing::shells(), TrackerSettings::default()).expect("tracker")
}

#[test]
fn all_shells_are_found_and_followed_on_rendered_images() {
    /// The issue asks for 1 mm and 0.5 degrees; the images here are without noise.
    const POSITION_M: f64 = 0.5e-3;
    const ROTATION_RAD: f64 = 0.0087;
    /// Full search of one camera, regions of the others, then thumbs round their palms, a camera an update.
    const FOUND_AFTER: u64 = 6;
    let mut sut = sut();
    for step in 0..15 {
        let time_ns = 1_000_000_000 + step * STEP_NS;
        let truth = moved(time_ns);
        let update = sut.update(&frames(time_ns, &truth));
        if step < FOUND_AFTER {
            continue;
        }
        for ((shell, update), truth) in testing::shells().shells.iter().zip(&update.shells).zip(&truth) {
            assert_eq!(update.verdict, Verdict::Tracked, "{} at step {step}", shell.name);
            let error = truth.inverse() * update.world_from_shell.expect("tracked");
            let (position_m, rotation_rad) = (error.translation.vector.norm(), error.rotation.angle());
            assert!(
                position_m < POSITION_M && rotation_rad < ROTATION_RAD,
                "{} at step {step}: {position_m} m, {rotation_rad} rad",
                shell.name
            );
        }
        assert!(update.cameras.iter().all(|camera| !camera.searched_whole));
    }
}

#[test]
fn what_is_covered_is_predicted_then_lost_then_found_again() {
    let mut sut = sut();
    let truth = testing::worn();
    let seen = frames(0, &truth);
    let at = |time_ns: u64, set: &FrameSet| {
        let mut set = set.clone();
        set.frames.iter_mut().for_each(|frame| frame.capture_ns = time_ns);
        set
    };
    let mut time_ns = 0;
    let mut step = |sut: &mut Tracker, set: &FrameSet| {
        time_ns += STEP_NS;
        sut.update(&at(time_ns, set)).shells.iter().map(|shell| shell.verdict).collect::<Vec<_>>()
    };
    for _ in 0..6 {
        step(&mut sut, &seen);
    }
    assert_eq!(step(&mut sut, &seen), [Verdict::Tracked; 5]);
    let covered = blank(0);
    assert_eq!(step(&mut sut, &covered), [Verdict::Predicted; 5]);
    for _ in 0..8 {
        step(&mut sut, &covered);
    }
    assert_eq!(step(&mut sut, &covered), [Verdict::Lost; 5]);
    for _ in 0..6 {
        step(&mut sut, &seen);
    }
    assert_eq!(step(&mut sut, &seen), [Verdict::Tracked; 5]);
}

#[test]
fn the_same_frames_give_the_same_poses() {
    let sets: Vec<FrameSet> = (0..3).map(|k| frames(k * STEP_NS, &moved(k * STEP_NS))).collect();
    let run = || {
        let mut sut = sut();
        sets.iter().map(|set| sut.update(set).shells).collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}

#[test]
fn frames_that_cannot_be_used_are_named_and_the_rest_goes_on() {
    let mut sut = sut();
    let mut set = frames(0, &testing::worn());
    set.frames[0].pixels = Pixels::Encoded(b"no image".to_vec());
    let small = GrayImage::new(640, 480, vec![0; 640 * 480]).expect("size");
    set.frames[1].pixels = Pixels::Gray(small);
    set.frames.push(Frame { camera: 99, ..set.frames[2].clone() });
    let update = sut.update(&set);
    let problem = |camera: usize| update.camera(camera).expect("a frame").problem.clone().unwrap_or_default();
    assert!(problem(0).contains("cannot be decoded"), "{}", problem(0));
    assert!(problem(1).contains("640x480"), "{}", problem(1));
    assert_eq!(update.camera(2).expect("a frame").problem, None);
    assert_eq!(update.shells[0].verdict, Verdict::Tracked);
}

#[test]
fn a_search_of_a_whole_image_begins_what_is_lost_and_leaves_what_is_followed() {
    let (rig, shells, settings) = (testing::rig(), testing::shells(), TrackerSettings::default());
    let image = testing::render(&rig.cameras[0], &shells, &testing::worn());
    let time_ns = 1_000_000_000;
    let mut scout = Scout::new(&rig, 0, &shells, &settings).expect("scout");
    let found = scout.search(&image, time_ns, None);
    let mut sut = Fusion::new(rig, shells, settings);
    assert!(sut.found(found.clone()));
    let begun = sut.motions();
    assert!(begun.known_at(time_ns).contains(&true));
    // The same again: what is known by now stays as it is.
    sut.found(found.clone());
    assert_eq!(begun.latest(), sut.motions().latest());
    // In a newer image it is found where it is by then.
    let later_ns = time_ns + 60_000_000;
    assert!(sut.found(CameraUpdate { capture_ns: later_ns, ..found }));
    assert!(sut.motions().latest().iter().flatten().any(|motion| motion.time_ns == later_ns));
}
