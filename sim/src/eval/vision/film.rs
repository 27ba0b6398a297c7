//! A stretch of a scene as its cameras see it, moment by moment: images, and what is true of them.
//!
//! Nothing is held longer than a batch: a passage may be as long as an evening. Cameras that the scene gives a phase of
//! their own take their pictures at their own moments, and each moment is a set of frames for the tracker.

use locoman_vision::image::{Frame, GrayImage, Pixels};
use locoman_vision::source::FrameSet;
use rayon::prelude::*;

use crate::operator::encode;
use crate::operator::schedule::{FIRST_CAPTURE_NS, Moment};
use crate::operator::sight::Sighting;
use crate::operator::studio::{Picture, Studio};
use crate::operator::{Schedule, motion::Posture};

/// Moments that are rendered before any is shown: enough to keep all cores busy, few to hold.
const BATCH: usize = 8;
/// Draws of samples where one rendering serves many pictures: the errors of edges fall to a quarter.
pub const STILL_DRAWS: u32 = 16;

/// What to render.
#[derive(Debug, Clone, Copy)]
pub struct Film<'a> {
    /// Scene and cameras.
    pub studio: &'a Studio,
    /// Scene time of its begin.
    pub begin_s: f64,
    /// Its length.
    pub seconds: f64,
    /// Images a second of each camera.
    pub rate_hz: f64,
    /// How its images reach the tracker.
    pub coding: Coding,
}

/// How images reach the tracker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coding {
    /// As a camera without compression delivers them.
    Raw,
    /// As in recordings.
    Jpeg,
}

/// What cameras saw at one moment.
#[derive(Debug, Clone)]
pub struct Shot {
    /// Scene time of the exposure's middle row.
    pub time_s: f64,
    /// The images.
    pub frames: FrameSet,
    /// What each of these cameras had before it: index in the rig, and its tags.
    pub sightings: Vec<(usize, Vec<Sighting>)>,
}

impl Film<'_> {
    /// Renders on all cores, and shows each moment in the order of time.
    pub fn show(&self, mut watch: impl FnMut(Shot) -> anyhow::Result<()>) -> anyhow::Result<()> {
        for batch in self.moments()?.chunks(BATCH) {
            let shots: Vec<Shot> =
                batch.par_iter().map(|moment| self.shot(moment)).collect::<anyhow::Result<_>>()?;
            shots.into_iter().try_for_each(&mut watch)?;
        }
        Ok(())
    }

    /// The same where nothing moves: rendered once, and developed for each moment with noise of its own.
    pub fn show_still(&self, mut watch: impl FnMut(Shot) -> anyhow::Result<()>) -> anyhow::Result<()> {
        let cameras = 0..self.studio.cameras().len();
        let look = |camera: usize| {
            let light = self.studio.expose(camera, self.begin_s, STILL_DRAWS);
            (light, self.studio.sightings(camera, self.begin_s))
        };
        let exposed: Vec<_> = cameras.into_par_iter().map(look).collect();
        for moment in self.moments()? {
            let frame = |&camera: &usize| {
                self.frame(camera, &moment, self.studio.develop(&exposed[camera].0, moment.frame))
            };
            let frames = moment.cameras.par_iter().map(frame).collect::<anyhow::Result<_>>()?;
            let sightings =
                moment.cameras.iter().map(|camera| (*camera, exposed[*camera].1.clone())).collect();
            watch(Shot { time_s: moment.time_s, frames: FrameSet { frames }, sightings })?;
        }
        Ok(())
    }

    fn moments(&self) -> anyhow::Result<Vec<Moment>> {
        let schedule = Schedule::new(self.begin_s + self.seconds, self.rate_hz)?;
        let mut moments = schedule.moments(self.studio);
        moments.retain(|moment| moment.time_s >= self.begin_s);
        Ok(moments)
    }

    fn shot(&self, moment: &Moment) -> anyhow::Result<Shot> {
        let cameras = &moment.cameras;
        let frame = |&camera: &usize| {
            self.frame(camera, moment, self.studio.picture(camera, moment.time_s, moment.frame))
        };
        let sightings = |&camera: &usize| (camera, self.studio.sightings(camera, moment.time_s));
        Ok(Shot {
            time_s: moment.time_s,
            frames: FrameSet { frames: cameras.iter().map(frame).collect::<anyhow::Result<_>>()? },
            sightings: cameras.iter().map(sightings).collect(),
        })
    }

    fn frame(&self, camera: usize, moment: &Moment, picture: Picture) -> anyhow::Result<Frame> {
        let pixels = match self.coding {
            Coding::Jpeg => Pixels::Encoded(encode::jpeg(&picture)?),
            Coding::Raw => Pixels::Gray(GrayImage::new(picture.width, picture.height, picture.grey)?),
        };
        Ok(Frame { camera, capture_ns: moment.capture_ns, pixels })
    }
}

impl Shot {
    /// The same with images that are decoded already, for several trackers that look at them.
    pub fn decoded(mut self) -> anyhow::Result<Self> {
        for frame in &mut self.frames.frames {
            if let Pixels::Encoded(bytes) = &frame.pixels {
                frame.pixels = Pixels::Gray(GrayImage::decode(bytes)?);
            }
        }
        Ok(self)
    }
}

/// The scene time of a capture time.
pub fn scene_s(time_ns: u64) -> f64 {
    (i128::from(time_ns) - i128::from(FIRST_CAPTURE_NS)) as f64 * 1e-9
}

/// Where the shells truly are at a capture time.
pub fn truth_at(studio: &Studio, time_ns: u64) -> Posture {
    studio.true_posture(scene_s(time_ns))
}
