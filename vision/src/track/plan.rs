//! What a camera looks for: the tags of a shell that face it, where the shell is predicted; and regions to search
//! where tags were not as predicted.
//!
//! Thumb tags are too small for a search of the whole image: a lost thumb is searched round its palm.

use nalgebra::{Isometry3, Matrix3, Point2, Point3, Vector3};

use super::TrackerSettings;
use super::filter::Motion;
use crate::camera::Camera;
use crate::detect::expected::Expectation;
use crate::detect::{Rect, Region};
use crate::shells::Shell;

/// Tags seen more obliquely than this (cosine of the angle between normal and line of sight) are not waited for.
const FACING_COS: f64 = 0.2;

/// A tag that should be seen.
#[derive(Debug, Clone)]
pub(super) struct Expected {
    /// Index into the shell's tags.
    pub tag: usize,
    pub expectation: Expectation,
    /// Where its corners should be.
    pub corners_px: [Point2<f64>; 4],
    area_px2: f64,
}

/// The tags of a shell that should be seen by a camera, the largest first.
pub(super) fn expected_tags(
    camera: &Camera,
    shell: &Shell,
    motion: &Motion,
    settings: &TrackerSettings,
    expected: &mut Vec<Expected>,
) {
    expected.clear();
    let doubt_px = doubt_px(camera, shell, motion, settings);
    for (index, tag) in shell.tags.iter().enumerate() {
        let exposed = Exposed::of(camera, motion, &tag.center());
        let Exposed { camera_from_shell, sheared, .. } = exposed;
        let camera_from_tag = camera_from_shell * tag.shell_from_tag;
        let center = camera_from_tag.translation.vector;
        let facing = -(camera_from_tag.rotation * Vector3::z()).dot(&center.normalize());
        if facing < FACING_COS {
            continue;
        }
        let corners = tag.corners().map(|corner| camera.project(&(sheared * (camera_from_shell * corner))));
        let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
        let corners_px = [a, b, c, d];
        if !corners_px.iter().all(|corner| camera.contains(corner)) {
            continue;
        }
        let expectation = Expectation::from_pose(tag.id, &camera_from_tag, tag.size_m, doubt_px);
        let ideal_from_cells = sheared * expectation.ideal_from_cells;
        expected.push(Expected {
            tag: index,
            expectation: Expectation {
                ideal_from_cells,
                ideal_rate: exposed.ideal_rate(&camera_from_tag),
                ..expectation
            },
            corners_px,
            area_px2: (c - a).perp(&(d - b)).abs(),
        });
    }
    // Not the stable kind, which needs memory: two of the same area come in the order of the shell's tags.
    expected.sort_unstable_by(|a, b| b.area_px2.total_cmp(&a.area_px2).then(a.tag.cmp(&b.tag)));
}

/// A place on a moving shell, as the rows of a rolling shutter see it: at 1 m/s, rows that are exposed 14 ms before or
/// after the middle one see a tag 30 pixels from where it is at the capture time.
struct Exposed {
    /// The shell's pose when the row is exposed that sees the place.
    camera_from_shell: Isometry3<f64>,
    /// What the rows above and below it do to points about the place, in the camera frame: each is seen earlier or later,
    /// P' = P + v Δt, with Δt proportional to its distance from the row as that of the pinhole.
    sheared: Matrix3<f64>,
    /// How the shell moves then, in the camera frame: its origin, m/s, and its turning, rad/s.
    velocity_m_s: Vector3<f64>,
    rate_rad_s: Vector3<f64>,
}

impl Exposed {
    fn of(camera: &Camera, motion: &Motion, place: &Point3<f64>) -> Self {
        /// Each brings the row nearer by the share of a row's time in which the image moves by a row: a twentieth.
        const STEPS: usize = 2;
        let camera_from_world = camera.world_from_camera.inverse();
        let mut camera_from_shell = camera_from_world * motion.world_from_shell;
        let state = motion.state();
        let mut delay_s = 0.0;
        let steps = if camera.line_time_s == 0.0 { 0 } else { STEPS };
        for _ in 0..steps {
            let Some(pixel) = camera.project(&(camera_from_shell * place)) else { break };
            delay_s = camera.row_delay_s(pixel.y);
            camera_from_shell = camera_from_world * state.pose_after(delay_s);
        }
        let in_camera = camera_from_shell * place;
        let moving = state.velocity_m_s + state.acceleration_m_s2 * delay_s;
        let velocity_m_s = camera_from_world.rotation * moving;
        let turning = state.rate_rad_s + state.angular_rad_s2 * delay_s;
        let rate_rad_s = camera_from_shell.rotation * turning;
        let velocity = velocity_m_s + rate_rad_s.cross(&(camera_from_shell.rotation * place.coords));
        let rows_per_m = camera.focal_px.y / in_camera.z;
        let later = Vector3::new(0.0, 1.0, -in_camera.y / in_camera.z) * (camera.line_time_s * rows_per_m);
        let sheared = Matrix3::identity() + velocity * later.transpose();
        Self { camera_from_shell, sheared, velocity_m_s, rate_rad_s }
    }

    /// [`Expectation::ideal_rate`] of a tag of the shell: a point P of it moves by Ω × P + (v − Ω × o) a second, where the
    /// shell's origin o moves by v, and nᵀ P / d is 1 on the tag's plane.
    fn ideal_rate(&self, camera_from_tag: &Isometry3<f64>) -> Matrix3<f64> {
        let normal = camera_from_tag.rotation * Vector3::z();
        let distance_m = normal.dot(&camera_from_tag.translation.vector);
        let origin = self.camera_from_shell.translation.vector;
        let moving = self.velocity_m_s - self.rate_rad_s.cross(&origin);
        self.rate_rad_s.cross_matrix() + moving * (normal / distance_m).transpose()
    }
}

/// How far from where they are expected a shell's tags may be.
fn doubt_px(camera: &Camera, shell: &Shell, motion: &Motion, settings: &TrackerSettings) -> f64 {
    let depth_m = (camera.world_from_camera.inverse() * motion.world_from_shell * Point3::origin()).z;
    let variance = motion.pose_covariance();
    let largest = |first: usize| (0..3).map(|k| variance[(first + k, first + k)]).fold(0.0, f64::max).sqrt();
    let doubt_m = largest(0) + largest(3) * shell.radius_m();
    settings.least_doubt_px + settings.margin_sigmas * doubt_m * camera.focal_px.x / depth_m.max(0.1)
}

/// Round the tags of a shell that face the camera.
pub(super) fn tags_region(
    camera: &Camera,
    shell: &Shell,
    motion: &Motion,
    settings: &TrackerSettings,
) -> Option<Region> {
    let Exposed { camera_from_shell, .. } = Exposed::of(camera, motion, &Point3::origin());
    let mut bounds = Bounds::default();
    let mut largest_side_px: f64 = 0.0;
    for tag in &shell.tags {
        let center = camera_from_shell * tag.center();
        let sight: Vector3<f64> = -center.coords.normalize();
        if (camera_from_shell * tag.normal()).dot(&sight) < FACING_COS {
            continue;
        }
        let corners = tag.corners().map(|corner| camera.project(&(camera_from_shell * corner)));
        let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
        [a, b, c, d].iter().for_each(|corner| bounds.include(corner));
        largest_side_px = largest_side_px.max((b - a).norm()).max((d - a).norm());
    }
    let depth_m = (camera_from_shell * Point3::origin()).z;
    let position = motion.pose_covariance().fixed_view::<3, 3>(0, 0).into_owned();
    let doubt_m = position.diagonal().max().sqrt();
    let doubt_px = settings.margin_sigmas * doubt_m * camera.focal_px.x / depth_m;
    // The white margin, an eighth of the tag, has to be inside too.
    let margin_px = settings.margin_px + doubt_px + largest_side_px / 8.0;
    let rect = bounds.grown(margin_px, camera)?;
    let decimate = if largest_side_px > settings.coarse_side_px {
        2.0
    } else if largest_side_px < settings.fine_side_px {
        0.5
    } else {
        1.0
    };
    Some(Region { rect, decimate })
}

/// Round a palm, where its thumb must be.
pub(super) fn thumb_region(camera: &Camera, palm: &Motion, settings: &TrackerSettings) -> Option<Region> {
    let center = camera.world_from_camera.inverse() * palm.world_from_shell * Point3::origin();
    let pixel = camera.project(&center)?;
    let mut bounds = Bounds::default();
    bounds.include(&pixel);
    let reach_px = settings.thumb_reach_m * camera.focal_px.x / center.z;
    Some(Region { rect: bounds.grown(reach_px, camera)?, decimate: 0.5 })
}

/// A growing rectangle in pixel coordinates.
struct Bounds {
    min: [f64; 2],
    max: [f64; 2],
}

impl Default for Bounds {
    fn default() -> Self {
        Self { min: [f64::INFINITY; 2], max: [f64::NEG_INFINITY; 2] }
    }
}

impl Bounds {
    fn include(&mut self, pixel: &Point2<f64>) {
        for axis in 0..2 {
            self.min[axis] = self.min[axis].min(pixel[axis]);
            self.max[axis] = self.max[axis].max(pixel[axis]);
        }
    }

    /// With a margin, clipped to the image; `None` if it is empty or outside.
    fn grown(&self, margin_px: f64, camera: &Camera) -> Option<Rect> {
        let min = self.min.map(|bound| bound - margin_px);
        let max = self.max.map(|bound| bound + margin_px);
        let empty = self.min[0] > self.max[0] || !margin_px.is_finite();
        if empty {
            return None;
        }
        Rect::clipped(min, max, camera.width, camera.height)
    }
}

#[cfg(test)]
mod tests;
