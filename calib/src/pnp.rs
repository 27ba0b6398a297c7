//! First pose of a flat target in one image, by OpenCV's planar PnP (IPPE: Collins and Bartoli, 2014).

use locoman_vision::camera::Camera;
use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector3};
use opencv::calib3d::{self, SolvePnPMethod};
use opencv::core::{Mat, MatExprTraitConst, MatTraitConst, Point2d, Point3d, Vector};

/// Fewest points.
const LEAST: usize = 4;

/// `camera_from_target` and the RMS of its errors in pixels; points lie in the target's plane z = 0.
///
/// `None` if there are too few points, or no pose puts all of them before the camera.
pub fn planar_pose(camera: &Camera, points: &[(Point3<f64>, Point2<f64>)]) -> Option<(Isometry3<f64>, f64)> {
    if points.len() < LEAST {
        return None;
    }
    let poses = candidates(camera, points).unwrap_or_default();
    let scored = poses.into_iter().filter_map(|pose| Some((pose, rms_px(camera, &pose, points)?)));
    scored.min_by(|a, b| a.1.total_cmp(&b.1))
}

fn rms_px(camera: &Camera, pose: &Isometry3<f64>, points: &[(Point3<f64>, Point2<f64>)]) -> Option<f64> {
    let mut sum = 0.0;
    for (point, pixel) in points {
        sum += (camera.project(&(pose * point))? - pixel).norm_squared();
    }
    let rms = (sum / points.len() as f64).sqrt();
    rms.is_finite().then_some(rms)
}

fn candidates(camera: &Camera, points: &[(Point3<f64>, Point2<f64>)]) -> opencv::Result<Vec<Isometry3<f64>>> {
    // IPPE wants the points about the origin.
    let center = points.iter().map(|(point, _)| point.coords).sum::<Vector3<f64>>() / points.len() as f64;
    let object: Vector<Point3d> =
        points.iter().map(|(p, _)| Point3d::new(p.x - center.x, p.y - center.y, 0.0)).collect();
    // Rays instead of pixels: our own camera models stand for any lens.
    let rays = points.iter().map(|(_, pixel)| camera.unproject(pixel));
    let image: Vector<Point2d> = rays.map(|ray| Point2d::new(ray.x, ray.y)).collect();
    let identity = Mat::eye(3, 3, opencv::core::CV_64F)?.to_mat()?;
    let (mut rotations, mut translations) = (Vector::<Mat>::new(), Vector::<Mat>::new());
    let none = Mat::default();
    calib3d::solve_pnp_generic(
        &object,
        &image,
        &identity,
        &none,
        &mut rotations,
        &mut translations,
        false,
        SolvePnPMethod::SOLVEPNP_IPPE,
        &none,
        &none,
        &mut Mat::default(),
    )?;
    let mut poses = Vec::new();
    for (rotation, translation) in rotations.iter().zip(translations.iter()) {
        let pose = Isometry3::from_parts(
            Translation3::from(vector(&translation)?),
            UnitQuaternion::from_scaled_axis(vector(&rotation)?),
        );
        poses.push(pose * Translation3::from(-center));
    }
    Ok(poses)
}

fn vector(mat: &Mat) -> opencv::Result<Vector3<f64>> {
    Ok(Vector3::new(*mat.at::<f64>(0)?, *mat.at::<f64>(1)?, *mat.at::<f64>(2)?))
}
