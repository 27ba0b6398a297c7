//! One sighting as whitened residuals, and their derivatives by everything that they depend on.
//!
//! # Equations
//! A point x of a part, seen by camera (R_c, t_c) at time τ, the object being at (R, p):
//!
//! ```text
//! X = R_t s x + t_t      y = R X + p       q = R_cᵀ (y − t_c)       r = π(q) − z
//! ∂q/∂t_c = −R_cᵀ        ∂q/∂φ_c = [q]×    ∂y/∂p = 1                ∂y/∂φ = −R [X]×
//! ∂X/∂t_t = 1            ∂X/∂φ_t = −R_t [s x]×                      ∂X/∂log s = R_t s x
//! ∂y/∂τ = v + R (ω × X)  τ = capture + offset + (row − middle row) · line time
//! ```
//!
//! All perturbations of rotations stand on the right. The rows of a part's points differ by milliseconds: each point
//! has its own time in the residual; the derivatives by the motion are those of the part's mean time.

use nalgebra::{Matrix3, Point3, Vector3};

use super::columns::{Columns, EYE, LINE_TIME, OFFSET, PART};
use super::lens::by_intrinsics;
use super::motion::{CONTROLS, Moment};
use super::problem::{POINTS, Problem, Sighting};

/// Rows of a sighting.
pub(super) const ROWS: usize = 2 * POINTS;
/// Most columns: controls, camera, part, residual.
pub(super) const WIDTH: usize = 6 * CONTROLS + EYE + PART + 1;

/// A sighting at the present state.
pub(super) struct Linear {
    /// First block of the motion, and how many.
    pub first: usize,
    pub count: usize,
    /// The border's columns, in the order in which they stand in the rows.
    pub border: [usize; EYE + PART],
    pub border_count: usize,
    /// Whitened: columns of the motion, of the border, and at last the residual; `width` of them.
    pub rows: [[f64; WIDTH]; ROWS],
    pub width: usize,
}

/// The residuals alone, in pixels; `None` if the state does not show the part to the camera.
pub(super) fn residuals_px(problem: &Problem, sighting: &Sighting) -> Option<[f64; ROWS]> {
    let eye = problem.eyes.get(sighting.camera)?;
    let part = problem.parts.get(sighting.part)?;
    let (moment, later_s) = exposure(problem, sighting)?;
    let camera_from_world = eye.camera.world_from_camera.inverse();
    let mut residuals = [0.0; ROWS];
    for (k, point) in part.points.iter().enumerate() {
        let in_object = part.object_from_part * Point3::from(point.coords * part.scale);
        let in_camera = camera_from_world * (moment.pose_after(later_s[k]) * in_object);
        let error = eye.camera.project(&in_camera)? - sighting.points_px[k];
        residuals[2 * k] = error.x;
        residuals[2 * k + 1] = error.y;
    }
    Some(residuals)
}

/// χ² of residuals.
pub(super) fn chi2(sighting: &Sighting, residuals_px: &[f64; ROWS]) -> f64 {
    (sighting.whitening * nalgebra::SVector::from(*residuals_px)).norm_squared()
}

/// The object in the mean time of a sighting's points, and how much later each was exposed.
fn exposure(problem: &Problem, sighting: &Sighting) -> Option<(Moment, [f64; POINTS])> {
    let eye = problem.eyes.get(sighting.camera)?;
    let count = problem.points(sighting).len().clamp(1, POINTS);
    let delays_s = sighting.points_px.map(|point| eye.camera.row_delay_s(point.y));
    let mean_s = delays_s[..count].iter().sum::<f64>() / count as f64;
    let moment = problem.motion.at(sighting.instant, sighting.capture_s + eye.offset_s + mean_s)?;
    Some((moment, delays_s.map(|delay_s| delay_s - mean_s)))
}

impl Linear {
    /// `None` if the state does not show the part to the camera.
    pub fn new(problem: &Problem, columns: &Columns, sighting: &Sighting) -> Option<Self> {
        let eye = problem.eyes.get(sighting.camera)?;
        let part = problem.parts.get(sighting.part)?;
        let (eye_columns, part_columns) =
            (columns.eyes.get(sighting.camera)?, columns.parts.get(sighting.part)?);
        let (moment, later_s) = exposure(problem, sighting)?;
        let camera = &eye.camera;
        let camera_from_world = camera.world_from_camera.rotation.inverse().to_rotation_matrix().into_inner();
        let object_from_part = part.object_from_part.rotation.to_rotation_matrix().into_inner();
        let middle_row = 0.5 * f64::from(camera.height.saturating_sub(1));
        let mut sut = Self {
            first: moment.first,
            count: moment.count,
            border: [0; EYE + PART],
            border_count: 0,
            rows: [[0.0; WIDTH]; ROWS],
            width: 0,
        };
        let motion = 6 * moment.count;
        for (k, point) in part.points.iter().enumerate() {
            let in_part = point.coords * part.scale;
            let in_object = part.object_from_part.translation.vector + object_from_part * in_part;
            let pose = moment.pose_after(later_s[k]);
            let world_from_object = pose.rotation.to_rotation_matrix().into_inner();
            let in_world = world_from_object * in_object + pose.translation.vector;
            let in_camera = camera_from_world * (in_world - camera.world_from_camera.translation.vector);
            let (pixel, by_camera_point) = camera.project_with_jacobian(&Point3::from(in_camera))?;
            let by_world_point = by_camera_point * camera_from_world;
            let by_object_point = by_world_point * world_from_object;
            let by_turn = -by_object_point * in_object.cross_matrix();
            let velocity = moment.velocity_m_s + world_from_object * moment.rate_rad_s.cross(&in_object);
            let by_time = by_world_point * velocity;
            let by_lens = by_intrinsics(camera, in_camera.xy() / in_camera.z);
            let by_camera_turn = by_camera_point * in_camera.cross_matrix();
            let by_part_turn = -by_object_point * object_from_part * in_part.cross_matrix();
            let by_scale = by_object_point * (object_from_part * in_part);
            let later_rows = sighting.points_px[k].y - middle_row;
            for axis in 0..2 {
                let row = &mut sut.rows[2 * k + axis];
                let three =
                    |m: &nalgebra::Matrix2x3<f64>| Vector3::new(m[(axis, 0)], m[(axis, 1)], m[(axis, 2)]);
                let (by_p, by_phi) = (three(&by_world_point), three(&by_turn));
                for block in 0..moment.count {
                    let shift = by_p * moment.by_position[block];
                    let turn = transposed_times(&moment.by_rotation[block], &by_phi);
                    row[6 * block..6 * block + 3].copy_from_slice(shift.as_slice());
                    row[6 * block + 3..6 * block + 6].copy_from_slice(turn.as_slice());
                }
                let mut end = motion;
                let mut push = |column: Option<usize>, value: f64| {
                    if let Some(column) = column {
                        sut.border[end - motion] = column;
                        row[end] = value;
                        end += 1;
                    }
                };
                let camera_turn = three(&by_camera_turn);
                for part in 0..3 {
                    push(eye_columns[part], -by_p[part]);
                }
                for part in 0..3 {
                    push(eye_columns[3 + part], camera_turn[part]);
                }
                for (column, derivative) in eye_columns[6..OFFSET].iter().zip(&by_lens) {
                    push(*column, derivative[axis]);
                }
                push(eye_columns[OFFSET], by_time[axis]);
                push(eye_columns[LINE_TIME], by_time[axis] * later_rows);
                let (part_shift, part_turn) = (three(&by_object_point), three(&by_part_turn));
                for part in 0..3 {
                    push(part_columns[part], part_shift[part]);
                }
                for part in 0..3 {
                    push(part_columns[3 + part], part_turn[part]);
                }
                push(part_columns[6], by_scale[axis]);
                row[end] = pixel[axis] - sighting.points_px[k][axis];
                sut.border_count = end - motion;
                sut.width = end + 1;
            }
        }
        sut.whiten(sighting);
        Some(sut)
    }

    /// Multiplies with L⁻¹, from the last row: each depends on those above it alone.
    fn whiten(&mut self, sighting: &Sighting) {
        for i in (0..ROWS).rev() {
            let mut sum = [0.0; WIDTH];
            for k in 0..=i {
                let factor = sighting.whitening[(i, k)];
                if factor != 0.0 {
                    for (sum, value) in sum[..self.width].iter_mut().zip(&self.rows[k]) {
                        *sum += factor * value;
                    }
                }
            }
            self.rows[i] = sum;
        }
    }

    /// χ².
    pub fn chi2(&self) -> f64 {
        self.rows.iter().map(|row| row[self.width - 1] * row[self.width - 1]).sum()
    }
}

fn transposed_times(matrix: &Matrix3<f64>, vector: &Vector3<f64>) -> Vector3<f64> {
    matrix.tr_mul(vector)
}
