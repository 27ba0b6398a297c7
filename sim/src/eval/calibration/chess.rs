//! OpenCV's chessboards: our fit beside that of OpenCV's `calibrateCamera` on the same corners.

use std::path::Path;

use locoman_calib::chessboard::Chessboard;
use locoman_calib::intrinsics::{Model, Settings, View, calibrate};
use locoman_calib::projection::differences_px;
use locoman_vision::camera::{Camera, Distortion};
use locoman_vision::image::GrayImage;
use nalgebra::{Isometry3, Vector2};
use opencv::calib3d;
use opencv::core::{Mat, MatTraitConst, Point2f, Point3f, Size, Vector};

use crate::eval::statistics::percentile;
use crate::eval::{Figure, Must, Report};

const SIZE: (u32, u32) = (640, 480);
const BOARD: Chessboard = Chessboard { columns: 9, rows: 6, square_m: 0.025 };

pub fn run(folder: &Path, report: &mut Report) -> anyhow::Result<()> {
    if !folder.is_dir() {
        tracing::warn!(folder = %folder.display(), "left out: there are no chessboards");
        return Ok(());
    }
    for side in ["left", "right"] {
        let mut views = Vec::new();
        for k in 1..=14 {
            let Ok(bytes) = std::fs::read(folder.join(format!("{side}{k:02}.jpg"))) else { continue };
            views.extend(BOARD.find(&k.to_string(), &GrayImage::decode(&bytes)?)?);
        }
        let (theirs, rms_px) = opencv(&views)?;
        let settings = Settings {
            id: side.into(),
            width: SIZE.0,
            height: SIZE.1,
            model: Model::Radtan5,
            most_views: 60,
        };
        let ours = calibrate(&views, &BOARD.parts(), &settings)?;
        let differences = differences_px(&ours.camera, &theirs, &ours.coverage);
        let covered = |k: &usize| ours.coverage.cells[*k].points > 0;
        let inside: Vec<f64> = (0..differences.len()).filter(covered).map(|k| differences[k]).collect();
        let stated: Vec<f64> =
            (0..differences.len()).filter(covered).map(|k| ours.uncertainty_px[k]).collect();
        let name = |what: &str| format!("chess.{side}_{what}");
        let apart_px = (ours.outcome.rms_px - rms_px).abs();
        report.push(Figure::new(name("rms"), ours.outcome.rms_px, "px").reference(rms_px, "OpenCV"));
        report.push(Figure::new(name("rms_apart"), apart_px, "px").must(Must::AtMost(0.005)));
        let limit = percentile(&stated, 0.95);
        let must = Must::AtMost((1e4 * limit).round() / 1e4);
        report.push(Figure::new(name("projection_95"), percentile(&inside, 0.95), "px").must(must));
    }
    Ok(())
}

/// OpenCV's camera and RMS.
fn opencv(views: &[View]) -> anyhow::Result<(Camera, f64)> {
    let target = BOARD.parts();
    let mut objects = Vector::<Vector<Point3f>>::new();
    let mut images = Vector::<Vector<Point2f>>::new();
    for view in views {
        let points: Vec<_> = view.points(&target).collect();
        objects.push(points.iter().map(|(p, _)| Point3f::new(p.x as f32, p.y as f32, p.z as f32)).collect());
        images.push(points.iter().map(|(_, p)| Point2f::new(p.x as f32, p.y as f32)).collect());
    }
    let (mut matrix, mut lens) = (Mat::default(), Mat::default());
    let (mut rotations, mut translations) = (Vector::<Mat>::new(), Vector::<Mat>::new());
    let size = Size::new(i32::try_from(SIZE.0)?, i32::try_from(SIZE.1)?);
    let rms_px = calib3d::calibrate_camera_def(
        &objects,
        &images,
        size,
        &mut matrix,
        &mut lens,
        &mut rotations,
        &mut translations,
    )?;
    let at = |row: i32, column: i32| matrix.at_2d::<f64>(row, column).copied();
    let mut k = [0.0; 8];
    for (index, value) in k.iter_mut().take(5).enumerate() {
        *value = *lens.at::<f64>(i32::try_from(index)?)?;
    }
    let camera = Camera {
        id: "opencv".into(),
        width: SIZE.0,
        height: SIZE.1,
        focal_px: Vector2::new(at(0, 0)?, at(1, 1)?),
        center_px: Vector2::new(at(0, 2)?, at(1, 2)?),
        distortion: Distortion::RadTan(k),
        world_from_camera: Isometry3::identity(),
        line_time_s: 0.0,
    };
    Ok((camera, rms_px))
}
