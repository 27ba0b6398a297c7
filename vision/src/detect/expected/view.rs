//! How a tag lies in one image, as far as it is known: what is found of it is refused here if it cannot be read.

use nalgebra::{Matrix3, Point2, Vector2, Vector3};

use super::bend::Bend;
use super::pattern::{MIDDLE, Pattern};
use super::places::{Local, Places};
use super::sample::Scene;
use super::{Expectation, Refusal};
use crate::camera::Camera;
use crate::image::GrayImage;

/// Tags with shorter sides than this are not read: their cells are smaller than 1.5 pixels.
const LEAST_SIDE_PX: f64 = 12.0;

/// How a tag lies in the image.
#[derive(Debug, Clone, Copy)]
pub struct View {
    pub local: Local,
    pub bend: Bend,
    /// The direction in which it moves, if it is known.
    pub way: Option<Way>,
    /// By rows; the last number is 1.
    pub cells_from_local: [f64; 9],
    pub local_from_cells: Matrix3<f64>,
    pub places: Places,
    /// Outer corners of the white margin: (0, 0), (10, 0), (10, 10), (0, 10) in cells.
    pub margin_px: [Point2<f64>; 4],
    pub middle_px: Point2<f64>,
    /// Length of the gradients of u and v in the image.
    pub cells_per_px: [f64; 2],
    /// Cosine of the angle between these gradients.
    pub correlation: f64,
    /// The shorter side of the black square.
    pub side_px: f64,
}

/// What does not change when the tag is found to lie a little elsewhere.
struct Moving {
    local: Local,
    bend: Bend,
    way: Option<Way>,
}

/// Where a tag is after it has moved by a pixel.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    pub local_per_px: [f64; 2],
    pub cells_per_px: [f64; 2],
}

impl Way {
    /// Of slower motions the direction is not known well; no exposure makes a pixel of them.
    const LEAST_PX_S: f64 = 50.0;

    fn new(local: &Local, cells_from_local: &Matrix3<f64>, rate: &Matrix3<f64>) -> Option<Self> {
        let middle = local.origin.push(1.0);
        let moving = rate * middle;
        let by_s = (moving.xy() - local.origin * moving.z) / local.unit;
        let px_s = (local.px_by_local * by_s).norm();
        let per_px = by_s / px_s;
        // At the middle, where u and v are as their first derivatives say.
        let h = cells_from_local / cells_from_local[(2, 2)];
        let of =
            |row: usize| (0..2).map(|k| (h[(row, k)] - h[(row, 2)] * h[(2, k)]) * per_px[k]).sum::<f64>();
        (px_s > Self::LEAST_PX_S).then(|| Self { local_per_px: per_px.into(), cells_per_px: [of(0), of(1)] })
    }
}

/// The outer corners of the white margin.
const MARGIN: [[f64; 2]; 4] = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];

impl View {
    pub fn new(camera: &Camera, expectation: &Expectation) -> Result<Self, Refusal> {
        let ideal_from_cells = &expectation.ideal_from_cells;
        let ideal = |[u, v]: [f64; 2]| {
            let p = ideal_from_cells * Vector3::new(u, v, 1.0);
            (p.z > 0.0).then(|| Vector2::new(p.x / p.z, p.y / p.z))
        };
        let origin = ideal([MIDDLE, MIDDLE]).ok_or(Refusal::Outside)?;
        let [Some(a), Some(b), Some(c), Some(d)] = MARGIN.map(ideal) else { return Err(Refusal::Outside) };
        let unit = [a, b, c, d].into_iter().map(|end| (end - origin).norm()).fold(0.0, f64::max);
        let local = Local::new(camera, origin, unit);
        let (inv_unit, moved) = (1.0 / unit, -origin / unit);
        let local_from_ideal = Matrix3::new(inv_unit, 0.0, moved.x, 0.0, inv_unit, moved.y, 0.0, 0.0, 1.0);
        let local_from_cells = local_from_ideal * ideal_from_cells;
        let rate = &expectation.ideal_rate;
        let way = local_from_cells.try_inverse().and_then(|inverse| Way::new(&local, &inverse, rate));
        let moving = Moving { local, bend: Bend::new(camera, &local, rate), way };
        Self::within(camera, &moving, &local_from_cells)
    }

    /// A tag in local coordinates that are already there.
    fn within(
        camera: &Camera,
        &Moving { local, bend, way }: &Moving,
        local_from_cells: &Matrix3<f64>,
    ) -> Result<Self, Refusal> {
        let inverse = local_from_cells.try_inverse().ok_or(Refusal::Small)?;
        let scale = 1.0 / inverse[(2, 2)];
        let places = local.places(local_from_cells);
        let margin_px = MARGIN.map(|[u, v]| places.pixel(u, v));
        if !margin_px.iter().all(|corner| camera.contains(corner)) {
            return Err(Refusal::Outside);
        }
        let [a, b, c, d] = margin_px;
        let along_u = ((b - a) + (c - d)) / 20.0;
        let along_v = ((d - a) + (c - b)) / 20.0;
        let side_px = 8.0 * along_u.norm().min(along_v.norm());
        let area = along_u.perp(&along_v);
        if side_px < LEAST_SIDE_PX || area < 0.1 * along_u.norm() * along_v.norm() {
            return Err(Refusal::Small);
        }
        Ok(Self {
            local,
            bend,
            way,
            cells_from_local: std::array::from_fn(|k| inverse[(k / 3, k % 3)] * scale),
            local_from_cells: *local_from_cells,
            places,
            margin_px,
            middle_px: places.pixel(MIDDLE, MIDDLE),
            cells_per_px: [along_v.norm() / area, along_u.norm() / area],
            // The gradient of u stands across the lines of equal u, which run along v; and the other way round.
            correlation: -along_u.dot(&along_v) / (along_u.norm() * along_v.norm()),
            side_px,
        })
    }

    fn moving(&self) -> Moving {
        Moving { local: self.local, bend: self.bend, way: self.way }
    }

    /// The same tag moved in the image.
    pub fn shifted(&self, camera: &Camera, shift_px: Vector2<f64>) -> Result<Self, Refusal> {
        let by_px = self.local.px_by_local.try_inverse().ok_or(Refusal::Small)?;
        let shift = Matrix3::new_translation(&(by_px * shift_px));
        Self::within(camera, &self.moving(), &(shift * self.local_from_cells))
    }

    /// The tag as it was fitted in this view's local coordinates.
    pub fn fitted(&self, camera: &Camera, cells_from_local: &[f64; 9]) -> Result<Self, Refusal> {
        let inverse = Matrix3::from_row_slice(cells_from_local).try_inverse().ok_or(Refusal::Misfit)?;
        Self::within(camera, &self.moving(), &inverse)
    }

    /// What pixels are picked from.
    pub fn scene<'a>(&self, image: &'a GrayImage, pattern: &'a Pattern) -> Scene<'a> {
        /// What lies beyond the margin by more than this is none of the tag's.
        const SPARE_PX: f64 = 2.0;
        let bound = |axis: usize, fold: fn(f64, f64) -> f64, start: f64| {
            self.margin_px.iter().map(|corner| corner[axis]).fold(start, fold)
        };
        let low = [0, 1].map(|axis| (bound(axis, f64::min, f64::INFINITY) - SPARE_PX) as i32);
        let high = [0, 1].map(|axis| (bound(axis, f64::max, 0.0) + SPARE_PX) as i32);
        Scene {
            image,
            pattern,
            places: self.places,
            local: self.local,
            bend: self.bend,
            bounds_px: [low, high],
            cells_per_px: self.cells_per_px,
        }
    }
}
