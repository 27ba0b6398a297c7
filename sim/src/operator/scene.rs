//! The scene file: motion, light and sensor. Its default, `configs/scenes/operator.toml`, is its manual.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::event::Events;
use super::motion::{Axis, Body, Motion};

/// A scene file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("cannot read the scene file {path}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// A key or a value is wrong; the text shows the line.
    #[error("{path} cannot be used as a scene")]
    Parse {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        source: Box<toml::de::Error>,
    },
    /// A value is out of its range.
    #[error("{path}: {message}")]
    Value {
        /// The file.
        path: PathBuf,
        /// What is wrong and what would be right.
        message: String,
    },
}

/// All that a rendering needs beside rig, shells and seed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// How the shells move.
    pub motion: Motion,
    /// How they are lit.
    pub light: Light,
    /// How the cameras take it.
    pub sensor: Sensor,
    /// Which cameras take their pictures later than the others.
    #[serde(default, rename = "camera")]
    pub cameras: Vec<Phase>,
    /// What disturbs.
    #[serde(default, rename = "event")]
    pub events: Events,
}

/// A camera that is not synchronised with the rest; those that the rig exposes together with it share its phase.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Phase {
    /// The camera's id in the rig file.
    pub id: String,
    /// How much later it takes its pictures; taken modulo the time between two pictures.
    pub phase_s: f64,
}

/// One distant lamp, light from everywhere, and a gradient over the room.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Direction towards the lamp, in the world.
    pub towards_lamp: [f64; 3],
    /// Share of the lamp on a surface that faces it.
    pub lamp: f64,
    /// Share of the light from everywhere.
    pub ambient: f64,
    /// Relative change of all light per metre along the world's axes, from the chest.
    pub gradient_per_m: [f64; 3],
}

/// Lens and sensor apart from the camera model.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Time for which each row is exposed, centred on the row's own time.
    pub exposure_s: f64,
    /// Standard deviation of the lens's Gaussian point-spread function, in pixels.
    pub defocus_px: f64,
    /// Grey level of a white surface in full light.
    pub white_level: f64,
    /// Grey level of darkness.
    pub black_level: f64,
    /// Standard deviation of the read noise, in grey levels.
    pub read_noise: f64,
    /// Variance of the shot noise per grey level of signal.
    pub shot_noise: f64,
    /// Loss of light at a ray of 45 degrees from the optical axis.
    pub vignetting: f64,
    /// Quality of JPEG pictures, from 1 to 100.
    #[serde(default = "standard_jpeg_quality")]
    pub jpeg_quality: i32,
}

/// Compression without visible loss; corner positions shift by less than 0.01 px.
fn standard_jpeg_quality() -> i32 {
    92
}

/// Longer exposures than this are mistakes of unit.
pub(super) const MOST_EXPOSURE_S: f64 = 0.1;

/// The first of some named values that is outside its range, in words.
pub(super) fn out_of_range<'a>(ranges: impl IntoIterator<Item = (&'a str, f64, f64, f64)>) -> Option<String> {
    ranges
        .into_iter()
        .find(|(_, value, low, high)| !(low..=high).contains(&value))
        .map(|(name, value, low, high)| format!("{name} = {value} must lie between {low} and {high}"))
}

impl Scene {
    /// Reads and checks a scene file.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
        let scene: Self = toml::from_str(&text)
            .map_err(|source| SceneError::Parse { path: path.to_owned(), source: Box::new(source) })?;
        match scene.fault() {
            Some(message) => Err(SceneError::Value { path: path.to_owned(), message }),
            None => Ok(scene),
        }
    }

    /// The first value out of range, in words.
    fn fault(&self) -> Option<String> {
        let motion = &self.motion;
        if !(motion.period_s > 0.0 && motion.period_s.is_finite()) {
            return Some(format!("period_s = {} must be positive", motion.period_s));
        }
        if let Some(wander) = motion.wander.as_ref().filter(|wander| wander.end_s() > motion.period_s) {
            return Some(format!(
                "wander ends at {} s, after period_s = {}: end it before",
                wander.end_s(),
                motion.period_s
            ));
        }
        for term in &motion.terms {
            let thumb = matches!(term.body, Body::RightThumb | Body::LeftThumb);
            if thumb != (term.axis == Axis::Open) {
                return Some(format!(
                    "term of {} moves {:?}: thumbs move along `open`, others along x … yaw",
                    term.body.name(),
                    term.axis
                ));
            }
            if !(term.begin_s >= 0.0 && term.end_s <= motion.period_s && term.ramp_s > 0.0) {
                return Some(format!(
                    "term of {} from {} s to {} s, ramp {} s: must lie in 0 … period_s = {}, ramp above 0",
                    term.body.name(),
                    term.begin_s,
                    term.end_s,
                    term.ramp_s,
                    motion.period_s
                ));
            }
        }
        let sensor = &self.sensor;
        let ranges = [
            ("exposure_s", sensor.exposure_s, 0.0, MOST_EXPOSURE_S),
            ("defocus_px", sensor.defocus_px, 0.0, 5.0),
            ("white_level", sensor.white_level, 1.0, 1000.0),
            ("black_level", sensor.black_level, 0.0, 100.0),
            ("read_noise", sensor.read_noise, 0.0, 50.0),
            ("shot_noise", sensor.shot_noise, 0.0, 10.0),
            ("vignetting", sensor.vignetting, 0.0, 1.0),
            ("jpeg_quality", f64::from(sensor.jpeg_quality), 1.0, 100.0),
        ];
        let phases = self.cameras.iter().map(|camera| ("phase_s", camera.phase_s, 0.0, 10.0));
        out_of_range(ranges.into_iter().chain(phases)).or_else(|| self.events.fault())
    }
}
