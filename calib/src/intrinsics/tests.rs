//! Intrinsics of projected boards against the truth, of real chessboards against OpenCV, and of boards that are wrong.

use std::path::Path;

use locoman_vision::camera::{Camera, Distortion};
use locoman_vision::image::GrayImage;
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::board::Board;
use crate::bundle::{Part, Sighting};
use crate::chessboard::Chessboard;
use crate::projection::differences_px;
use crate::rehearsal::{Reading, observe};

fn board() -> Board {
    Board { columns: 7, rows: 5, first_id: 100, tag_mm: 27.2, gap_mm: 9.2 }
}

fn camera(focal_px: f64, distortion: Distortion) -> Camera {
    Camera {
        id: "one".into(),
        width: 1280,
        height: 720,
        focal_px: Vector2::new(focal_px, focal_px * 0.998),
        center_px: Vector2::new(651.0, 349.0),
        distortion,
        world_from_camera: Isometry3::identity(),
        line_time_s: 0.0,
    }
}

/// Views of a board that is held everywhere before the camera; `printed` may differ from what is believed.
fn views(camera: &Camera, printed: &Board, count: usize, seed: u64) -> Vec<View> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let shell = printed.to_shell();
    let reading = Reading { least_cosine: 0.3, ..Reading::default() };
    let facing = Rotation3::from_matrix_unchecked(Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)));
    let mut views = Vec::new();
    for k in 0..count {
        let mut draw = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
        let pixel = nalgebra::Point2::new(draw(0.0, 1279.0), draw(0.0, 719.0));
        let tilt = Vector3::new(draw(-0.7, 0.7), draw(-0.7, 0.7), draw(-0.5, 0.5));
        let center = camera.unproject(&pixel).normalize() * draw(0.25, 0.6);
        let turn = UnitQuaternion::from_rotation_matrix(&facing) * UnitQuaternion::from_scaled_axis(tilt);
        let pose = Isometry3::from_parts(center.into(), turn);
        let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        let seen = observe(&shell, camera, 0, 0, 0.0, &|_| pose, &reading, &mut normal);
        let parts = seen.iter().filter_map(|o| Sighting::of_tag(o, 0, 0)).map(|s| PartView {
            part: s.part,
            points_px: s.points_px,
            whitening: s.whitening,
        });
        views.push(View { name: k.to_string(), parts: parts.collect(), blur_px: None });
    }
    views
}

fn settings(model: Model) -> Settings {
    Settings { id: "one".into(), width: 1280, height: 720, model, most_views: 90 }
}

fn fit(views: &[View], model: Model) -> Result<Calibration, IntrinsicsError> {
    calibrate(views, &Part::tags_of(&board().to_shell()), &settings(model))
}

#[test]
fn every_model_finds_its_lens_from_scratch_and_states_honest_deviations() {
    let lenses = [
        (900.0, Distortion::RadTan([-0.15, 0.05, 5e-4, -4e-4, 0.0, 0.0, 0.0, 0.0]), Model::Radtan4),
        (640.0, Distortion::RadTan([-0.28, 0.08, 5e-4, -4e-4, -0.01, 0.0, 0.0, 0.0]), Model::Radtan5),
        (800.0, Distortion::RadTan([0.18, -0.06, 3e-4, 1e-4, 0.009, 0.22, -0.07, 0.005]), Model::Radtan8),
        (420.0, Distortion::Fisheye([0.03, -0.006, 0.002, -4e-4]), Model::Fisheye),
    ];
    for (k, (focal, distortion, model)) in lenses.into_iter().enumerate() {
        let truth = camera(focal, distortion);
        let sut =
            fit(&views(&truth, &board(), if model == Model::Radtan8 { 90 } else { 40 }, 7 + k as u64), model)
                .expect("calibrated");
        assert!((sut.outcome.variance - 1.0).abs() < 0.1, "{model:?} {}", sut.outcome.variance);
        let mut off = differences_px(&truth, &sut.camera, &sut.coverage);
        let stated = (sut.uncertainty_px.iter().map(|s| s * s).sum::<f64>() / off.len() as f64).sqrt();
        let actual = (off.iter().map(|s| s * s).sum::<f64>() / off.len() as f64).sqrt();
        off.sort_by(f64::total_cmp);
        assert!(off[off.len() * 95 / 100] < 0.1, "{model:?} {off:?}");
        assert!(actual < 2.5 * stated, "{model:?}: {actual} px, {stated} px stated");
        assert!(verdict(&sut).starts_with("Good"), "{}", verdict(&sut));
    }
}

#[test]
fn bad_sets_are_named() {
    let truth = camera(900.0, Distortion::RadTan([-0.15, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    let few = fit(&views(&truth, &board(), 3, 1), Model::Radtan4).expect_err("too few");
    assert!(matches!(few, IntrinsicsError::TooFewViews { needed: 5, .. }), "{few}");
    let wide = Board { gap_mm: 8.0, ..board() };
    let size = fit(&views(&truth, &wide, 30, 2), Model::Radtan4).expect_err("wrong size");
    assert!(
        matches!(size, IntrinsicsError::WrongSize { ratio, .. } if (ratio - 36.4 / 35.2).abs() < 0.003),
        "{size}"
    );
    let narrow = Board { columns: 6, rows: 5, ..board() };
    let shape = fit(&views(&truth, &narrow, 30, 3), Model::Radtan4).expect_err("wrong shape").to_string();
    assert!(shape.contains("board file"), "{shape}");
    let mut blurred = views(&truth, &board(), 20, 4);
    blurred.iter_mut().for_each(|view| view.blur_px = Some(9.0));
    let blurred = fit(&blurred, Model::Radtan4).expect_err("blurred");
    assert!(matches!(blurred, IntrinsicsError::Blurred { sharp: 0, .. }), "{blurred}");
}

#[test]
fn torn_and_misread_tags_are_set_aside() {
    let truth = camera(900.0, Distortion::RadTan([-0.15, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    let mut views = views(&truth, &board(), 30, 5);
    for view in views.iter_mut().step_by(3) {
        if let Some(part) = view.parts.first_mut() {
            part.points_px[1].x += 4.0;
        }
    }
    let sut = fit(&views, Model::Radtan4).expect("calibrated");
    assert!((8..=12).contains(&sut.outcome.outliers), "{}", sut.outcome.outliers);
    assert!((sut.outcome.variance - 1.0).abs() < 0.1, "{}", sut.outcome.variance);
}

/// OpenCV's own pictures; its RMS of them as computed with its own `calibrateCamera`.
#[test]
fn real_chessboards_have_the_errors_that_opencv_finds() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/real/opencv_samples"));
    if !folder.is_dir() {
        return;
    }
    let chessboard = Chessboard { columns: 9, rows: 6, square_m: 0.025 };
    for (side, expected_px) in [("left", 0.195), ("right", 0.207)] {
        let mut views = Vec::new();
        for k in 1..=14 {
            let Ok(bytes) = std::fs::read(folder.join(format!("{side}{k:02}.jpg"))) else { continue };
            let image = GrayImage::decode(&bytes).expect("a picture");
            views.extend(chessboard.find(&k.to_string(), &image).expect("searched"));
        }
        let settings =
            Settings { id: side.into(), width: 640, height: 480, model: Model::Radtan5, most_views: 60 };
        let sut = calibrate(&views, &chessboard.parts(), &settings).expect("calibrated");
        assert!((sut.outcome.rms_px - expected_px).abs() < 0.005, "{side}: {}", sut.outcome.rms_px);
    }
}
