//! On pictures of single tags, rendered through the whole lens with blur and noise: corners must lie where they
//! were put, and be as sure as they say.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::*;
use crate::testing::{self, Noise, TagPicture};

/// A tag whose sides are of about this length in the image, turned and tilted, somewhere in the image.
fn picture(side_px: f64, tilt_rad: f64, number: u64) -> TagPicture {
    let mut noise = Noise(number);
    let camera = testing::rig().cameras[0].clone();
    let size_m = 0.03;
    let depth_m = camera.focal_px.x * size_m / side_px;
    let margin_px = side_px.max(60.0);
    let middle = Point2::new(
        margin_px + (1280.0 - 2.0 * margin_px) * noise.uniform(),
        margin_px + (720.0 - 2.0 * margin_px) * noise.uniform(),
    );
    let ray = camera.unproject(&middle);
    // Looked at from the front: the tag's x to the right, its y up, its z towards the camera.
    let facing = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.8 * (noise.uniform() - 0.5));
    let axis = nalgebra::Unit::new_normalize(Vector3::new(noise.uniform() - 0.5, noise.uniform() - 0.5, 0.0));
    let tilt = UnitQuaternion::from_axis_angle(&axis, tilt_rad);
    let camera_from_tag = Isometry3::from_parts(Translation3::from(ray * depth_m), roll * facing * tilt);
    TagPicture {
        camera,
        camera_from_tag,
        size_m,
        id: 5 + number as u32 % 500,
        blur_px: 0.7,
        motion_px: 0.0,
        noise_levels: 2.0,
    }
}

/// The pose of a tag, wrong by so many pixels.
fn expectation(picture: &TagPicture, off_px: [f64; 2], doubt_px: f64) -> Expectation {
    let mut pose = picture.camera_from_tag;
    let px_m = pose.translation.z / picture.camera.focal_px.x;
    pose.translation.vector += Vector3::new(off_px[0] * px_m, off_px[1] * px_m, 0.0);
    Expectation::from_pose(picture.id, &pose, picture.size_m, doubt_px)
}

struct Outcome {
    rms_px: f64,
    /// Squared error by the stated covariance, per coordinate.
    normalized: f64,
    refused: u64,
}

fn measure(side_px: f64, tilt_deg: f64, motion_px: f64, count: u64) -> Outcome {
    let (mut squares, mut normalized, mut refused) = (0.0, 0.0, 0);
    for number in 0..count {
        let picture = TagPicture { motion_px, ..picture(side_px, tilt_deg.to_radians(), 1 + number) };
        let image = picture.render(1000 + number);
        let mut sut = Reader::new(&picture.camera, &[picture.id]);
        let mut noise = Noise(77 + number);
        let off = [2.0 * noise.uniform() - 1.0, 2.0 * noise.uniform() - 1.0];
        let mut expected = expectation(&picture, off, 3.0);
        // As far as it moves in a hundredth of a second.
        expected.ideal_rate[(0, 2)] = motion_px / picture.camera.focal_px.x / 0.01;
        let Ok(reading) = sut.read(&image, &expected) else {
            refused += 1;
            continue;
        };
        let mut error = nalgebra::SVector::<f64, 8>::zeros();
        for (k, (found, truth)) in reading.corners_px.iter().zip(picture.corners_px()).enumerate() {
            error.fixed_rows_mut::<2>(2 * k).copy_from(&(found - truth));
        }
        squares += error.norm_squared() / 8.0;
        let weight = reading.covariance_px2.try_inverse().expect("regular");
        normalized += error.dot(&(weight * error)) / 8.0;
    }
    let read = (count - refused) as f64;
    Outcome { rms_px: (squares / read).sqrt(), normalized: normalized / read, refused }
}

#[test]
fn corners_are_right_within_a_hundredth_of_a_pixel() {
    // Side, bound of the RMS error per axis. `eval vision` has more of them, and the library beside.
    for (side_px, bound_px) in [(20.0, 0.05), (40.0, 0.010), (60.0, 0.010)] {
        let Outcome { rms_px, normalized, refused } = measure(side_px, 20.0, 0.0, 8);
        assert_eq!(refused, 0, "side {side_px} px");
        assert!(rms_px < bound_px, "side {side_px} px: {rms_px} px");
        assert!((0.6..1.7).contains(&normalized), "side {side_px} px: {normalized}");
    }
}

#[test]
fn corners_of_a_tag_that_moves_while_it_is_exposed_are_nearly_as_right() {
    // Motion, bound. With 8 px the edges flow into each other.
    for (motion_px, bound_px) in [(4.0, 0.02), (8.0, 0.05)] {
        let Outcome { rms_px, refused, .. } = measure(64.0, 20.0, motion_px, 6);
        assert_eq!(refused, 0);
        assert!(rms_px < bound_px, "{motion_px} px: {rms_px} px");
    }
}

#[test]
fn a_tag_is_found_as_far_off_as_is_said() {
    for number in 0..20 {
        let picture = picture(40.0, 0.4, 200 + number);
        let image = picture.render(number);
        let mut sut = Reader::new(&picture.camera, &[picture.id]);
        let angle = number as f64;
        let reading = sut.read(&image, &expectation(&picture, [7.0 * angle.cos(), 7.0 * angle.sin()], 8.0));
        let reading = reading.expect("it is there");
        let error = (reading.corners_px[0] - picture.corners_px()[0]).norm();
        assert!(error < 0.05, "{number}: {error}");
    }
}

#[test]
fn what_is_not_the_tag_is_refused() {
    let picture = picture(40.0, 0.4, 3);
    let image = picture.render(3);
    let other = picture.id + 1;
    let mut sut = Reader::new(&picture.camera, &[picture.id, other]);
    let right = expectation(&picture, [0.0, 0.0], 3.0);
    assert!(sut.read(&image, &right).is_ok());
    assert_eq!(sut.read(&image, &Expectation { id: other, ..right }).err(), Some(Refusal::Cells));
    assert_eq!(sut.read(&image, &Expectation { id: 586, ..right }).err(), Some(Refusal::Unknown));
    let elsewhere = expectation(&picture, [150.0, 0.0], 3.0);
    let refusal = sut.read(&image, &elsewhere).err();
    assert!(matches!(refusal, Some(Refusal::Contrast | Refusal::Cells | Refusal::Outside)), "{refusal:?}");
    let blank = GrayImage::new(1280, 720, vec![128; 1280 * 720]).expect("size");
    assert_eq!(sut.read(&blank, &right).err(), Some(Refusal::Contrast));
}

#[test]
fn corners_found_by_a_search_are_as_good_a_start_as_a_pose() {
    let picture = picture(50.0, 0.5, 11);
    let image = picture.render(11);
    let mut sut = Reader::new(&picture.camera, &[picture.id]);
    let from_pose = sut.read(&image, &expectation(&picture, [0.0, 0.0], 2.0)).expect("there");
    let found = picture.corners_px().map(|corner| corner + Vector2::new(0.2, -0.15));
    let start = Expectation::from_corners(picture.id, &picture.camera, &found, 2.0).expect("a square");
    let from_corners = sut.read(&image, &start).expect("there");
    // Which pixels are picked depends a little on the start: by less than a third of what noise does.
    for (k, (a, b)) in from_pose.corners_px.iter().zip(&from_corners.corners_px).enumerate() {
        let variance = from_pose.covariance_px2.fixed_view::<2, 2>(2 * k, 2 * k).trace();
        assert!((a - b).norm() < variance.sqrt() / 3.0, "{a} {b}");
    }
}
