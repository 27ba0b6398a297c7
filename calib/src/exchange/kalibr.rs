//! Kalibr's camchain and target files.
//!
//! Source: Kalibr's wiki, "yaml formats". `T_cn_cnm1` takes points from the previous camera to this one; the tags of
//! an `aprilgrid` rise to the right, then upwards; `tagSpacing` is the gap per side of a tag.

use std::collections::BTreeMap;
use std::fmt::Write;

use locoman_vision::camera::{Camera, Distortion};
use nalgebra::Isometry3;
use serde::Deserialize;

use super::yaml::{parse, pose};
use super::{ExchangeError, Foreign, camera, fault, radtan};
use crate::board::Board;

#[derive(Deserialize)]
struct Entry {
    camera_model: String,
    intrinsics: Vec<f64>,
    distortion_model: String,
    distortion_coeffs: Vec<f64>,
    resolution: [u32; 2],
    #[serde(default, rename = "T_cn_cnm1")]
    from_previous: Option<Vec<Vec<f64>>>,
}

/// Reads a camchain: cameras in the file's order by number (`cam0`, `cam1`, …), the first one at the origin.
pub fn read_camchain(source: &Foreign) -> Result<Vec<Camera>, ExchangeError> {
    let entries: BTreeMap<String, Entry> = parse(source, &source.text)?;
    let mut numbered: Vec<(u32, String, Entry)> = Vec::new();
    for (name, entry) in entries {
        match name.strip_prefix("cam").and_then(|number| number.parse().ok()) {
            Some(number) => numbered.push((number, name, entry)),
            None => {
                let remedy = "cameras of a camchain are called cam0, cam1, …";
                return Err(source.error_at(&format!("{name}:"), format!("`{name}` is no camera"), remedy));
            }
        }
    }
    numbered.sort_by_key(|(number, ..)| *number);
    let mut cameras: Vec<Camera> = Vec::new();
    for (_, name, entry) in numbered {
        let mut one = lens(source, &name, &entry)?;
        if let Some(previous) = cameras.last() {
            let this_from_previous = match entry.from_previous.as_deref().map(pose) {
                Some(Ok(pose)) => pose,
                Some(Err(problem)) => {
                    let remedy = "copy T_cn_cnm1 as Kalibr wrote it";
                    return Err(source.error_at(&format!("{name}:"), format!("{name}: {problem}"), remedy));
                }
                None => Isometry3::identity(),
            };
            one.world_from_camera = previous.world_from_camera * this_from_previous.inverse();
        }
        cameras.push(one);
    }
    if cameras.is_empty() {
        return Err(source.error(1, "no camera", "a camchain has cam0, cam1, …"));
    }
    Ok(cameras)
}

fn lens(source: &Foreign, name: &str, entry: &Entry) -> Result<Camera, ExchangeError> {
    let place = format!("{name}:");
    if entry.camera_model != "pinhole" {
        return Err(source.error_at(
            &place,
            format!("{name}: camera model `{}` is not supported", entry.camera_model),
            "calibrate as pinhole-radtan or pinhole-equi",
        ));
    }
    let coefficients = entry.distortion_coeffs.as_slice();
    let distortion = match entry.distortion_model.as_str() {
        "none" => Some(Distortion::Pinhole),
        "radtan" => radtan(coefficients),
        "equidistant" => coefficients.try_into().ok().map(Distortion::Fisheye),
        other => {
            return Err(source.error_at(
                &place,
                format!("{name}: distortion model `{other}` is not supported"),
                "calibrate as pinhole-radtan or pinhole-equi",
            ));
        }
    };
    let (Some(distortion), Ok(intrinsics)) = (distortion, <[f64; 4]>::try_from(entry.intrinsics.as_slice()))
    else {
        return Err(source.error_at(
            &place,
            format!(
                "{name}: {} intrinsics and {} coefficients of distortion do not fit {}",
                entry.intrinsics.len(),
                coefficients.len(),
                entry.distortion_model
            ),
            "intrinsics are fu, fv, pu, pv; radtan and equidistant have 4 coefficients",
        ));
    };
    let one = camera(name, entry.resolution, intrinsics, distortion);
    fault(&one).map_or(Ok(one), |(problem, remedy)| Err(source.error_at(&place, problem, remedy)))
}

/// Writes a camchain; cameras become `cam0`, `cam1`, … with their own names as topics.
pub fn write_camchain(cameras: &[Camera]) -> Result<String, ExchangeError> {
    let mut text = String::new();
    let mut previous: Option<&Camera> = None;
    for (number, one) in cameras.iter().enumerate() {
        let (model, coefficients): (&str, &[f64]) = match &one.distortion {
            Distortion::Pinhole => ("none", &[]),
            Distortion::RadTan(k) if k[4..].iter().all(|number| *number == 0.0) => ("radtan", &k[..4]),
            Distortion::RadTan(k) => {
                return Err(ExchangeError::Unsayable {
                    id: one.id.clone(),
                    problem: format!(
                        "Kalibr's radtan has k1, k2, p1, p2; this lens has k3 .. k6 = {:?}",
                        &k[4..]
                    ),
                    remedy: "calibrate this camera with four coefficients, or export to ROS",
                });
            }
            Distortion::Fisheye(k) => ("equidistant", k),
        };
        let _ = writeln!(
            text,
            "cam{number}:\n  camera_model: pinhole\n  intrinsics: [{}, {}, {}, {}]\n  distortion_model: {model}\n  \
             distortion_coeffs: {coefficients:?}\n  resolution: [{}, {}]\n  rostopic: /{}/image_raw",
            one.focal_px.x, one.focal_px.y, one.center_px.x, one.center_px.y, one.width, one.height, one.id
        );
        if let Some(previous) = previous {
            let this_from_previous = one.world_from_camera.inverse() * previous.world_from_camera;
            text.push_str("  T_cn_cnm1:\n");
            for row in this_from_previous.to_homogeneous().row_iter() {
                let _ = writeln!(text, "  - [{}, {}, {}, {}]", row[0], row[1], row[2], row[3]);
            }
        }
        previous = Some(one);
    }
    Ok(text)
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Target {
    target_type: Option<String>,
    tag_cols: u32,
    tag_rows: u32,
    tag_size: f64,
    tag_spacing: f64,
    #[serde(default)]
    tag_start_id: u32,
}

/// Reads the target file of an `aprilgrid`.
pub fn read_target(source: &Foreign) -> Result<Board, ExchangeError> {
    // `target_type` alone is not in camel case.
    let text = source.text.replace("target_type", "targetType");
    let target: Target = parse(source, &text)?;
    if let Some(kind) = target.target_type.filter(|kind| kind != "aprilgrid") {
        let problem = format!("target type `{kind}` is not supported");
        return Err(source.error_at("target_type", problem, "use an aprilgrid"));
    }
    let sizes = [target.tag_size, target.tag_spacing];
    if target.tag_cols * target.tag_rows == 0 || !sizes.iter().all(|size| size.is_finite() && *size > 0.0) {
        let problem = format!(
            "{}x{} tags of {} m, spacing {}",
            target.tag_cols, target.tag_rows, target.tag_size, target.tag_spacing
        );
        return Err(source.error_at(
            "tagSize",
            problem,
            "tagSize is in metres, tagSpacing the gap per tagSize",
        ));
    }
    Ok(Board {
        columns: target.tag_cols,
        rows: target.tag_rows,
        first_id: target.tag_start_id,
        tag_mm: 1e3 * target.tag_size,
        gap_mm: 1e3 * target.tag_size * target.tag_spacing,
    })
}

/// Writes the target file of a grid.
pub fn write_target(board: &Board) -> String {
    let start = if board.first_id == 0 { String::new() } else { format!("tagStartId: {}\n", board.first_id) };
    format!(
        "target_type: 'aprilgrid'\ntagCols: {}\ntagRows: {}\ntagSize: {}\ntagSpacing: {}\n{start}",
        board.columns,
        board.rows,
        board.tag_mm / 1e3,
        board.gap_mm / board.tag_mm
    )
}
