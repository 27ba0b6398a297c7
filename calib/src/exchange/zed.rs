//! Stereolabs' factory files (`SN12345.conf`): both eyes of a ZED in every mode.
//!
//! Source: what `zed-opencv`'s stereo calibration tool writes from OpenCV's `stereoCalibrate` (R, T from left to
//! right): `Baseline` is -T.x, `TY` and `TZ` are the others, millimetres; `RX_`, `CV_`, `RZ_` MODE are the rotation
//! vector. Distortion is k1, k2, p1, p2, k3 in each camera's section (older files), or once in `LEFT_DISTO` and
//! `RIGHT_DISTO` with k1 .. k6 (newer ones).

use std::collections::BTreeMap;

use locoman_vision::camera::{Camera, Distortion};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::{ExchangeError, Foreign, camera, fault, radtan};

/// Mode in a file's section names, width and height of one eye.
pub const MODES: [(&str, [u32; 2]); 8] = [
    ("2K", [2208, 1242]),
    ("FHD", [1920, 1080]),
    ("HD", [1280, 720]),
    ("VGA", [672, 376]),
    ("FHD1200", [1920, 1200]),
    ("SVGA", [960, 600]),
    ("4K", [3840, 2160]),
    ("QHDPLUS", [3200, 1800]),
];

/// Both eyes in one mode.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// As in [`MODES`].
    pub mode: &'static str,
    /// The left eye, at the origin.
    pub left: Camera,
    /// The right eye, a baseline to the right of it.
    pub right: Camera,
}

/// Numbers by section and key, both in capitals, with the line that each stands on.
type Sections = BTreeMap<(String, String), (f64, usize)>;

/// Reads all modes that the file has.
pub fn read(source: &Foreign) -> Result<Vec<Pair>, ExchangeError> {
    let sections = sections(source)?;
    let mut pairs = Vec::new();
    for (mode, size) in MODES {
        if sections.keys().any(|(section, _)| *section == format!("LEFT_CAM_{mode}")) {
            let left = eye(source, &sections, "LEFT", mode, size)?;
            let mut right = eye(source, &sections, "RIGHT", mode, size)?;
            right.world_from_camera = right_from_left(source, &sections, mode)?.inverse();
            pairs.push(Pair { mode, left, right });
        }
    }
    if pairs.is_empty() {
        return Err(source.error(
            1,
            "no section [LEFT_CAM_HD] or of another mode",
            "this is no factory file: download it again from calib.stereolabs.com, or copy it from \
             /usr/local/zed/settings",
        ));
    }
    Ok(pairs)
}

fn sections(source: &Foreign) -> Result<Sections, ExchangeError> {
    let mut all = Sections::new();
    let mut section = String::new();
    for (index, line) in source.text.lines().enumerate() {
        let line = line.trim();
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            section = name.trim().to_uppercase();
        } else if let Some((key, value)) = line.split_once('=') {
            let number = value.trim().parse::<f64>().ok().filter(|number| number.is_finite());
            let Some(number) = number else {
                let problem = format!("`{}` of {} is `{}`, no number", key.trim(), section, value.trim());
                return Err(source.error(
                    index + 1,
                    problem,
                    "numbers have a point, not a comma: copy the file anew",
                ));
            };
            all.insert((section.clone(), key.trim().to_uppercase()), (number, index + 1));
        }
    }
    Ok(all)
}

fn eye(
    source: &Foreign,
    sections: &Sections,
    side: &str,
    mode: &str,
    size: [u32; 2],
) -> Result<Camera, ExchangeError> {
    let section = format!("{side}_CAM_{mode}");
    let value = |section: &str, key: &str| {
        sections.get(&(section.to_owned(), key.to_owned())).map(|(number, _)| *number)
    };
    let need = |key: &str| {
        value(&section, key).ok_or_else(|| {
            source.error_at(
                &section,
                format!("[{section}] has no {}", key.to_lowercase()),
                "copy the file anew",
            )
        })
    };
    let intrinsics = [need("FX")?, need("FY")?, need("CX")?, need("CY")?];
    let shared = format!("{side}_DISTO");
    let k = ["K1", "K2", "P1", "P2", "K3", "K4", "K5", "K6"]
        .map(|key| value(&section, key).or_else(|| value(&shared, key)).unwrap_or(0.0));
    // Eight coefficients are always understood.
    let distortion = radtan(&k).unwrap_or(Distortion::Pinhole);
    let one = camera(&side.to_lowercase(), size, intrinsics, distortion);
    fault(&one).map_or(Ok(one), |(problem, remedy)| Err(source.error_at(&section, problem, remedy)))
}

/// Takes points of the left eye to the right one, metres.
fn right_from_left(
    source: &Foreign,
    sections: &Sections,
    mode: &str,
) -> Result<Isometry3<f64>, ExchangeError> {
    const MM_PER_M: f64 = 1e3;
    // Some files have one value a mode, others one for all.
    let value = |key: &str| {
        [format!("{key}_{mode}"), key.to_owned()]
            .into_iter()
            .find_map(|key| sections.get(&("STEREO".to_owned(), key)))
            .copied()
    };
    let Some((baseline_mm, line)) = value("BASELINE") else {
        return Err(source.error_at("STEREO", "[STEREO] has no Baseline", "copy the file anew"));
    };
    /// From a ZED Mini's 50 mm or so to two cameras that stand apart.
    const SENSIBLE_MM: std::ops::RangeInclusive<f64> = 10.0..=2000.0;
    if !SENSIBLE_MM.contains(&baseline_mm) {
        let problem = format!("a baseline of {baseline_mm} mm");
        return Err(source.error(line, problem, "it is in millimetres, 63 or 120 for most cameras"));
    }
    let or_zero = |key: &str| value(key).map_or(0.0, |(number, _)| number);
    let translation = Vector3::new(-baseline_mm, or_zero("TY"), or_zero("TZ")) / MM_PER_M;
    let rotation =
        UnitQuaternion::from_scaled_axis(Vector3::new(or_zero("RX"), or_zero("CV"), or_zero("RZ")));
    Ok(Isometry3::from_parts(Translation3::from(translation), rotation))
}
