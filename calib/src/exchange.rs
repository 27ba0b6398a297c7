//! Calibrations of others: read into our cameras, and written as theirs.
//!
//! | format | read | written |
//! |---|---|---|
//! | ZED factory file (`SN*.conf`) | all modes, both eyes with the baseline | |
//! | Kalibr camchain and target (YAML) | yes | yes |
//! | OpenCV `FileStorage` (YAML) | one camera, or a stereo pair with its extrinsics in the same file | |
//! | ROS `camera_info` (YAML) | yes | yes |
//!
//! Conventions: all of them put pixel centres at integers and use OpenCV's order of coefficients, as we do. The first
//! camera of a file is the origin of the world; `extrinsics` puts it where it stands in the room.

pub mod kalibr;
pub mod opencv_yaml;
pub mod ros;
pub mod yaml;
pub mod zed;

use std::path::{Path, PathBuf};

use locoman_vision::camera::{Camera, Distortion};
use nalgebra::{Isometry3, Vector2};

/// A file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ExchangeError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}\n  hint: check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file says something that we cannot use.
    #[error("{}:{line}: {problem}\n  hint: {remedy}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: usize,
        /// What is wrong, with the numbers.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// What we have cannot be said in their format.
    #[error("camera `{id}`: {problem}\n  hint: {remedy}")]
    Unsayable {
        /// The camera.
        id: String,
        /// What cannot be said.
        problem: String,
        /// What to do about it.
        remedy: &'static str,
    },
}

/// The text of a file of somebody else, and errors in it.
#[derive(Debug, Clone)]
pub struct Foreign {
    /// Where it lies.
    pub path: PathBuf,
    /// What it says.
    pub text: String,
}

impl Foreign {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, ExchangeError> {
        match std::fs::read_to_string(path) {
            Ok(text) => Ok(Self { path: path.to_owned(), text }),
            Err(source) => Err(ExchangeError::Read { path: path.to_owned(), source }),
        }
    }

    /// An error at the first line that holds a word; at line 1 if none does.
    pub fn error_at(
        &self,
        word: &str,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> ExchangeError {
        let line = self.text.lines().position(|line| line.contains(word)).map_or(1, |index| index + 1);
        self.error(line, problem, remedy)
    }

    /// An error at a line.
    pub fn error(&self, line: usize, problem: impl Into<String>, remedy: impl Into<String>) -> ExchangeError {
        ExchangeError::Content {
            path: self.path.clone(),
            line,
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }
}

/// Intrinsics as all formats have them: fx, fy, cx, cy in pixels.
fn camera(id: &str, size: [u32; 2], intrinsics: [f64; 4], distortion: Distortion) -> Camera {
    let [fx, fy, cx, cy] = intrinsics;
    Camera {
        id: id.to_owned(),
        width: size[0],
        height: size[1],
        focal_px: Vector2::new(fx, fy),
        center_px: Vector2::new(cx, cy),
        distortion,
        world_from_camera: Isometry3::identity(),
        line_time_s: 0.0,
    }
}

/// What is wrong with numbers of a camera, if anything: problem and remedy.
fn fault(camera: &Camera) -> Option<(String, &'static str)> {
    let numbers = [camera.focal_px.x, camera.focal_px.y, camera.center_px.x, camera.center_px.y];
    if !numbers.iter().all(|number| number.is_finite()) || numbers[0] <= 0.0 || numbers[1] <= 0.0 {
        return Some((
            format!("camera `{}` has focal lengths {}, {}", camera.id, numbers[0], numbers[1]),
            "the file was written by a calibration that failed: calibrate again",
        ));
    }
    if camera.width == 0 || camera.height == 0 {
        return Some((
            format!("camera `{}` has a size of {}x{} pixels", camera.id, camera.width, camera.height),
            "write the size of the images that were used",
        ));
    }
    None
}

/// Radial and tangential coefficients of any length that OpenCV knows without thin prisms and tilt (4, 5, 8).
fn radtan(coefficients: &[f64]) -> Option<Distortion> {
    let mut k = [0.0; 8];
    // More than eight are accepted if they are zero: thin prisms and tilt that were not estimated.
    let (known, rest) = coefficients.split_at(coefficients.len().min(8));
    if ![4, 5, 8].contains(&known.len()) || rest.iter().any(|number| *number != 0.0) {
        return None;
    }
    k[..known.len()].copy_from_slice(known);
    Some(if k.iter().all(|number| *number == 0.0) { Distortion::Pinhole } else { Distortion::RadTan(k) })
}
