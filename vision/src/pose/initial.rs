//! First poses of a shell, from single tags by OpenCV's planar PnP.
//!
//! IPPE (Collins and Bartoli, "Infinitesimal plane-based pose estimation", 2014) gives both poses under
//! which a square looks alike. Each tag speaks for the whole shell, so a wrong one cannot spoil the others.

use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector3};
use opencv::calib3d::{self, SolvePnPMethod};
use opencv::core::{Mat, MatExprTraitConst, MatTraitConst, Point2d, Point3d, Vector};

use super::problem::Problem;

/// Tags that are asked, the largest first.
const ASKED_TAGS: usize = 6;
/// Poses that are worth refining, those that explain all views best first.
const KEPT: usize = 4;

/// Start poses, the best first.
pub(super) fn hypotheses(problem: &Problem<'_>) -> Vec<Isometry3<f64>> {
    let mut order: Vec<usize> = (0..problem.observations.len()).collect();
    order.sort_by(|a, b| {
        let area = |k: &usize| area_px2(&problem.observations[*k].corners_px);
        area(b).total_cmp(&area(a))
    });
    let everything = vec![true; problem.observations.len()];
    let mut scored: Vec<(f64, Isometry3<f64>)> = order
        .iter()
        .take(ASKED_TAGS)
        .flat_map(|k| from_tag(problem, *k).unwrap_or_default())
        .map(|pose| (problem.cost(&pose, &everything), pose))
        .collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    scored.into_iter().take(KEPT).map(|(_, pose)| pose).collect()
}

/// Twice the area of a quadrilateral.
fn area_px2(corners: &[Point2<f64>; 4]) -> f64 {
    (corners[2] - corners[0]).perp(&(corners[3] - corners[1])).abs()
}

/// The shell's poses that one tag in one view allows.
fn from_tag(problem: &Problem<'_>, k: usize) -> opencv::Result<Vec<Isometry3<f64>>> {
    let observation = &problem.observations[k];
    let camera = &problem.cameras[observation.camera];
    let tag = &problem.shell.tags[observation.tag];
    let half = tag.size_m / 2.0;
    let object: Vector<Point3d> = [(-half, -half), (half, -half), (half, half), (-half, half)]
        .into_iter()
        .map(|(x, y)| Point3d::new(x, y, 0.0))
        .collect();
    // Rays instead of pixels: our own camera models stand for any lens.
    let image: Vector<Point2d> = observation
        .corners_px
        .iter()
        .map(|corner| camera.unproject(corner))
        .map(|ray| Point2d::new(ray.x, ray.y))
        .collect();
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
        let camera_from_tag = Isometry3::from_parts(
            Translation3::from(vector(&translation)?),
            UnitQuaternion::from_scaled_axis(vector(&rotation)?),
        );
        let in_front = camera_from_tag.translation.z > 0.0;
        let pose = camera.world_from_camera * camera_from_tag * tag.shell_from_tag.inverse();
        if in_front && pose.to_homogeneous().iter().all(|number| number.is_finite()) {
            poses.push(pose);
        }
    }
    Ok(poses)
}

fn vector(mat: &Mat) -> opencv::Result<Vector3<f64>> {
    Ok(Vector3::new(*mat.at::<f64>(0)?, *mat.at::<f64>(1)?, *mat.at::<f64>(2)?))
}
