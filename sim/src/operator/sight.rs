//! Which tags a camera can see, by the renderer's own geometry: the truth that tracking is measured against.

use nalgebra::{Isometry3, Point2, Point3, Vector3};

use super::ink::MARGIN_RATIO;
use super::motion::Body;
use super::studio::Studio;
use super::view::View;

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
    /// The tags that one camera has before it at a time, whole in its image, covered or not.
    pub fn sightings(&self, camera: usize, t_s: f64) -> Vec<Sighting> {
        let (camera, lamp, view) = self.instant(camera, t_s);
        let (facets, limbs) = view.all();
        let posture = self.scene().motion.posture(t_s);
        let mut sightings = Vec::new();
        for (solid_index, solid) in self.solids().iter().enumerate() {
            let camera_from_shell = camera.world_from_camera.inverse() * posture.of(solid.body);
            for (facet_index, facet) in solid.facets.iter().enumerate() {
                let Some(number) = view.number_of((solid_index, facet_index)) else { continue };
                let camera_from_facet = camera_from_shell * facet.shell_from_facet;
                for tag in &facet.tags {
                    let at = |x: f64, y: f64| {
                        let (c, s) = (tag.x_axis[0], tag.x_axis[1]);
                        let h = tag.size_m / 2.0;
                        camera_from_facet
                            * Point3::new(
                                tag.center.x + h * (c * x - s * y),
                                tag.center.y + h * (s * x + c * y),
                                0.0,
                            )
                    };
                    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                        .map(|(x, y)| camera.project(&at(x, y)).filter(|pixel| camera.contains(pixel)));
                    let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
                    let corners_px = [a, b, c, d];
                    let clear = samples().all(|(x, y)| {
                        let p = at(x, y);
                        let ray = [(p.x / p.z) as f32, (p.y / p.z) as f32];
                        view.trace(&facets, &limbs, ray, 0, lamp)
                            .is_some_and(|hit| View::is_facet(hit.key, number))
                    });
                    let side_px = (0..4)
                        .map(|i| (corners_px[(i + 1) % 4] - corners_px[i]).norm())
                        .fold(f64::INFINITY, f64::min);
                    sightings.push(Sighting {
                        body: solid.body,
                        id: tag.id,
                        corners_px,
                        side_px,
                        facing_rad: facing(&camera_from_facet, &at(0.0, 0.0)),
                        clear,
                    });
                }
            }
        }
        sightings
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
