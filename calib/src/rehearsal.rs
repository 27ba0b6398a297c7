//! What cameras would report of a moving board or shell, without images: for tests and evaluations, which know the truth.

use locoman_vision::camera::Camera;
use locoman_vision::detect::CornerCovariance;
use locoman_vision::pose::Observation;
use locoman_vision::shells::{Shell, ShellTag};
use nalgebra::{Isometry3, Point2};

/// How well a stand-in detector reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Standard deviation of a corner per axis, pixels.
    pub sigma_px: f64,
    /// The shortest side of a tag that is read, pixels.
    pub least_side_px: f64,
    /// The least cosine between a tag's normal and the sight that is read.
    pub least_cosine: f64,
}

impl Default for Reading {
    fn default() -> Self {
        Self { sigma_px: 0.05, least_side_px: 16.0, least_cosine: 0.4 }
    }
}

/// What one camera reports of a body at one capture time: the tags that it can read, each corner where the body is when
/// the corner's row is exposed.
///
/// `seconds` is the true time of the capture (the body's `world_from_body` is asked for about it), `capture_ns` what the
/// camera's clock says; `normal` draws numbers of zero mean and unit variance.
#[expect(clippy::too_many_arguments, reason = "a stand-in for a detector, a camera and a body at once")]
pub fn observe(
    body: &Shell,
    camera: &Camera,
    index: usize,
    capture_ns: u64,
    seconds: f64,
    world_from_body: &dyn Fn(f64) -> Isometry3<f64>,
    reading: &Reading,
    normal: &mut dyn FnMut() -> f64,
) -> Vec<Observation> {
    let mut observations = Vec::new();
    for (tag, drawn) in body.tags.iter().enumerate() {
        let Some(corners) = corners(drawn, camera, seconds, world_from_body, reading) else { continue };
        let corners_px = corners
            .map(|c| Point2::new(c.x + reading.sigma_px * normal(), c.y + reading.sigma_px * normal()));
        let covariance_px2 = CornerCovariance::from_diagonal_element(reading.sigma_px.powi(2));
        observations.push(Observation { camera: index, tag, capture_ns, corners_px, covariance_px2 });
    }
    observations
}

/// Where a tag's corners are in the image; `None` if it is not read.
fn corners(
    tag: &ShellTag,
    camera: &Camera,
    seconds: f64,
    world_from_body: &dyn Fn(f64) -> Isometry3<f64>,
    reading: &Reading,
) -> Option<[Point2<f64>; 4]> {
    /// Rows do not depend much on the time that they determine: a few rounds settle it.
    const ROUNDS: usize = 4;
    let camera_from_world = camera.world_from_camera.inverse();
    let camera_from_body = camera_from_world * world_from_body(seconds);
    let center = camera_from_body * tag.center();
    if (camera_from_body * tag.normal()).dot(&-center.coords.normalize()) < reading.least_cosine {
        return None;
    }
    let corner = |corner| {
        let mut pixel = camera.project(&(camera_from_body * corner))?;
        for _ in 0..if camera.line_time_s == 0.0 { 0 } else { ROUNDS } {
            let pose = world_from_body(seconds + camera.row_delay_s(pixel.y));
            pixel = camera.project(&(camera_from_world * pose * corner))?;
        }
        camera.contains(&pixel).then_some(pixel)
    };
    let [a, b, c, d] = tag.corners().map(corner);
    let corners = [a?, b?, c?, d?];
    let side = |k: usize| (corners[(k + 1) % 4] - corners[k]).norm();
    ((0..4).all(|k| side(k) >= reading.least_side_px)).then_some(corners)
}
