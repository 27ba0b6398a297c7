//! How well a calibration knows where rays fall in the image, and how two calibrations differ.
//!
//! Parameters are no measure: a turn of the camera makes up for a shift of the principal point. So what is compared is
//! where rays are projected, after the turn that a calibration leaves open has been taken off: the one that fits the
//! supported part of the image best (mrcal's "implied transformation").

use locoman_vision::camera::Camera;
use nalgebra::{DMatrix, Matrix2x3, Matrix3, Matrix3xX, Point2, Point3, UnitQuaternion, Vector2, Vector3};

use crate::bundle::lens::{self, by_intrinsics};

/// A pixel of the grid over an image, and whether points were seen near it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Its centre.
    pub center_px: Point2<f64>,
    /// Points seen in it.
    pub points: usize,
}

/// Cells over an image, row by row; about square.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    /// Cells in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Side lengths of a cell, pixels.
    pub cell_px: Vector2<f64>,
    /// Row by row from the top left.
    pub cells: Vec<Cell>,
}

impl Coverage {
    /// What points cover of an image.
    pub fn new(width: u32, height: u32, points: impl Iterator<Item = Point2<f64>>) -> Self {
        /// Cells along the longer side: a twelfth of the image is about the size of a tag of a near board.
        const ALONG: f64 = 12.0;
        let (width, height) = (f64::from(width), f64::from(height));
        let side = width.max(height) / ALONG;
        let (columns, rows) = ((width / side).ceil().max(1.0), (height / side).ceil().max(1.0));
        let cell_px = Vector2::new(width / columns, height / rows);
        let (columns, rows) = (columns as usize, rows as usize);
        let center = |k: usize| {
            let (column, row) = ((k % columns) as f64, (k / columns) as f64);
            Point2::new((column + 0.5) * cell_px.x - 0.5, (row + 0.5) * cell_px.y - 0.5)
        };
        let cells = (0..columns * rows).map(|k| Cell { center_px: center(k), points: 0 }).collect();
        let mut sut = Self { columns, rows, cell_px, cells };
        for point in points {
            if let Some(k) = sut.cell_of(&point) {
                sut.cells[k].points += 1;
            }
        }
        sut
    }

    /// The cell that a pixel lies in.
    pub fn cell_of(&self, pixel: &Point2<f64>) -> Option<usize> {
        let (column, row) = ((pixel.x + 0.5) / self.cell_px.x, (pixel.y + 0.5) / self.cell_px.y);
        let inside =
            column >= 0.0 && row >= 0.0 && (column as usize) < self.columns && (row as usize) < self.rows;
        inside.then(|| row as usize * self.columns + column as usize)
    }

    /// Share of cells with points.
    pub fn share(&self) -> f64 {
        self.cells.iter().filter(|cell| cell.points > 0).count() as f64 / self.cells.len() as f64
    }
}

/// Standard deviation (root of the summed variance of x and y, pixels) of where the ray of each cell is projected,
/// the open turn taken off.
///
/// `numbers` and `covariance`: which intrinsics (as [`lens`] orders them) vary, and how.
pub fn uncertainty_px(
    camera: &Camera,
    coverage: &Coverage,
    numbers: &[usize],
    covariance: &DMatrix<f64>,
) -> Vec<f64> {
    let linear: Vec<(DMatrix<f64>, Matrix2x3<f64>)> = coverage
        .cells
        .iter()
        .map(|cell| {
            let ray = camera.unproject(&cell.center_px);
            let columns = by_intrinsics(camera, ray.xy());
            let by_lens = DMatrix::from_fn(2, numbers.len(), |row, k| columns[numbers[k]][row]);
            (by_lens, by_turn(camera, &ray))
        })
        .collect();
    let mut normal = Matrix3::identity() * 1e-9;
    let mut right = Matrix3xX::zeros(numbers.len());
    for (cell, (by_lens, by_turn)) in coverage.cells.iter().zip(&linear) {
        if cell.points > 0 {
            normal += by_turn.tr_mul(by_turn);
            right += by_turn.tr_mul(by_lens);
        }
    }
    let turn = normal.try_inverse().map_or(Matrix3xX::zeros(numbers.len()), |inverse| inverse * right);
    let spread = |(by_lens, by_turn): &(DMatrix<f64>, Matrix2x3<f64>)| {
        let rest = by_lens - by_turn * &turn;
        (&rest * covariance * rest.transpose()).trace().max(0.0).sqrt()
    };
    linear.iter().map(spread).collect()
}

/// Length in pixels of the difference of the projections of each cell's ray, the turn that fits the covered cells best
/// taken off. Rays are those that `reference` sees.
pub fn differences_px(reference: &Camera, other: &Camera, coverage: &Coverage) -> Vec<f64> {
    const STEPS: usize = 4;
    let rays: Vec<Vector3<f64>> =
        coverage.cells.iter().map(|cell| reference.unproject(&cell.center_px)).collect();
    let mut turn = UnitQuaternion::identity();
    for _ in 0..STEPS {
        let (mut normal, mut right) = (Matrix3::identity() * 1e-9, Vector3::zeros());
        for (cell, ray) in coverage.cells.iter().zip(&rays).filter(|(cell, _)| cell.points > 0) {
            let turned = turn * ray;
            let Some(pixel) = other.project(&Point3::from(turned)) else { continue };
            let jacobian = by_turn(other, &turned);
            normal += jacobian.tr_mul(&jacobian);
            right += jacobian.tr_mul(&(pixel - cell.center_px));
        }
        let Some(inverse) = normal.try_inverse() else { break };
        turn = UnitQuaternion::from_scaled_axis(-(inverse * right)) * turn;
    }
    let difference = |(cell, ray): (&Cell, &Vector3<f64>)| {
        other
            .project(&Point3::from(turn * ray))
            .map_or(f64::INFINITY, |pixel| (pixel - cell.center_px).norm())
    };
    coverage.cells.iter().zip(&rays).map(difference).collect()
}

/// Derivative of a ray's pixel by a turn of the ray about the camera's axes.
fn by_turn(camera: &Camera, ray: &Vector3<f64>) -> Matrix2x3<f64> {
    let by_point = camera.project_with_jacobian(&Point3::from(*ray)).map(|(_, jacobian)| jacobian);
    by_point.map_or_else(Matrix2x3::zeros, |jacobian| -jacobian * ray.cross_matrix())
}

/// The intrinsics of a camera's parameters, without their place among a bundle's: see [`lens::names`].
pub fn intrinsics_of((numbers, covariance): (Vec<usize>, DMatrix<f64>)) -> (Vec<usize>, DMatrix<f64>) {
    /// Position and orientation come before them.
    const FIRST: usize = 6;
    let own: Vec<usize> =
        (0..numbers.len()).filter(|k| (FIRST..FIRST + lens::INTRINSICS).contains(&numbers[*k])).collect();
    let kept = own.iter().map(|k| numbers[*k] - FIRST).collect();
    (kept, covariance.select_rows(&own).select_columns(&own))
}

#[cfg(test)]
mod tests {
    use locoman_vision::camera::Distortion;

    use super::*;

    fn camera() -> Camera {
        Camera {
            id: "one".into(),
            width: 640,
            height: 480,
            focal_px: Vector2::new(520.0, 521.0),
            center_px: Vector2::new(322.0, 238.0),
            distortion: Distortion::RadTan([-0.2, 0.04, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            world_from_camera: nalgebra::Isometry3::identity(),
            line_time_s: 0.0,
        }
    }

    fn everywhere() -> Coverage {
        let points = (0..640 * 480).step_by(91).map(|k| Point2::new(f64::from(k % 640), f64::from(k / 640)));
        Coverage::new(640, 480, points)
    }

    #[test]
    fn a_shift_that_a_turn_makes_up_for_is_hardly_a_difference() {
        let (one, mut other) = (camera(), camera());
        other.center_px.x += 2.0;
        let coverage = everywhere();
        let differences = differences_px(&one, &other, &coverage);
        assert!(differences.iter().all(|px| *px < 0.6), "{differences:?}");
        assert!(differences_px(&one, &one, &coverage).iter().all(|px| *px < 1e-9));
    }

    #[test]
    fn uncertainty_is_that_of_projections_of_cameras_drawn_from_the_covariance() {
        let coverage = everywhere();
        let covariance = DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![0.25, 0.04]));
        let stated = uncertainty_px(&camera(), &coverage, &[0, 2], &covariance);
        // A deviation of one sigma along each axis apart: their squares add up.
        let along = |focal: f64, center: f64| {
            let mut other = camera();
            other.focal_px.x += focal;
            other.center_px.x += center;
            differences_px(&camera(), &other, &coverage)
        };
        for ((stated, a), b) in stated.iter().zip(along(0.5, 0.0)).zip(along(0.0, 0.2)) {
            assert!((stated - a.hypot(b)).abs() < 0.02, "{stated} {a} {b}");
        }
    }
}
