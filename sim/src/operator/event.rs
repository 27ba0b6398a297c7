//! What disturbs tracking, at which time: covered lenses, hands and people in the way, torn tags, posters, wrong
//! exposures, a bumped camera. All optional; `configs/scenes/operator.toml` is the manual of their keys.
//!
//! Times are scene times. They do not start over with the motion's period: each event happens once.

use nalgebra::Isometry3;
use serde::Deserialize;

use super::motion::Home;

/// A stretch of scene time, its begin within and its end outside, seconds.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(from = "[f64; 2]")]
pub struct Span {
    /// From this time on.
    pub begin_s: f64,
    /// Until before this time.
    pub end_s: f64,
}

impl From<[f64; 2]> for Span {
    fn from([begin_s, end_s]: [f64; 2]) -> Self {
        Self { begin_s, end_s }
    }
}

impl Span {
    /// Whether a time is within.
    pub fn holds(&self, t_s: f64) -> bool {
        (self.begin_s..self.end_s).contains(&t_s)
    }

    /// How much of it has passed, from 0 to 1.
    pub fn share(&self, t_s: f64) -> f64 {
        ((t_s - self.begin_s) / (self.end_s - self.begin_s)).clamp(0.0, 1.0)
    }
}

/// All events of a scene, by kind.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Events {
    /// Lenses that see nothing.
    pub cover: Vec<Cover>,
    /// A hand that passes close before a camera.
    pub pass: Vec<Pass>,
    /// A second person with shells of their own.
    pub visitor: Vec<Visitor>,
    /// A tag that comes off its shell.
    pub tear: Vec<Tear>,
    /// Tags on a sheet in the room.
    pub poster: Vec<Poster>,
    /// Images that are too bright, too dark or exposed for another time.
    pub exposure: Vec<Exposing>,
    /// A camera that is not any more where the rig file has it.
    pub bump: Vec<Bump>,
}

/// What a covered lens sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Look {
    /// Nothing at all.
    Black,
    /// The skin of a hand, far out of focus.
    Hand,
}

/// A covered lens. A whole image is covered or not, by its capture time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cover {
    /// When.
    pub during_s: Span,
    /// Ids of the cameras; all if empty.
    #[serde(default)]
    pub cameras: Vec<String>,
    /// By what.
    pub look: Look,
}

/// A forearm and a hand that pass before a camera, from its left to its right.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pass {
    /// When; the hand is beside the image at both ends.
    pub during_s: Span,
    /// Id of the camera.
    pub camera: String,
    /// How far from the lens.
    pub distance_m: f64,
}

/// Which tags a second person wears.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VisitorTags {
    /// Numbers of the family that no shell of the operator has.
    Other,
    /// The operator's own.
    Same,
}

/// A second person, who makes the operator's motions at another place and another time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Visitor {
    /// When he is there.
    pub during_s: Span,
    /// His tags.
    pub tags: VisitorTags,
    /// His place: what carries the operator to him.
    pub world_from_operator: Home,
    /// He makes the operator's motions so much later.
    #[serde(default)]
    pub delay_s: f64,
}

/// How a tag comes off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TearLook {
    /// It is gone; bare white paper is left.
    Gone,
    /// It hangs on its upper edge, turned away from its facet by 50 degrees.
    Hanging,
}

/// A tag that comes off its shell.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tear {
    /// When it is off.
    pub during_s: Span,
    /// Its number.
    pub id: u32,
    /// How.
    pub look: TearLook,
}

/// A sheet with tags in a row, fixed in the room.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Poster {
    /// When it hangs there.
    pub during_s: Span,
    /// What is printed on it, from left to right.
    pub ids: Vec<u32>,
    /// Side of each tag's black square.
    pub size_m: f64,
    /// Its centre; x to the right of who reads it, y up, z out of the print.
    pub world_from_poster: Home,
}

/// A wrong exposure.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exposing {
    /// When.
    pub during_s: Span,
    /// Ids of the cameras; all if empty.
    #[serde(default)]
    pub cameras: Vec<String>,
    /// Grey levels above black are multiplied by this.
    #[serde(default = "unchanged")]
    pub brightness: f64,
    /// Exposure time in place of the sensor's.
    pub exposure_s: Option<f64>,
}

/// A camera that was pushed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bump {
    /// When it stands wrongly.
    pub during_s: Span,
    /// Id of the camera.
    pub camera: String,
    /// Its new pose in the frame that it had before: x right, y down, z forward.
    pub camera_from_bumped: Home,
}

fn unchanged() -> f64 {
    1.0
}

/// Whether a list of cameras means this one.
fn means(cameras: &[String], id: &str) -> bool {
    cameras.is_empty() || cameras.iter().any(|camera| camera == id)
}

impl Events {
    /// What covers a camera's lens at a time.
    pub fn cover_of(&self, camera: &str, t_s: f64) -> Option<Look> {
        let cover = self.cover.iter().find(|it| it.during_s.holds(t_s) && means(&it.cameras, camera));
        cover.map(|cover| cover.look)
    }

    /// The factor on a camera's grey levels, and its exposure time if it differs from the sensor's.
    pub fn exposing_of(&self, camera: &str, t_s: f64) -> (f64, Option<f64>) {
        let event = self.exposure.iter().find(|it| it.during_s.holds(t_s) && means(&it.cameras, camera));
        event.map_or((1.0, None), |event| (event.brightness, event.exposure_s))
    }

    /// How a tag is off its shell at a time.
    pub fn tear_of(&self, id: u32, t_s: f64) -> Option<TearLook> {
        self.tear.iter().find(|it| it.id == id && it.during_s.holds(t_s)).map(|tear| tear.look)
    }

    /// Ids of all cameras that an event names.
    pub fn cameras(&self) -> impl Iterator<Item = &str> {
        let lists = self.cover.iter().map(|it| &it.cameras).chain(self.exposure.iter().map(|it| &it.cameras));
        let single = self.pass.iter().map(|it| &it.camera).chain(self.bump.iter().map(|it| &it.camera));
        lists.flatten().chain(single).map(String::as_str)
    }

    /// The first value out of range, in words.
    pub(super) fn fault(&self) -> Option<String> {
        let spans = self
            .cover
            .iter()
            .map(|it| ("cover", it.during_s))
            .chain(self.pass.iter().map(|it| ("pass", it.during_s)))
            .chain(self.visitor.iter().map(|it| ("visitor", it.during_s)))
            .chain(self.tear.iter().map(|it| ("tear", it.during_s)))
            .chain(self.poster.iter().map(|it| ("poster", it.during_s)))
            .chain(self.exposure.iter().map(|it| ("exposure", it.during_s)))
            .chain(self.bump.iter().map(|it| ("bump", it.during_s)));
        for (kind, Span { begin_s, end_s }) in spans {
            if begin_s.is_nan() || end_s.is_nan() || begin_s >= end_s {
                return Some(format!("{kind}: during_s = [{begin_s}, {end_s}] must rise (inf is allowed)"));
            }
        }
        let ranges = (self.pass.iter().map(|it| ("pass: distance_m", it.distance_m, 0.2, 1.0)))
            .chain(self.exposure.iter().map(|it| ("exposure: brightness", it.brightness, 0.01, 100.0)))
            .chain(self.exposure.iter().filter_map(|it| {
                Some(("exposure: exposure_s", it.exposure_s?, 0.0, super::scene::MOST_EXPOSURE_S))
            }))
            .chain(self.poster.iter().map(|it| ("poster: size_m", it.size_m, 0.001, 1.0)));
        super::scene::out_of_range(ranges)
    }
}

impl Bump {
    /// As a rigid transform.
    pub fn isometry(&self) -> Isometry3<f64> {
        self.camera_from_bumped.isometry()
    }
}
