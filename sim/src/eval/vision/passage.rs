//! A stretch of the scene: coded images of all cameras, and what is true of them.

use locoman_vision::image::{Frame, Pixels};
use locoman_vision::source::FrameSet;
use rayon::prelude::*;

use crate::operator::FIRST_CAPTURE_NS;
use crate::operator::encode;
use crate::operator::motion::Posture;
use crate::operator::sight::Sighting;
use crate::operator::studio::Studio;

/// One instant of a passage.
#[derive(Debug)]
pub struct Instant {
    /// Scene time.
    pub time_s: f64,
    /// The images, coded as in recordings.
    pub frames: FrameSet,
    /// Where the shells were.
    pub truth: Posture,
    /// What each camera had before it.
    pub sightings: Vec<Vec<Sighting>>,
}

/// Its instants, by rising time.
#[derive(Debug)]
pub struct Passage(pub Vec<Instant>);

impl Passage {
    /// Renders, on all cores.
    pub fn render(studio: &Studio, begin_s: f64, seconds: f64, rate_hz: f64) -> anyhow::Result<Self> {
        let count = (seconds * rate_hz).round() as u64;
        let instant = |number: u64| -> anyhow::Result<Instant> {
            let time_s = begin_s + number as f64 / rate_hz;
            let capture_ns = FIRST_CAPTURE_NS + (time_s * 1e9).round() as u64;
            let cameras = 0..studio.cameras().len();
            let frame = |camera: usize| -> anyhow::Result<Frame> {
                let picture = studio.picture(camera, time_s, capture_ns);
                Ok(Frame { camera, capture_ns, pixels: Pixels::Encoded(encode::jpeg(&picture)?) })
            };
            Ok(Instant {
                time_s,
                frames: FrameSet { frames: cameras.clone().map(frame).collect::<anyhow::Result<_>>()? },
                truth: studio.scene().motion.posture(time_s),
                sightings: cameras.map(|camera| studio.sightings(camera, time_s)).collect(),
            })
        };
        Ok(Self((0..count).into_par_iter().map(instant).collect::<anyhow::Result<_>>()?))
    }
}
