//! Which tags a camera can see, by the renderer's own geometry: the truth that tracking is measured against.

use locoman_vision::camera::Camera;
use nalgebra::{Isometry3, Point2, Point3, Vector3};

use super::ink::MARGIN_RATIO;
use super::motion::Body;
use super::shutter::seen_by_its_rows;
use super::solid::PrintedTag;
use super::studio::Studio;
use super::view::{Candidates, Lamp, View};

/// A tag that faces a camera and lies in its image.
#[derive(Debug, Clone, PartialEq)]
pub struct Sighting {
    /// Who wears it.
    pub body: Body,
    /// Its number.
    pub id: u32,
    /// Where its corners appear, in the detector's order: bottom left, bottom right, top right, top left.
    pub corners_px: [Point2<f64>; 4],
    /// Its shortest side in the image.
    pub side_px: f64,
    /// Angle between its normal and the direction to the camera.
    pub facing_rad: f64,
    /// Whether nothing covers any part of it or of its white margin.
    pub clear: bool,
}

impl Sighting {
    /// Whether a good detector should find it: wholly uncovered, seen at less than 65 degrees, with sides of
    /// at least 16 pixels (two a cell).
    pub fn is_readable(&self) -> bool {
        const MOST_FACING_DEG: f64 = 65.0;
        const LEAST_SIDE_PX: f64 = 16.0;
        self.clear && self.facing_rad < MOST_FACING_DEG.to_radians() && self.side_px >= LEAST_SIDE_PX
    }
}

impl Studio {
    /// The tags that one camera has before it at a capture time, whole in its image, covered or not. Each corner
    /// is where its own row sees it, at the middle of that row's exposure. Tags that are off their shells are not
    /// among them.
    pub fn sightings(&self, camera: usize, t_s: f64) -> Vec<Sighting> {
        let covered = self.is_covered(camera, t_s);
        let (lamp, view) = self.sharp_view(camera, t_s);
        let camera = self.true_camera(camera, t_s);
        let look = Look { camera, capture_s: t_s, lamp, all: view.all(), view };
        let at_capture = self.true_posture(t_s);
        let events = &self.scene().events;
        let mut sightings = Vec::new();
        for (solid_index, solid) in self.solids().iter().enumerate() {
            let camera_from_world = camera.world_from_camera.inverse();
            for (facet_index, facet) in solid.facets.iter().enumerate() {
                let Some(number) = look.view.number_of((solid_index, facet_index)) else { continue };
                let camera_from_facet = |time_s: f64| {
                    let posture = if time_s == t_s { at_capture } else { self.true_posture(time_s) };
                    camera_from_world * posture.of(solid.body) * facet.shell_from_facet
                };
                let tags = facet.tags.iter().filter(|tag| events.tear_of(tag.id, t_s).is_none());
                sightings.extend(tags.filter_map(|tag| {
                    let seen = look.at(solid.body, camera_from_facet, tag, number)?;
                    Some(Sighting { clear: seen.clear && !covered, ..seen })
                }));
            }
        }
        sightings
    }
}

/// One camera's look at the scene.
struct Look<'a> {
    camera: &'a Camera,
    capture_s: f64,
    lamp: &'a Lamp,
    view: View,
    all: Vec<Candidates>,
}

impl Look<'_> {
    /// `None` if a corner is outside the image.
    fn at(
        &self,
        body: Body,
        camera_from_facet: impl Fn(f64) -> Isometry3<f64>,
        tag: &PrintedTag,
        facet: u16,
    ) -> Option<Sighting> {
        let (camera, capture_s) = (self.camera, self.capture_s);
        let on_facet = |x: f64, y: f64| {
            let (c, s) = (tag.x_axis[0], tag.x_axis[1]);
            let h = tag.size_m / 2.0;
            Point3::new(tag.center.x + h * (c * x - s * y), tag.center.y + h * (s * x + c * y), 0.0)
        };
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| {
            let corner = on_facet(x, y);
            seen_by_its_rows(camera, capture_s, |t_s| camera_from_facet(t_s) * corner)
                .filter(|(pixel, _)| camera.contains(pixel))
        });
        let [Some((a, ta)), Some((b, tb)), Some((c, tc)), Some((d, td))] = corners else { return None };
        let corners_px = [a, b, c, d];

        // Over the rows of one tag it moves straight on.
        let times = [ta, tb, tc, td];
        let begin_s = times.into_iter().fold(f64::INFINITY, f64::min);
        let end_s = times.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let (first, last) = (camera_from_facet(begin_s), camera_from_facet(end_s));
        let between = |point: Point3<f64>, t_s: f64| -> Point3<f64> {
            let share = if end_s > begin_s { (t_s - begin_s) / (end_s - begin_s) } else { 0.0 };
            (first * point).coords.lerp(&(last * point).coords, share).into()
        };
        let clear = samples().all(|(x, y)| {
            let point = on_facet(x, y);
            let seen = seen_by_its_rows(camera, capture_s, |t_s| between(point, t_s));
            seen.is_some_and(|(pixel, t_s)| {
                let p = between(point, t_s);
                let ray = [(p.x / p.z) as f32, (p.y / p.z) as f32];
                let row = pixel.y.round().clamp(0.0, f64::from(camera.height - 1)) as usize;
                let band = &self.all[self.view.band_of(row)];
                let hit = self.view.trace(band, ray, row, 0, self.lamp);
                hit.is_some_and(|hit| View::is_facet(hit.key, facet))
            })
        });
        let side_px =
            (0..4).map(|i| (corners_px[(i + 1) % 4] - corners_px[i]).norm()).fold(f64::INFINITY, f64::min);
        let center = between(on_facet(0.0, 0.0), 0.5 * (begin_s + end_s));
        let facing_rad = facing(&first, &center);
        Some(Sighting { body, id: tag.id, corners_px, side_px, facing_rad, clear })
    }
}

/// Places over the printed tag, its margin nearly included, in half sides of the black square.
fn samples() -> impl Iterator<Item = (f64, f64)> {
    const LINES: u8 = 7;
    const REACH: f64 = 0.98 * MARGIN_RATIO;
    let place = |i: u8| REACH * (2.0 * f64::from(i) / f64::from(LINES - 1) - 1.0);
    (0..LINES).flat_map(move |i| (0..LINES).map(move |j| (place(i), place(j))))
}

fn facing(camera_from_facet: &Isometry3<f64>, center: &Point3<f64>) -> f64 {
    let normal = camera_from_facet.rotation * Vector3::z();
    normal.angle(&-center.coords)
}
