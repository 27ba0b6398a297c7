//! A facet with its tags, ready to be hit.
//!
//! A facet is hit by a ray d = (x, y, 1) where its plane is: with `facet_from_camera` = (R, t) and rows
//! r1, r2, r3 of R, the hit is at (u, v) = ((t_z r1 - t_x r3) . d, (t_z r2 - t_y r3) . d) / -(r3 . d) in the
//! facet's plane, at depth z = -t_z / (r3 . d). Each slice of the exposure has these nine numbers.

use locoman_vision::camera::Camera;
use nalgebra::{Isometry3, Point3, Vector3};

use super::{Bounds, Hit, Lamp};
use crate::operator::ink::{Bitmap, CELLS, MARGIN_RATIO};
use crate::operator::lens::Ray;
use crate::operator::solid::{Facet, PrintedTag};

/// Reflectance of the paper and of the ink on it.
const WHITE: f32 = 0.86;
const BLACK: f32 = 0.055;

/// A facet that faces the camera all through the exposure.
#[derive(Debug)]
pub(super) struct SeenFacet {
    /// Index of the solid and of the facet in it.
    pub(super) place: (usize, usize),
    /// One for each slice of the exposure.
    slices: Vec<Slice>,
    /// Inside where a u + b v + c >= 0 for all edges.
    edges: Vec<[f32; 3]>,
    tags: Vec<SeenTag>,
    /// Light on it: constant, per metre of u, per metre of v.
    light: [f32; 3],
    pub(super) bounds: Option<Bounds>,
}

#[derive(Debug, Clone, Copy)]
struct Slice {
    u: [f32; 3],
    v: [f32; 3],
    w: [f32; 3],
    /// nearness = w . d * this.
    nearness: f32,
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
    /// `None` if it faces away at some time of the exposure.
    pub(super) fn new(
        camera: &Camera,
        place: (usize, usize),
        facet: &Facet,
        camera_from_shell: &[Isometry3<f64>],
        lamp: &Lamp,
    ) -> Option<Self> {
        let camera_from_facet: Vec<Isometry3<f64>> =
            camera_from_shell.iter().map(|pose| pose * facet.shell_from_facet).collect();
        let slices = camera_from_facet.iter().map(Slice::new).collect::<Option<Vec<_>>>()?;
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
        let ends = [camera_from_facet.first(), camera_from_facet.last()].into_iter().flatten();
        let outline =
            ends.flat_map(|pose| facet.polygon.iter().map(move |p| pose * Point3::new(p.x, p.y, 0.0)));
        Some(Self {
            place,
            slices,
            edges,
            tags: facet.tags.iter().map(SeenTag::new).collect(),
            light,
            bounds: Bounds::of(camera, outline, 0.0),
        })
    }

    #[inline]
    pub(super) fn hit(&self, number: u16, [x, y]: Ray, slice: usize) -> Option<Hit> {
        let slice = &self.slices[slice];
        let along = |row: &[f32; 3]| row[0] * x + row[1] * y + row[2];
        let w = along(&slice.w);
        if w <= 0.0 {
            return None;
        }
        let (u, v) = (along(&slice.u) / w, along(&slice.v) / w);
        if self.edges.iter().any(|[a, b, c]| a * u + b * v + c < 0.0) {
            return None;
        }
        let white = self.tags.iter().all(|tag| tag.is_white_at(u, v));
        let reflectance = if white { WHITE } else { BLACK };
        Some(Hit {
            nearness: w * slice.nearness,
            light: reflectance * (self.light[0] + self.light[1] * u + self.light[2] * v),
            key: u32::from(number) << 1 | u32::from(white),
        })
    }
}

impl Slice {
    fn new(camera_from_facet: &Isometry3<f64>) -> Option<Self> {
        let facet_from_camera = camera_from_facet.inverse();
        let rotation = facet_from_camera.rotation.to_rotation_matrix();
        let t = facet_from_camera.translation.vector;
        if t.z <= 0.0 {
            return None;
        }
        let row = |i: usize| rotation.matrix().row(i).transpose();
        let u = row(0) * t.z - row(2) * t.x;
        let v = row(1) * t.z - row(2) * t.y;
        let w = -row(2);
        let as_f32 = |r: Vector3<f64>| [r.x as f32, r.y as f32, r.z as f32];
        Some(Self { u: as_f32(u), v: as_f32(v), w: as_f32(w), nearness: (1.0 / t.z) as f32 })
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
