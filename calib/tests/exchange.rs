//! Calibrations of others: golden files, whose heads name their sources, round trips, and what is said of bad files.

#![expect(clippy::expect_used, reason = "helpers of tests: a panic there is the report")]

use std::path::{Path, PathBuf};

use locoman_calib::board::Board;
use locoman_calib::exchange::{ExchangeError, Foreign, kalibr, opencv_yaml, ros, zed};
use locoman_vision::camera::{Camera, Distortion};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector2, Vector3};
use proptest::prelude::*;

fn golden(name: &str) -> Foreign {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name);
    Foreign::read(&path).expect("a golden file")
}

fn foreign(text: impl Into<String>) -> Foreign {
    Foreign { path: PathBuf::from("theirs"), text: text.into() }
}

/// What is said of a golden file with one thing changed.
fn complaint<T: std::fmt::Debug>(
    read: impl Fn(&Foreign) -> Result<T, ExchangeError>,
    file: &Foreign,
    good: &str,
    bad: &str,
) -> String {
    assert!(file.text.contains(good), "{good}");
    read(&foreign(file.text.replacen(good, bad, 1))).expect_err("the file is wrong").to_string()
}

#[test]
fn a_factory_file_gives_both_eyes_of_every_mode() {
    let pairs = zed::read(&golden("SN21531.conf")).expect("valid");
    assert_eq!(pairs.iter().map(|pair| pair.mode).collect::<Vec<_>>(), ["FHD", "HD"]);
    let sut = &pairs[1];
    assert_eq!((sut.left.width, sut.left.height), (1280, 720));
    assert_eq!(sut.left.focal_px, Vector2::new(699.34, 699.34));
    let k = [-0.174367, 0.0280189, -0.000190735, -0.000897378, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(sut.right.distortion, Distortion::RadTan(k));
    // The right eye is a baseline to the right of the left one (x), as their frames turn by under a degree.
    let place = sut.right.world_from_camera.translation.vector;
    assert!((place.norm() - 0.119997).abs() < 1e-9 && place.x > 0.1199, "{place}");
    assert!((sut.right.world_from_camera.rotation.angle() - 0.015546).abs() < 1e-5);
}

#[test]
fn a_camchain_gives_cameras_and_where_they_stand() {
    let sut = kalibr::read_camchain(&golden("camchain.yaml")).expect("valid");
    assert_eq!(sut[1].center_px, Vector2::new(379.999, 255.238));
    // A point 1 m before the first camera, in the second one by the rows of the file.
    let in_second = sut[1].world_from_camera.inverse() * nalgebra::Point3::new(0.0, 0.0, 1.0);
    let expected = Vector3::new(0.00427195 - 0.11003785, 0.01187697 + 0.00045792, 0.99992034 - 0.00064487);
    assert!((in_second.coords - expected).norm() < 1e-6, "{in_second}");
}

#[test]
fn a_target_gives_a_board() {
    let sut = kalibr::read_target(&golden("target.yaml")).expect("valid");
    assert_eq!((sut.columns, sut.rows, sut.tag_mm, sut.first_id), (6, 6, 88.0, 0));
    assert!((sut.gap_mm - 26.4).abs() < 1e-9);
}

#[test]
fn a_camera_info_gives_a_camera() {
    let sut = ros::read(&golden("camera_info.yaml")).expect("valid");
    assert_eq!((sut.id.as_str(), sut.focal_px), ("prosilica", Vector2::new(4827.93789, 4835.62362)));
    let k = [-0.41527, 0.31874, -0.00197, 0.00071, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(sut.distortion, Distortion::RadTan(k));
}

#[test]
fn a_pair_of_opencv_gives_two_cameras() {
    let sut = opencv_yaml::read(&golden("opencv_pair.yml"), Some([640, 480])).expect("valid");
    assert_eq!(sut[0].focal_px.x, 5.3480326845051309e+02);
    let place = sut[1].world_from_camera.translation.vector;
    assert!((place - Vector3::new(0.083, -0.001, -0.002)).norm() < 1e-12, "{place}");
    let message = opencv_yaml::read(&golden("opencv_pair.yml"), None).expect_err("no size").to_string();
    assert!(message.contains("--size"), "{message}");
}

#[test]
fn bad_files_are_refused_with_line_and_remedy() {
    let (conf, chain) = (golden("SN21531.conf"), golden("camchain.yaml"));
    let (info, target) = (golden("camera_info.yaml"), golden("target.yaml"));
    let messages = [
        (
            complaint(zed::read, &conf, "fx=1398.68", "fx=1398,68"),
            "theirs:4: `fx` of LEFT_CAM_FHD is `1398,68`",
        ),
        (complaint(zed::read, &conf, "fx=1401.57\n", ""), "[RIGHT_CAM_FHD] has no fx"),
        (complaint(zed::read, &conf, "Baseline=119.997", "Baseline=0.12"), "a baseline of 0.12 mm"),
        (
            complaint(kalibr::read_camchain, &chain, "radtan", "omni"),
            "theirs:2: cam0: distortion model `omni`",
        ),
        (complaint(kalibr::read_camchain, &chain, "0.00011556]", "0.0, 1.0, 2.0]"), "6 coefficients"),
        (complaint(kalibr::read_camchain, &chain, "[ 0.99998854,", "[ 0.5,"), "a rotation that is none"),
        (complaint(kalibr::read_camchain, &chain, "[461.629,", "[461.629"), "theirs:"),
        (complaint(ros::read, &info, "plumb_bob", "plumb_bobb"), "distortion model `plumb_bobb`"),
        (complaint(ros::read, &info, "4827.93789, 0, 1223.5", "0, 0, 1223.5"), "focal lengths 0,"),
        (complaint(kalibr::read_target, &target, "aprilgrid", "circlegrid"), "target type `circlegrid`"),
        (complaint(kalibr::read_target, &target, "0.088", "0"), "6x6 tags of 0 m"),
    ];
    for (message, expected) in messages {
        assert!(
            message.contains(expected) && message.contains("hint: "),
            "{message}\n  expected: {expected}"
        );
    }
}

#[test]
fn a_lens_that_kalibr_has_no_words_for_is_refused() {
    let mut camera = ros::read(&golden("camera_info.yaml")).expect("valid");
    camera.distortion = Distortion::RadTan([0.1, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0]);
    let message = kalibr::write_camchain(&[camera]).expect_err("k3").to_string();
    assert!(message.contains("`prosilica`") && message.contains("hint: "), "{message}");
}

fn any_distortion(most: usize) -> impl Strategy<Value = Distortion> {
    (0..3_u8, prop::array::uniform8(-0.5_f64..0.5)).prop_map(move |(kind, mut k)| match kind {
        0 => Distortion::Pinhole,
        1 => {
            k[most..].fill(0.0);
            Distortion::RadTan(k)
        }
        _ => Distortion::Fisheye([k[0], k[1], k[2], k[3]]),
    })
}

fn any_camera(most: usize) -> impl Strategy<Value = Camera> {
    let numbers = prop::array::uniform4(100.0_f64..2000.0);
    let pose = (prop::array::uniform3(-3.0_f64..3.0), prop::array::uniform3(-1.5_f64..1.5));
    (numbers, any_distortion(most), pose).prop_map(|([fx, fy, cx, cy], distortion, (place, turn))| Camera {
        id: "one".to_owned(),
        width: 1280,
        height: 720,
        focal_px: Vector2::new(fx, fy),
        center_px: Vector2::new(cx, cy),
        distortion,
        world_from_camera: Isometry3::from_parts(
            Translation3::from(Vector3::from(place)),
            UnitQuaternion::from_scaled_axis(Vector3::from(turn)),
        ),
        line_time_s: 0.0,
    })
}

fn same_lens(a: &Camera, b: &Camera) -> bool {
    a.focal_px == b.focal_px
        && a.center_px == b.center_px
        && a.distortion == b.distortion
        && a.width == b.width
}

proptest! {
    #[test]
    fn a_rig_goes_to_kalibr_and_back(cameras in prop::collection::vec(any_camera(4), 1..5)) {
        let again = kalibr::read_camchain(&foreign(kalibr::write_camchain(&cameras).expect("sayable"))).expect("ours");
        prop_assert_eq!(again.len(), cameras.len());
        for (a, b) in again.iter().zip(&cameras) {
            prop_assert!(same_lens(a, b));
            // Theirs has the first camera at the origin.
            let first_from_b = cameras[0].world_from_camera.inverse() * b.world_from_camera;
            let error = a.world_from_camera.inverse() * first_from_b;
            prop_assert!(error.translation.vector.norm() < 1e-9 && error.rotation.angle() < 1e-7);
        }
    }

    #[test]
    fn a_camera_goes_to_ros_and_back(camera in any_camera(8)) {
        prop_assert!(same_lens(&ros::read(&foreign(ros::write(&camera))).expect("ours"), &camera));
    }

    #[test]
    fn a_board_goes_to_kalibr_and_back(columns in 1_u32..20, rows in 1_u32..20, tag_mm in 5.0_f64..200.0, first in 0_u32..100) {
        let board = Board { columns, rows, first_id: first, tag_mm, gap_mm: tag_mm / 4.0 };
        let again = kalibr::read_target(&foreign(kalibr::write_target(&board))).expect("ours");
        prop_assert!((again.tag_mm - board.tag_mm).abs() < 1e-9 && (again.gap_mm - board.gap_mm).abs() < 1e-9);
        prop_assert_eq!((again.columns, again.rows, again.first_id), (columns, rows, first));
    }
}
