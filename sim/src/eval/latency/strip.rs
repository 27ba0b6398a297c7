//! A short strip of images in memory, shown forwards and backwards for as long as it is wanted.
//!
//! Time is mirrored at both ends, so that hands turn round where they are and nothing jumps.

use std::path::Path;

use locoman_protocol::clock::monotonic_ns;
use locoman_vision::image::{Frame, GrayImage, Pixels};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use locoman_vision::source::{FrameSource, SourceError};
use rayon::prelude::*;

use crate::operator::scene::Scene;
use crate::operator::studio::Studio;
use crate::operator::{Inputs, Schedule};

/// Its length.
pub const SECONDS: f64 = 1.0;
/// Where it begins in the scene: the hands are on their way.
const BEGIN_S: f64 = 3.0;
/// Before the first frame is due, so that all threads run.
const LEAD_NS: u64 = 200_000_000;

/// Images by rising time, and the cameras that took them.
#[derive(Debug)]
pub struct Strip {
    /// With global shutters.
    pub rig: Rig,
    /// What the operator wears.
    pub shells: ShellSet,
    moments: Vec<(u64, Vec<(usize, GrayImage)>)>,
}

impl Strip {
    /// Renders on all cores.
    pub fn render(configs: &Path, rig: &str, rate_hz: f64, seed: u64) -> anyhow::Result<Self> {
        let mut rig = Rig::load(&configs.join("rigs").join(rig).with_extension("toml"))?;
        rig.cameras.iter_mut().for_each(|camera| camera.line_time_s = 0.0);
        let shells = ShellSet::load(&Inputs::standard(configs).shells)?;
        let scene = Scene::read(&configs.join("scenes/hand.toml"))?;
        let studio = Studio::new(&rig, &shells, scene, seed)?;
        let mut moments = Schedule::new(BEGIN_S + SECONDS, rate_hz)?.moments(&studio);
        moments.retain(|moment| moment.time_s >= BEGIN_S);
        let first_ns = moments.first().map_or(0, |moment| moment.capture_ns);
        let rendered = moments.par_iter().map(|moment| {
            let image = |&camera: &usize| {
                let picture = studio.picture(camera, moment.time_s, moment.frame);
                Ok((camera, GrayImage::new(picture.width, picture.height, picture.grey)?))
            };
            let images = moment.cameras.iter().map(image).collect::<anyhow::Result<Vec<_>>>()?;
            Ok((moment.capture_ns - first_ns, images))
        });
        let moments = rendered.collect::<anyhow::Result<_>>()?;
        Ok(Self { rig, shells, moments })
    }

    /// Shows it from now on, for some seconds.
    pub fn show(self, seconds: f64) -> Show {
        let begin_ns = monotonic_ns() + LEAD_NS;
        let end_ns = begin_ns + (seconds * 1e9) as u64;
        Show { moments: self.moments, begin_ns, end_ns, turn: 0, moment: 0, image: 0 }
    }
}

/// A strip that is being shown.
#[derive(Debug)]
pub struct Show {
    moments: Vec<(u64, Vec<(usize, GrayImage)>)>,
    begin_ns: u64,
    end_ns: u64,
    /// Even: forwards; odd: backwards.
    turn: u64,
    /// How many moments of this turn have passed, and how many images of the moment.
    moment: usize,
    image: usize,
}

impl Show {
    /// The time from the first moment to the last.
    fn length_ns(&self) -> u64 {
        self.moments.last().map_or(0, |(since_ns, _)| *since_ns)
    }
}

impl FrameSource for Show {
    fn next_frame(&mut self) -> Result<Option<Frame>, SourceError> {
        // The moment at which it turns round is shown once.
        if self.moment + 1 >= self.moments.len() {
            (self.turn, self.moment) = (self.turn + 1, 0);
        }
        let forwards = self.turn.is_multiple_of(2);
        let index = if forwards { self.moment } else { self.moments.len().saturating_sub(1 + self.moment) };
        let length_ns = self.length_ns();
        let Some((since_ns, images)) = self.moments.get(index) else { return Ok(None) };
        let Some((camera, image)) = images.get(self.image) else { return Ok(None) };
        let passed_ns = if forwards { *since_ns } else { length_ns - since_ns };
        let capture_ns = self.begin_ns + self.turn * length_ns + passed_ns;
        if capture_ns > self.end_ns {
            return Ok(None);
        }
        let frame = Frame { camera: *camera, capture_ns, pixels: Pixels::Gray(image.clone()) };
        self.image += 1;
        if self.image == images.len() {
            (self.moment, self.image) = (self.moment + 1, 0);
        }
        Ok(Some(frame))
    }

    fn skipped(&self) -> u64 {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_is_shown_forwards_and_backwards_at_a_steady_pace() {
        let image = |grey| GrayImage::new(1, 1, vec![grey]).unwrap();
        let moments = (0..3).map(|n| (10 * u64::from(n), vec![(0, image(n))])).collect();
        let mut sut = Show { moments, begin_ns: 100, end_ns: 160, turn: 0, moment: 0, image: 0 };
        let mut shown = Vec::new();
        while let Some(frame) = sut.next_frame().unwrap() {
            let Pixels::Gray(image) = frame.pixels else { panic!("it was decoded") };
            shown.push((frame.capture_ns, image.data()[0]));
        }
        assert_eq!(shown, [(100, 0), (110, 1), (120, 2), (130, 1), (140, 0), (150, 1), (160, 2)]);
    }
}
