//! What cameras would report of a moving shell, without images.

use nalgebra::{Isometry3, Point2};

use crate::camera::Camera;
use crate::detect::CornerCovariance;
use crate::pose::Observation;
use crate::shells::Shell;
use crate::testing::Noise;

/// What one camera reports of a shell that moves: the tags that face it by 60 degrees and less, each corner
/// where the shell is when the corner's row is exposed.
pub fn observe(
    shell: &Shell,
    cameras: &[Camera],
    camera: usize,
    capture_ns: u64,
    pose_at: &dyn Fn(f64) -> Isometry3<f64>,
    sigma_px: f64,
    noise: &mut Noise,
) -> Vec<Observation> {
    /// Rows do not depend much on the time that they determine: a few rounds settle it.
    const ROUNDS: usize = 4;
    let described = &cameras[camera];
    let capture_s = capture_ns as f64 * 1e-9;
    let mut observations = Vec::new();
    for (index, tag) in shell.tags.iter().enumerate() {
        let camera_from_shell = described.world_from_camera.inverse() * pose_at(capture_s);
        let sight = -(camera_from_shell * tag.center()).coords.normalize();
        if (camera_from_shell * tag.normal()).dot(&sight) < 0.5 {
            continue;
        }
        let corners = tag.corners().map(|corner| {
            let mut pixel = described.project(&(camera_from_shell * corner))?;
            for _ in 0..ROUNDS {
                let pose = pose_at(capture_s + described.row_delay_s(pixel.y));
                pixel = described.project(&(described.world_from_camera.inverse() * pose * corner))?;
            }
            Some(pixel)
        });
        let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
        let corners_px = [a, b, c, d].map(|corner| {
            Point2::new(corner.x + sigma_px * noise.normal(), corner.y + sigma_px * noise.normal())
        });
        let covariance_px2 = CornerCovariance::from_diagonal_element(sigma_px.powi(2));
        observations.push(Observation { camera, tag: index, capture_ns, corners_px, covariance_px2 });
    }
    observations
}
