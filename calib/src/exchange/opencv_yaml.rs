//! OpenCV's `FileStorage` files: what its calibration samples write.
//!
//! One camera (`camera_matrix`, `distortion_coefficients`, the size), or a stereo pair (`M1`, `D1`, `M2`, `D2`, with
//! `R` and `T` if the extrinsics are in the same file: they take points of the first camera to the second, in the unit
//! of the board's squares, metres here). A pair's file has no image size: it has to be told.

use std::collections::BTreeMap;

use locoman_vision::camera::{Camera, Distortion};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

use super::yaml::{Matrix, isometry, parse};
use super::{ExchangeError, Foreign, camera, fault, radtan};

/// A value of a file; those that we have no use for are let through.
#[derive(Deserialize)]
#[serde(untagged)]
enum Value {
    Matrix(Matrix),
    Number(f64),
    Other(serde::de::IgnoredAny),
}

/// Reads the camera or the pair; `size` is width and height where the file does not tell them.
pub fn read(source: &Foreign, size: Option<[u32; 2]>) -> Result<Vec<Camera>, ExchangeError> {
    // The directive is not one of YAML's, and the tag is not needed; no line is added or lost.
    let text = source.text.replace("!!opencv-matrix", "");
    let text = match text.strip_prefix("%YAML") {
        Some(rest) => format!("# {rest}"),
        None => text,
    };
    let text = text.replacen("\n---", "\n# ", 1);
    let values: BTreeMap<String, Value> = parse(source, &text)?;
    let matrix = |name: &str| match values.get(name) {
        Some(Value::Matrix(matrix)) => Some(matrix),
        _ => None,
    };
    let number = |name: &str| match values.get(name) {
        Some(Value::Number(number)) => Some(*number as u32),
        _ => None,
    };
    let size = match (number("image_width"), number("image_height"), size) {
        (Some(width), Some(height), _) => [width, height],
        (_, _, Some(size)) => size,
        _ => return Err(source.error(1, "the file does not tell the size of images", "give --size 640x480")),
    };
    let fisheye = matches!(values.get("fisheye_model"), Some(Value::Number(flag)) if *flag != 0.0);
    let one = |id: &str, lens: &str, coefficients: &str| {
        let Some(intrinsics) = matrix(lens).and_then(Matrix::intrinsics) else {
            return Err(source.error_at(lens, format!("`{lens}` is no 3x3 matrix"), "copy the file whole"));
        };
        let numbers = matrix(coefficients).and_then(Matrix::vector).unwrap_or_default();
        let distortion =
            if fisheye { numbers.try_into().ok().map(Distortion::Fisheye) } else { radtan(numbers) };
        let Some(distortion) = distortion else {
            return Err(source.error_at(
                coefficients,
                format!("{} coefficients of distortion are not supported", numbers.len()),
                "calibrate without thin prisms and tilt: 4, 5 or 8 coefficients, 4 for a fisheye",
            ));
        };
        let one = camera(id, size, intrinsics, distortion);
        fault(&one).map_or(Ok(one), |(problem, remedy)| Err(source.error_at(lens, problem, remedy)))
    };
    if matrix("M1").is_none() {
        let (lens, coefficients) =
            if matrix("K").is_some() { ("K", "D") } else { ("camera_matrix", "distortion_coefficients") };
        return Ok(vec![one("camera", lens, coefficients)?]);
    }
    let (left, mut right) = (one("left", "M1", "D1")?, one("right", "M2", "D2")?);
    if let (Some(rotation), Some(translation)) = (matrix("R"), matrix("T").and_then(Matrix::vector)) {
        if rotation.data.len() != 9 || translation.len() != 3 {
            return Err(source.error_at("R:", "R is not 3x3 or T not of 3 numbers", "copy the file whole"));
        }
        let right_from_left =
            isometry(&Matrix3::from_row_slice(&rotation.data), Vector3::from_column_slice(translation));
        right.world_from_camera = right_from_left.inverse();
    }
    Ok(vec![left, right])
}
