//! ROS `camera_info` files, as `camera_calibration` and `camera_info_manager` write and read them.
//!
//! Source: `sensor_msgs/CameraInfo` and `sensor_msgs/distortion_models.hpp`: `plumb_bob` has 5 coefficients,
//! `rational_polynomial` 8, `equidistant` 4, in OpenCV's order. One file a camera; extrinsics are not part of it.

use locoman_vision::camera::{Camera, Distortion};
use serde::Deserialize;

use super::yaml::{Matrix, parse};
use super::{ExchangeError, Foreign, camera, fault, radtan};

#[derive(Deserialize)]
struct CameraInfo {
    image_width: u32,
    image_height: u32,
    #[serde(default)]
    camera_name: Option<String>,
    camera_matrix: Matrix,
    #[serde(default)]
    distortion_model: Option<String>,
    distortion_coefficients: Matrix,
}

/// Reads the camera of a file.
pub fn read(source: &Foreign) -> Result<Camera, ExchangeError> {
    let info: CameraInfo = parse(source, &source.text)?;
    let id = info.camera_name.as_deref().filter(|name| !name.is_empty()).unwrap_or("camera");
    let Some(intrinsics) = info.camera_matrix.intrinsics() else {
        return Err(source.error_at("camera_matrix", "the camera matrix is not 3x3", "copy the file whole"));
    };
    let coefficients = info.distortion_coefficients.vector().unwrap_or_default();
    let model = info.distortion_model.as_deref().unwrap_or("plumb_bob");
    let distortion = match model {
        "plumb_bob" | "rational_polynomial" => radtan(coefficients),
        "equidistant" | "fisheye" => coefficients.try_into().ok().map(Distortion::Fisheye),
        _ => None,
    };
    let Some(distortion) = distortion else {
        return Err(source.error_at(
            "distortion",
            format!("distortion model `{model}` with {} coefficients is not supported", coefficients.len()),
            "plumb_bob has 4 or 5, rational_polynomial 8, equidistant 4",
        ));
    };
    let one = camera(id, [info.image_width, info.image_height], intrinsics, distortion);
    fault(&one).map_or(Ok(one), |(problem, remedy)| Err(source.error_at("camera_matrix", problem, remedy)))
}

/// Writes the file of a camera; its pose is left out.
pub fn write(camera: &Camera) -> String {
    let (model, coefficients): (&str, &[f64]) = match &camera.distortion {
        Distortion::Pinhole => ("plumb_bob", &[0.0; 5]),
        Distortion::RadTan(k) if k[5..].iter().all(|number| *number == 0.0) => ("plumb_bob", &k[..5]),
        Distortion::RadTan(k) => ("rational_polynomial", k),
        Distortion::Fisheye(k) => ("equidistant", k),
    };
    let [fx, fy, cx, cy] = [camera.focal_px.x, camera.focal_px.y, camera.center_px.x, camera.center_px.y];
    format!(
        "image_width: {}\nimage_height: {}\ncamera_name: {}\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
         data: [{fx}, 0, {cx}, 0, {fy}, {cy}, 0, 0, 1]\ndistortion_model: {model}\ndistortion_coefficients:\n  rows: 1\n  \
         cols: {}\n  data: {coefficients:?}\nrectification_matrix:\n  rows: 3\n  cols: 3\n  \
         data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nprojection_matrix:\n  rows: 3\n  cols: 4\n  \
         data: [{fx}, 0, {cx}, 0, 0, {fy}, {cy}, 0, 0, 0, 1, 0]\n",
        camera.width,
        camera.height,
        camera.id,
        coefficients.len(),
    )
}
