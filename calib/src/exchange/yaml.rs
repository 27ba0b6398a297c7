//! What the YAML formats share: reading with the line of an error, matrices, and a 4x4 pose.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::{ExchangeError, Foreign};

/// A matrix as OpenCV and ROS write it, row by row.
#[derive(Debug, Clone, Deserialize)]
pub struct Matrix {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub cols: usize,
    /// Row by row.
    pub data: Vec<f64>,
}

impl Matrix {
    /// fx, fy, cx, cy of a camera matrix; `None` unless it is 3x3.
    pub fn intrinsics(&self) -> Option<[f64; 4]> {
        let is_camera = self.rows == 3 && self.cols == 3 && self.data.len() == 9;
        is_camera.then(|| [self.data[0], self.data[4], self.data[2], self.data[5]])
    }

    /// The numbers of a vector, whichever way it lies.
    pub fn vector(&self) -> Option<&[f64]> {
        let count = self.rows * self.cols;
        ((self.rows == 1 || self.cols == 1) && self.data.len() == count).then_some(self.data.as_slice())
    }
}

/// Parses a file; unknown keys are left alone, as others add their own.
pub fn parse<T: DeserializeOwned>(source: &Foreign, text: &str) -> Result<T, ExchangeError> {
    serde_saphyr::from_str(text).map_err(|error| {
        let line = error.location().map_or(1, |place| usize::try_from(place.line()).unwrap_or(1));
        let message = error.to_string();
        // The parser shows the lines around the place; the first line says what is wrong.
        let problem = message.lines().next().unwrap_or_default().to_owned();
        source.error(line, problem, "compare with a file that the named program writes")
    })
}

/// A pose from the rows of a 4x4 matrix, with a rotation that is one to four digits; else what is wrong.
pub fn pose(rows: &[Vec<f64>]) -> Result<Isometry3<f64>, String> {
    /// Files carry six digits or more.
    const ROTATION_TOLERANCE: f64 = 1e-3;
    let is_square = rows.len() == 4 && rows.iter().all(|row| row.len() == 4);
    if !is_square {
        return Err("a pose is not a matrix of 4x4 numbers".to_owned());
    }
    let rotation = Matrix3::from_fn(|row, column| rows[row][column]);
    let error = (rotation * rotation.transpose() - Matrix3::identity()).norm();
    if error.is_nan() || error > ROTATION_TOLERANCE || rotation.determinant() < 0.0 {
        return Err(format!("a pose has a rotation that is none (R R' differs from 1 by {error:.4})"));
    }
    let translation = Vector3::from_fn(|row, _| rows[row][3]);
    Ok(isometry(&rotation, translation))
}

/// A pose from a rotation matrix that is one to some digits: the nearest rotation is taken.
pub fn isometry(rotation: &Matrix3<f64>, translation: Vector3<f64>) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix(rotation);
    Isometry3::from_parts(Translation3::from(translation), UnitQuaternion::from_rotation_matrix(&rotation))
}
