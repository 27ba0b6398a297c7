//! Where a facet is in each slice of the exposure of each row, and where in the image that may show.
//!
//! All rows of a global shutter, and of anything that stands still, share their slices. Otherwise each row that
//! may show the facet has its own: the numbers of a slice change almost linearly in time, so that they are taken
//! straight from one knot of the course to the next.

use nalgebra::{Isometry3, Point2, Point3, Vector3};

use super::{Bounds, Window};
use crate::operator::course::Course;
use crate::operator::shutter::{SLICES, Shutter, seen_by_its_rows};

/// What [`super::facet`] needs to hit a facet.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Slice {
    pub(super) u: [f32; 3],
    pub(super) v: [f32; 3],
    pub(super) w: [f32; 3],
    /// nearness = w . d * this.
    pub(super) nearness: f32,
}

/// How far a facet moves in the image during an exposure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pace {
    /// It stands still.
    Still,
    /// By less than what a cell of a readable tag measures: its two ends tell what comes in between.
    Slow,
    /// Farther: a cell may come and go in between.
    Fast,
}

/// A facet's way through one picture.
#[derive(Debug)]
pub(super) struct Passage {
    /// For each slice of each row, from the first row on.
    slices: Vec<Slice>,
    first_row: usize,
    rows: usize,
    pub(super) bounds: Option<Bounds>,
    pub(super) window: Window,
    pub(super) pace: Pace,
}

impl Passage {
    /// `None` if the facet faces away, or shows in no row.
    pub(super) fn new(
        shutter: &Shutter<'_>,
        polygon: &[Point2<f64>],
        course: &Course,
        camera_from_facet: &[Isometry3<f64>],
    ) -> Option<Self> {
        let outline: Vec<Vec<Point3<f64>>> = camera_from_facet
            .iter()
            .map(|pose| polygon.iter().map(|p| pose * Point3::new(p.x, p.y, 0.0)).collect())
            .collect();
        let planes: Vec<Plane> = camera_from_facet.iter().map(Plane::new).collect();
        match course {
            Course::Slices(_) => Self::for_all_rows(shutter, &outline, &planes),
            Course::Knots { begin_s, step_s, .. } => {
                Self::row_by_row(shutter, &outline, &planes, Knots { begin_s: *begin_s, step_s: *step_s })
            }
        }
    }

    fn for_all_rows(shutter: &Shutter<'_>, outline: &[Vec<Point3<f64>>], planes: &[Plane]) -> Option<Self> {
        let slices = planes.iter().map(Plane::slice).collect::<Option<Vec<_>>>()?;
        let (first, last) = (outline.first()?, outline.last()?);
        let camera = shutter.camera;
        let pixels = |points: &[Point3<f64>]| points.iter().map(|p| camera.project(p)).collect::<Vec<_>>();
        Some(Self {
            slices,
            first_row: 0,
            rows: 1,
            bounds: Bounds::of(camera, first.iter().chain(last).copied(), 0.0),
            window: Window::of_points(outline.iter().flatten()),
            pace: if first == last { Pace::Still } else { pace(&pixels(first), &pixels(last)) },
        })
    }

    fn row_by_row(
        shutter: &Shutter<'_>,
        outline: &[Vec<Point3<f64>>],
        planes: &[Plane],
        knots: Knots,
    ) -> Option<Self> {
        let camera = shutter.camera;
        // Where each corner is seen as its row begins, and ends, to be exposed.
        let seen = |share: f64| -> Vec<Option<Point2<f64>>> {
            let corners = 0..outline.first().map_or(0, Vec::len);
            let capture_s = shutter.capture_s + share * shutter.exposure_s;
            let at = |corner: usize, t_s: f64| {
                let (knot, share) = knots.at(t_s, outline.len());
                outline[knot][corner].coords.lerp(&outline[knot + 1][corner].coords, share).into()
            };
            corners
                .map(|corner| Some(seen_by_its_rows(camera, capture_s, |t_s| at(corner, t_s))?.0))
                .collect()
        };
        let (first, last) = (seen(-0.5), seen(0.5));
        let corners: Option<Vec<Point2<f64>>> = first.iter().chain(&last).copied().collect();
        let bounds = Bounds::around(&corners?);
        let (first_row, end_row) = bounds.rows(camera.height as usize)?;

        let slices = (first_row..end_row)
            .flat_map(|row| {
                let slices: [Option<Slice>; SLICES] = std::array::from_fn(|slice| {
                    let (knot, share) = knots.at(shutter.slice_s(row as f64, slice), planes.len());
                    planes[knot].towards(&planes[knot + 1], share).slice()
                });
                // A row whose exposure sees the facet turn away does not see it at all.
                let whole = slices.iter().all(Option::is_some);
                slices.map(|slice| slice.filter(|_| whole).unwrap_or_default())
            })
            .collect();
        let while_seen = |row: usize, share: f64| {
            knots.at(shutter.row_s(row as f64) + share * shutter.exposure_s, planes.len()).0
        };
        let window = while_seen(first_row, -0.5)..while_seen(end_row - 1, 0.5) + 2;
        Some(Self {
            slices,
            first_row,
            rows: end_row - first_row,
            bounds: Some(bounds),
            window: Window::of_points(outline.get(window)?.iter().flatten()),
            pace: pace(&first, &last),
        })
    }

    /// The slice of a row; rows beyond those that may show the facet are given the nearest one's.
    #[inline]
    pub(super) fn slice(&self, row: usize, slice: usize) -> &Slice {
        let line = row.saturating_sub(self.first_row).min(self.rows - 1);
        &self.slices[line * SLICES + slice]
    }
}

/// From where the corners are seen at both ends of the exposure.
fn pace(first: &[Option<Point2<f64>>], last: &[Option<Point2<f64>>]) -> Pace {
    /// A cell of the smallest readable tag has two pixels.
    const SLOW_PX: f64 = 3.0;
    let slow = first
        .iter()
        .zip(last)
        .all(|(first, last)| matches!((first, last), (Some(a), Some(b)) if (a - b).norm() < SLOW_PX));
    if slow { Pace::Slow } else { Pace::Fast }
}

/// Equal steps of time.
#[derive(Debug, Clone, Copy)]
struct Knots {
    begin_s: f64,
    step_s: f64,
}

impl Knots {
    /// The knot before a time, with one after it, and the share of the step that has passed.
    fn at(&self, t_s: f64, count: usize) -> (usize, f64) {
        let steps = (t_s - self.begin_s) / self.step_s;
        let knot = (steps.max(0.0) as usize).min(count.saturating_sub(2));
        (knot, (steps - knot as f64).clamp(0.0, 1.0))
    }
}

/// The numbers of a slice before they are rounded: rows u, v and w, and t_z.
#[derive(Debug, Clone, Copy)]
struct Plane {
    u: Vector3<f64>,
    v: Vector3<f64>,
    w: Vector3<f64>,
    /// Height of the camera above the facet's plane.
    height_m: f64,
}

impl Plane {
    fn new(camera_from_facet: &Isometry3<f64>) -> Self {
        let facet_from_camera = camera_from_facet.inverse();
        let rotation = facet_from_camera.rotation.to_rotation_matrix();
        let t = facet_from_camera.translation.vector;
        let row = |i: usize| rotation.matrix().row(i).transpose();
        let u = row(0) * t.z - row(2) * t.x;
        let v = row(1) * t.z - row(2) * t.y;
        Self { u, v, w: -row(2), height_m: t.z }
    }

    fn towards(&self, next: &Self, share: f64) -> Self {
        Self {
            u: self.u.lerp(&next.u, share),
            v: self.v.lerp(&next.v, share),
            w: self.w.lerp(&next.w, share),
            height_m: self.height_m + share * (next.height_m - self.height_m),
        }
    }

    /// `None` if the facet faces away.
    fn slice(&self) -> Option<Slice> {
        let as_f32 = |r: &Vector3<f64>| [r.x as f32, r.y as f32, r.z as f32];
        (self.height_m > 0.0).then(|| Slice {
            u: as_f32(&self.u),
            v: as_f32(&self.v),
            w: as_f32(&self.w),
            nearness: (1.0 / self.height_m) as f32,
        })
    }
}
