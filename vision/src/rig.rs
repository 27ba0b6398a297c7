//! The rig: the calibrated cameras of a room, as a rig file (TOML) describes them.

mod calibration;
mod text;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use nalgebra::Vector2;
use serde::Deserialize;
use toml::Spanned;

use crate::camera::{Camera, Distortion};
use crate::config::{ConfigError, Fault, PoseEntry, Source};

pub use calibration::Calibration;

/// The cameras of a room.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    /// In the order of the file; an index into it names a camera within the program.
    pub cameras: Vec<Camera>,
    /// Where the images of each camera come from when it is live; as many as there are cameras.
    pub sources: Vec<CameraSource>,
    /// Cameras with the same number are exposed together; as many as there are cameras.
    pub sync_groups: Vec<usize>,
    /// The serial number of each camera, where the file tells it; as many as there are cameras.
    pub serials: Vec<Option<String>>,
    /// When and how well all of it was calibrated, if the file tells.
    pub calibration: Option<Calibration>,
}

/// Another camera stands where a calibrated one should.
#[derive(Debug, thiserror::Error)]
#[error(
    "camera `{id}` was calibrated with serial number {calibrated}, {found} is connected\n  hint: connect that one, or \
     calibrate this one: no two lenses are alike"
)]
pub struct SerialMismatch {
    /// The camera's id.
    pub id: String,
    /// Whose numbers the file has.
    pub calibrated: String,
    /// What is connected.
    pub found: String,
}

/// Where the images of a camera come from when it is live.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSource {
    /// A V4L2 device, e.g. `/dev/video0` (or a link under `/dev/v4l/by-id`).
    pub device: Option<PathBuf>,
    /// A video file.
    pub file: Option<PathBuf>,
    /// A network stream.
    pub url: Option<String>,
    /// Which half of a side-by-side image (ZED over UVC) is this camera; the whole image if absent.
    pub half: Option<Half>,
    /// A camera node on another machine reads this camera (`locoman-teleop detect`).
    #[serde(default)]
    pub remote: bool,
}

/// A half of a side-by-side stereo image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Half {
    /// The left half.
    Left,
    /// The right half.
    Right,
}

impl Rig {
    /// A rig of cameras that have no live source and are exposed together.
    pub fn new(cameras: Vec<Camera>) -> Self {
        let sources = vec![CameraSource::default(); cameras.len()];
        let sync_groups = vec![0; cameras.len()];
        let serials = vec![None; cameras.len()];
        Self { cameras, sources, sync_groups, serials, calibration: None }
    }

    /// Refuses a camera that is not the one that was calibrated; cameras without a serial number in the file pass.
    pub fn check_serial(&self, camera: usize, found: &str) -> Result<(), SerialMismatch> {
        match self.serials.get(camera) {
            Some(Some(calibrated)) if calibrated != found => Err(SerialMismatch {
                id: self.cameras[camera].id.clone(),
                calibrated: calibrated.clone(),
                found: found.to_owned(),
            }),
            _ => Ok(()),
        }
    }

    /// Reads and checks a rig file.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        Self::from_source(&Source::read(path)?)
    }

    /// The index of a camera by its id.
    pub fn camera_index(&self, id: &str) -> Option<usize> {
        self.cameras.iter().position(|camera| camera.id == id)
    }

    fn from_source(source: &Source) -> Result<Self, ConfigError> {
        let file: RigFile = source.parse()?;
        let hash = calibration::numbers_hash(file.camera.iter().map(Spanned::get_ref));
        let mut rig = Self::new(Vec::new());
        let mut ids = HashSet::new();
        let mut group_names: Vec<String> = Vec::new();
        for entry in file.camera {
            let offset = entry.span().start;
            let entry = entry.into_inner();
            let sync_group = group_names.iter().position(|name| *name == entry.sync).unwrap_or_else(|| {
                group_names.push(entry.sync.clone());
                group_names.len() - 1
            });
            let serial = entry.serial.clone();
            let (camera, live) = entry.check().map_err(|fault| source.error(offset, fault))?;
            if !ids.insert(camera.id.clone()) {
                let problem = format!("camera id `{}` is used twice", camera.id);
                return Err(source.error(offset, Fault::new(problem, "give each camera its own id")));
            }
            rig.cameras.push(camera);
            rig.sources.push(live);
            rig.sync_groups.push(sync_group);
            rig.serials.push(serial);
        }
        if rig.cameras.is_empty() {
            let fault = Fault::new("no camera", "add a [[camera]] table for each camera");
            return Err(source.error(0, fault));
        }
        if let Some(calibration) = file.calibration {
            let offset = calibration.span().start;
            let calibration = calibration.into_inner();
            calibration.check(&hash, calibration::today()).map_err(|fault| source.error(offset, fault))?;
            rig.calibration = Some(calibration);
        }
        Ok(rig)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RigFile {
    calibration: Option<Spanned<Calibration>>,
    #[serde(default)]
    camera: Vec<Spanned<CameraEntry>>,
}

/// A camera as its file has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraEntry {
    id: String,
    width: u32,
    height: u32,
    model: Model,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    distortion: Vec<f64>,
    world_from_camera: PoseEntry,
    #[serde(default)]
    line_time_us: f64,
    #[serde(default)]
    sync: String,
    serial: Option<String>,
    #[serde(default)]
    source: CameraSource,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Model {
    Pinhole,
    Radtan,
    Fisheye,
}

impl CameraEntry {
    fn check(self) -> Result<(Camera, CameraSource), Fault> {
        let Self { id, width, height, fx, fy, cx, cy, .. } = self;
        let plain = |letter: char| letter.is_ascii_alphanumeric() || "_-".contains(letter);
        if id.is_empty() || !id.chars().all(plain) {
            return Err(Fault::new(
                format!("camera id `{id}` cannot name a folder or a topic"),
                "use letters, digits, `_` and `-`",
            ));
        }
        if width == 0 || height == 0 {
            return Err(Fault::new(
                format!("camera `{id}` has a size of {width}x{height} pixels"),
                "write the size of the images that it delivers",
            ));
        }
        if ![fx, fy, cx, cy].iter().chain(&self.distortion).all(|number| number.is_finite()) {
            return Err(Fault::new(
                format!("camera `{id}` has an intrinsic that is not finite"),
                "write plain decimal numbers",
            ));
        }
        if fx <= 0.0 || fy <= 0.0 {
            return Err(Fault::new(
                format!("camera `{id}` has focal lengths {fx}, {fy}"),
                "write positive focal lengths in pixels",
            ));
        }
        /// No sensor takes longer than this to read one row.
        const MOST_LINE_TIME_US: f64 = 1000.0;
        if !(0.0..=MOST_LINE_TIME_US).contains(&self.line_time_us) {
            return Err(Fault::new(
                format!("camera `{id}` has a line time of {} microseconds", self.line_time_us),
                "write the time between two rows in microseconds (about 30 for a 1080p webcam), 0 for a global \
                 shutter",
            ));
        }
        let distortion = distortion(self.model, &self.distortion)
            .map_err(|fault| Fault { problem: format!("camera `{id}`: {}", fault.problem), ..fault })?;
        let world_from_camera = self.world_from_camera.to_isometry("world_from_camera")?;
        let camera = Camera {
            id,
            width,
            height,
            focal_px: Vector2::new(fx, fy),
            center_px: Vector2::new(cx, cy),
            distortion,
            world_from_camera,
            line_time_s: self.line_time_us * 1e-6,
        };
        Ok((camera, self.source))
    }
}

/// Coefficients in OpenCV's order: 4, 5 or 8 for `radtan`, 4 for `fisheye`, none for `pinhole`.
fn distortion(model: Model, coefficients: &[f64]) -> Result<Distortion, Fault> {
    let count = coefficients.len();
    let wrong = |remedy: &str| {
        Err(Fault::new(format!("{count} distortion coefficients do not fit the model"), remedy))
    };
    match model {
        Model::Pinhole if count == 0 || coefficients.iter().all(|k| *k == 0.0) => Ok(Distortion::Pinhole),
        Model::Pinhole => wrong("remove `distortion`, or use model = \"radtan\""),
        Model::Radtan if [4, 5, 8].contains(&count) => {
            let mut k = [0.0; 8];
            k[..count].copy_from_slice(coefficients);
            Ok(Distortion::RadTan(k))
        }
        Model::Radtan => wrong("give 4, 5 or 8 of k1, k2, p1, p2, k3, k4, k5, k6"),
        Model::Fisheye => match coefficients.try_into() {
            Ok(k) => Ok(Distortion::Fisheye(k)),
            Err(_) => wrong("give 4: k1, k2, k3, k4 of OpenCV's fisheye model"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"
[[camera]]
id = "left"
width = 1280
height = 720
model = "radtan"
fx = 700
fy = 700.5
cx = 640
cy = 360
distortion = [-0.1, 0.01, 0.0, 0.0, 0.002]
line_time_us = 25.6
world_from_camera = { xyz = [1.0, 0.0, 1.4], quat = [0.5, -0.5, 0.5, -0.5] }
source = { device = "/dev/video0", half = "left" }
"#;

    fn load(text: &str) -> Result<Rig, ConfigError> {
        Rig::from_source(&Source { path: "rig.toml".into(), text: text.to_owned() })
    }

    fn complaint(text: &str) -> String {
        load(text).expect_err("the file is wrong").to_string()
    }

    #[test]
    fn a_good_file_is_read_whole() {
        let sut = load(GOOD).expect("valid");
        assert_eq!(sut.camera_index("left"), Some(0));
        assert_eq!(sut.cameras[0].focal_px, Vector2::new(700.0, 700.5));
        let k = [-0.1, 0.01, 0.0, 0.0, 0.002, 0.0, 0.0, 0.0];
        assert_eq!(sut.cameras[0].distortion, Distortion::RadTan(k));
        assert_eq!((sut.sources[0].half, sut.sources[0].remote), (Some(Half::Left), false));
    }

    #[test]
    fn a_typo_is_named_with_its_line_and_a_guess() {
        let message = complaint(&GOOD.replace("width", "widht"));
        assert!(message.starts_with("rig.toml:4: unknown field `widht`"), "{message}");
        assert!(message.ends_with("did you mean `width`?"), "{message}");
    }

    #[test]
    fn a_typo_inside_a_pose_is_named_with_its_line() {
        let message = complaint(&GOOD.replace("quat", "qaut"));
        assert!(message.starts_with("rig.toml:13:"), "{message}");
        assert!(message.ends_with("did you mean `quat`?"), "{message}");
    }

    #[test]
    fn an_unknown_model_is_answered_with_the_known_ones() {
        let message = complaint(&GOOD.replace("\"radtan\"", "\"radtam\""));
        assert!(message.contains("did you mean `radtan`?"), "{message}");
    }

    #[test]
    fn a_camera_named_twice_is_refused_where_it_is_named_again() {
        let message = complaint(&format!("{GOOD}{GOOD}"));
        assert!(message.starts_with("rig.toml:16: camera id `left` is used twice"), "{message}");
    }

    #[test]
    fn numbers_that_make_no_sense_are_refused() {
        let cases = [
            ("width = 1280", "width = 0", "0x720"),
            ("fx = 700", "fx = -700", "focal lengths -700"),
            ("cy = 360", "cy = nan", "not finite"),
            ("line_time_us = 25.6", "line_time_us = -1", "line time of -1"),
            ("0.002]", "0.002, 0.0]", "6 distortion coefficients"),
            ("[0.5, -0.5,", "[0.5, 0.9,", "norm"),
            ("[1.0, 0.0, 1.4]", "[1.0, inf, 1.4]", "not finite"),
            ("\"left\"\nwidth", "\"le/ft\"\nwidth", "cannot name a folder"),
        ];
        for (good, bad, expected) in cases {
            assert!(GOOD.contains(good), "{good}");
            let message = complaint(&GOOD.replace(good, bad));
            assert!(message.contains(expected) && message.contains("hint: "), "{message}");
        }
    }

    #[test]
    fn a_calibration_that_is_stale_or_of_other_numbers_is_refused_with_the_reason() {
        let mut rig = load(GOOD).expect("valid");
        rig.calibration = Some(Calibration::of_today(Some(0.21)));
        rig.serials = vec![Some("SN1".to_owned())];
        let text = rig.to_toml();
        let again = load(&text).expect("of today");
        let stated = again.calibration.clone().expect("written");
        assert_eq!((stated.rms_px, &again.serials), (Some(0.21), &rig.serials));
        assert!(stated.hash.is_some());
        assert!(again.check_serial(0, "SN1").is_ok());
        let other = again.check_serial(0, "SN2").expect_err("another camera").to_string();
        assert!(other.contains("SN1") && other.contains("SN2 is connected"), "{other}");
        let changed = complaint(&text.replace("fx = 700", "fx = 701"));
        assert!(changed.contains("rig.toml:1: cameras were changed after their calibration"), "{changed}");
        let date = rig.calibration.and_then(|calibration| calibration.date).expect("today");
        let old =
            complaint(&text.replace(&date, "2020-02-29").replace("rms_px", "max_age_days = 90\nrms_px"));
        assert!(old.contains("calibration of 2020-02-29 is") && old.contains("meant for 90"), "{old}");
        assert!(complaint(&text.replace(&date, "2020-02")).contains("is no day"));
    }

    #[test]
    fn what_is_written_is_read_again_as_it_was() {
        let rig = load(GOOD).expect("valid");
        let again = load(&rig.to_toml()).expect("valid");
        assert_eq!(again.cameras[0].distortion, rig.cameras[0].distortion);
        assert_eq!(again.cameras[0].line_time_s, rig.cameras[0].line_time_s);
        assert_eq!(again.cameras[0].world_from_camera, rig.cameras[0].world_from_camera);
    }

    #[test]
    fn an_empty_file_and_a_missing_one_are_errors() {
        assert!(complaint("").contains("no camera"));
        let missing = Rig::load(Path::new("/no/such/rig.toml")).expect_err("missing").to_string();
        assert!(missing.contains("/no/such/rig.toml"), "{missing}");
    }
}
