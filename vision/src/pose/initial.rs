//! First poses of a shell, from single tags by OpenCV's planar PnP, and the mirrored twin of a pose.
//!
//! IPPE (Collins and Bartoli, "Infinitesimal plane-based pose estimation", 2014) gives both poses under
//! which a square looks alike. Each tag speaks for the whole shell, so a wrong one cannot spoil the others.

use nalgebra::{Isometry3, Point2, Translation3, Unit, UnitQuaternion, Vector3};
use opencv::calib3d::{self, SolvePnPMethod};
use opencv::core::{Mat, MatExprTraitConst, MatTraitConst, Point2d, Point3d, Vector};

use super::state::State;
use super::{Fate, Observation, Views};

/// Tags that are asked, the largest first.
const ASKED_TAGS: usize = 6;

/// Start poses, in no order.
pub(super) fn hypotheses(views: &Views<'_>) -> Vec<Isometry3<f64>> {
    let mut order: Vec<&Observation> = views.observations.iter().collect();
    order.sort_by(|a, b| area_px2(&b.corners_px).total_cmp(&area_px2(&a.corners_px)));
    let poses = order.into_iter().take(ASKED_TAGS);
    poses.flat_map(|observation| from_tag(views, observation).unwrap_or_default()).collect()
}

/// The state under which the largest tag that is used looks nearly the same: its normal reflected about the
/// line of sight, its centre where it was. `None` if it faces the camera straight: then there is no other.
pub(super) fn mirrored(views: &Views<'_>, fates: &[Fate], state: &State) -> Option<State> {
    let used = views.observations.iter().zip(fates).filter(|(_, fate)| **fate == Fate::Used);
    let largest = used.max_by(|a, b| area_px2(&a.0.corners_px).total_cmp(&area_px2(&b.0.corners_px)))?.0;
    let tag = views.shell.tags.get(largest.tag)?;
    let camera = views.cameras.get(largest.camera)?;
    let pose = state.world_from_shell;
    let center = pose * tag.center();
    let sight = (camera.world_from_camera.translation.vector - center.coords).normalize();
    let normal = pose * tag.normal();
    let axis = Unit::try_new(normal.cross(&sight), 1e-6)?;
    let turn = UnitQuaternion::from_axis_angle(&axis, 2.0 * normal.angle(&sight));
    let about_center = Translation3::from(center.coords) * turn * Translation3::from(-center.coords);
    // The rate in shell axes turns with the shell: in the world it stays as it was.
    let world_from_shell = about_center * pose;
    let rate_in_world = pose.rotation * state.rate_rad_s;
    Some(State {
        world_from_shell,
        rate_rad_s: world_from_shell.rotation.inverse() * rate_in_world,
        ..*state
    })
}

/// Twice the area of a quadrilateral.
fn area_px2(corners: &[Point2<f64>; 4]) -> f64 {
    (corners[2] - corners[0]).perp(&(corners[3] - corners[1])).abs()
}

/// The shell's poses that one tag in one view allows.
fn from_tag(views: &Views<'_>, observation: &Observation) -> opencv::Result<Vec<Isometry3<f64>>> {
    let (camera, tag) = (views.cameras.get(observation.camera), views.shell.tags.get(observation.tag));
    let (Some(camera), Some(tag)) = (camera, tag) else { return Ok(Vec::new()) };
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
