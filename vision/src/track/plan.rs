//! Where a camera searches: round the predicted tags of each shell, as finely as their size asks for.
//!
//! Thumb tags are too small for a search of the whole image: a lost thumb is searched round its palm.

use nalgebra::{Point2, Point3, Vector3};

use super::TrackerSettings;
use super::filter::Motion;
use crate::camera::Camera;
use crate::detect::{Rect, Region};
use crate::shells::{Shell, ShellSet};

/// Tags seen more obliquely than this (cosine of the angle between normal and line of sight) are not waited for.
const FACING_COS: f64 = 0.2;

/// Where one camera searches, given where the shells are; for lost thumbs only if it is its turn.
pub(super) fn regions(
    camera: &Camera,
    shells: &ShellSet,
    motions: &[Option<Motion>],
    settings: &TrackerSettings,
    my_turn: bool,
) -> Vec<Region> {
    let region = |(index, (shell, motion)): (usize, (&Shell, &Option<Motion>))| match motion {
        Some(motion) => tags_region(camera, shell, motion, settings),
        None if my_turn => {
            let palm = motions.get(shells.palm_of(index)?)?.as_ref()?;
            thumb_region(camera, palm, settings)
        }
        None => None,
    };
    merged(shells.shells.iter().zip(motions).enumerate().filter_map(region).collect())
}

/// Round the tags of a shell that face the camera.
fn tags_region(
    camera: &Camera,
    shell: &Shell,
    motion: &Motion,
    settings: &TrackerSettings,
) -> Option<Region> {
    let camera_from_shell = camera.world_from_camera.inverse() * motion.world_from_shell;
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
fn thumb_region(camera: &Camera, palm: &Motion, settings: &TrackerSettings) -> Option<Region> {
    let center = camera.world_from_camera.inverse() * palm.world_from_shell * Point3::origin();
    let pixel = camera.project(&center)?;
    let mut bounds = Bounds::default();
    bounds.include(&pixel);
    let reach_px = settings.thumb_reach_m * camera.focal_px.x / center.z;
    Some(Region { rect: bounds.grown(reach_px, camera)?, decimate: 0.5 })
}

/// Joins overlapping regions of the same fineness where that saves pixels.
fn merged(mut regions: Vec<Region>) -> Vec<Region> {
    let mut a = 0;
    while a < regions.len() {
        let joinable = |b: &usize| {
            let (one, other) = (&regions[a], &regions[*b]);
            let joint = one.rect.union(&other.rect).area();
            one.decimate == other.decimate && joint <= one.rect.area() + other.rect.area()
        };
        match (a + 1..regions.len()).find(joinable) {
            None => a += 1,
            Some(b) => {
                let other = regions.remove(b);
                regions[a].rect = regions[a].rect.union(&other.rect);
                // The larger region may now overlap earlier ones.
                a = 0;
            }
        }
    }
    regions
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
