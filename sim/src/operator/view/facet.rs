//! A facet with its tags, ready to be hit.
//!
//! A facet is hit by a ray d = (x, y, 1) where its plane is: with `facet_from_camera` = (R, t) and rows
//! r1, r2, r3 of R, the hit is at (u, v) = ((t_z r1 - t_x r3) . d, (t_z r2 - t_y r3) . d) / -(r3 . d) in the
//! facet's plane, at depth z = -t_z / (r3 . d). Each slice of the exposure has these ten numbers.

use nalgebra::{Isometry3, Vector3};

use super::passage::{Passage, Slice};
use super::{Hit, Lamp};
use crate::operator::course::Course;
use crate::operator::ink::{Bitmap, CELLS, MARGIN_RATIO};
use crate::operator::lens::Ray;
use crate::operator::shutter::Shutter;
use crate::operator::solid::{Facet, PrintedTag};

/// Reflectance of the paper and of the ink on it.
const WHITE: f32 = 0.86;
const BLACK: f32 = 0.055;

/// A facet that faces the camera all through the exposure of some row.
#[derive(Debug)]
pub(super) struct SeenFacet {
    /// Index of the prop and of the facet in it.
    pub(super) place: (usize, usize),
    pub(super) passage: Passage,
    /// Inside where a u + b v + c >= 0 for all edges.
    edges: Vec<[f32; 3]>,
    tags: Vec<SeenTag>,
    /// Light on it: constant, per metre of u, per metre of v.
    light: [f32; 3],
}

#[derive(Debug)]
struct SeenTag {
    center: [f32; 2],
    x_axis: [f32; 2],
    half_m: f32,
    cells_per_m: f32,
    white: Bitmap,
}

impl SeenFacet {
    /// `None` if no row sees it.
    pub(super) fn new(
        shutter: &Shutter<'_>,
        place: (usize, usize),
        facet: &Facet,
        course: &Course,
        lamp: &Lamp,
    ) -> Option<Self> {
        let camera_from_facet: Vec<Isometry3<f64>> =
            course.poses().iter().map(|pose| pose * facet.shell_from_facet).collect();
        let passage = Passage::new(shutter, &facet.polygon, course, &camera_from_facet)?;
        let n = facet.polygon.len();
        let edges = (0..n)
            .map(|i| {
                let (a, b) = (facet.polygon[i], facet.polygon[(i + 1) % n]);
                let inward = nalgebra::Vector2::new(a.y - b.y, b.x - a.x).normalize();
                [inward.x as f32, inward.y as f32, -inward.dot(&a.coords) as f32]
            })
            .collect();
        let middle = &camera_from_facet[camera_from_facet.len() / 2];
        let axis = |v: Vector3<f64>| -> Vector3<f32> { (middle.rotation * v).cast() };
        let on = lamp.on(&axis(Vector3::z()));
        let light = [
            on * lamp.gradient_at(&middle.translation.vector.cast()),
            on * lamp.gradient.dot(&axis(Vector3::x())),
            on * lamp.gradient.dot(&axis(Vector3::y())),
        ];
        let tags = facet.tags.iter().map(SeenTag::new).collect();
        Some(Self { place, passage, edges, tags, light })
    }

    #[inline]
    pub(super) fn hit(&self, number: u16, [x, y]: Ray, row: usize, slice: usize) -> Option<Hit> {
        let Slice { u, v, w, nearness } = self.passage.slice(row, slice);
        let along = |row: &[f32; 3]| row[0] * x + row[1] * y + row[2];
        let distance = along(w);
        if distance <= 0.0 {
            return None;
        }
        let (u, v) = (along(u) / distance, along(v) / distance);
        if self.edges.iter().any(|[a, b, c]| a * u + b * v + c < 0.0) {
            return None;
        }
        let white = self.tags.iter().all(|tag| tag.is_white_at(u, v));
        let reflectance = if white { WHITE } else { BLACK };
        Some(Hit {
            nearness: distance * nearness,
            light: reflectance * (self.light[0] + self.light[1] * u + self.light[2] * v),
            key: u32::from(number) << 1 | u32::from(white),
        })
    }
}

impl SeenTag {
    fn new(tag: &PrintedTag) -> Self {
        let half_m = tag.size_m * MARGIN_RATIO / 2.0;
        Self {
            center: [tag.center.x as f32, tag.center.y as f32],
            x_axis: tag.x_axis.map(|v| v as f32),
            half_m: half_m as f32,
            cells_per_m: (CELLS as f64 / (2.0 * half_m)) as f32,
            white: tag.bitmap,
        }
    }

    /// Paper is white outside the tag.
    #[inline]
    fn is_white_at(&self, u: f32, v: f32) -> bool {
        let (du, dv) = (u - self.center[0], v - self.center[1]);
        let x = du * self.x_axis[0] + dv * self.x_axis[1];
        let y = dv * self.x_axis[0] - du * self.x_axis[1];
        let column = (x + self.half_m) * self.cells_per_m;
        let row = (self.half_m - y) * self.cells_per_m;
        if column < 0.0 || row < 0.0 {
            return true;
        }
        self.white.get(row as usize).and_then(|cells| cells.get(column as usize)).copied().unwrap_or(true)
    }
}
