//! From frames of cameras to the pose of each shell, update after update.
//!
//! ```text
//!            ┌──────────────── Motions ◄───────────────┐
//!            ▼                                          │
//!  image ──► Eye ────► CameraUpdate ─────────┐          │
//!            one a camera: reads the tags    ├──► Fusion ──► TrackUpdate
//!            where they are expected         │    solves each shell from all views at their own
//!  image ──► Scout ──► CameraUpdate ─────────┘    times, filters, judges
//!            whole images for what is lost, regions for what the eye missed
//! ```
//!
//! [`Tracker`] runs all of it on a set of frames, one after the other: deterministic, for recordings. A
//! station runs each [`Eye`], the [`Scout`] and the [`Fusion`] on threads of their own, or eyes on other
//! machines: what passes between them are plain values. Nothing depends on the wall clock but the reported
//! durations: the same frames give the same poses.

mod admission;
mod alignment;
mod eye;
mod filter;
mod fusion;
mod hinge;
mod plan;
mod scout;
mod settings;
mod shell;
mod update;

use rayon::prelude::*;

use crate::detect::DetectorError;
use crate::image::Frame;
pub use crate::pose::{Fate, Matrix18};
use crate::rig::Rig;
use crate::shells::ShellSet;
use crate::source::FrameSet;
pub use admission::Dropped;
pub use eye::Eye;
pub use filter::{FilterSettings, Manoeuvre, Motion};
pub use fusion::{Fusion, Motions};
pub use hinge::Hinge;
pub use scout::Scout;
pub use settings::TrackerSettings;
pub use update::{CameraUpdate, MissedTag, SeenTag, ShellUpdate, TagOwners, TrackUpdate, Verdict};

/// Follows all shells of a set with all cameras of a rig, one set of frames after the other.
#[derive(Debug)]
pub struct Tracker {
    eyes: Vec<Eye>,
    /// One a camera, so that all may search at once.
    scouts: Vec<Scout>,
    fusion: Fusion,
    /// Counts updates: whose turn it is to search its whole image.
    turn: usize,
}

impl Tracker {
    /// A tracker that has seen nothing yet.
    pub fn new(rig: Rig, shells: ShellSet, settings: TrackerSettings) -> Result<Self, DetectorError> {
        let cameras = 0..rig.cameras.len();
        let eyes = cameras.clone().map(|camera| Eye::new(&rig, camera, &shells, &settings));
        let scouts = cameras.map(|camera| Scout::new(&rig, camera, &shells, &settings));
        Ok(Self {
            eyes: eyes.collect(),
            scouts: scouts.collect::<Result<_, _>>()?,
            fusion: Fusion::new(rig, shells, settings),
            turn: 0,
        })
    }

    /// The cameras.
    pub fn rig(&self) -> &Rig {
        self.fusion.rig()
    }

    /// The shells, in the order of every update.
    pub fn shells(&self) -> &ShellSet {
        self.fusion.shells()
    }

    /// Takes in what cameras saw at about one instant.
    pub fn update(&mut self, frames: &FrameSet) -> TrackUpdate {
        let seen = self.look(frames);
        self.fuse(seen)
    }

    /// The first half of [`Tracker::update`]: what each camera's frame shows.
    pub fn look(&mut self, frames: &FrameSet) -> Vec<CameraUpdate> {
        self.turn = self.turn.wrapping_add(1);
        let motions = self.fusion.motions();
        let time_ns = frames.time_ns();
        // The whole image of one camera at a time, so that no update is late; of all while nothing is known.
        let lost = self.fusion.lost_at(time_ns);
        let everyone = lost && motions.nothing_known_at(time_ns);
        let turn = self.turn % self.eyes.len();
        self.eyes
            .par_iter_mut()
            .zip(self.scouts.par_iter_mut())
            .enumerate()
            .filter_map(|(camera, (eye, scout))| {
                let frame = frames.frames.iter().find(|frame| frame.camera == camera)?;
                let whole = everyone || (lost && turn == camera);
                Some(look(eye, scout, whole, frame, &motions))
            })
            .collect()
    }

    /// The second half: what it says of the shells.
    pub fn fuse(&mut self, seen: Vec<CameraUpdate>) -> TrackUpdate {
        self.fusion.update(seen)
    }

    /// Where the shells will be at another instant, in the order of the shells.
    pub fn predict(&self, time_ns: u64) -> Vec<ShellUpdate> {
        self.fusion.predict(time_ns)
    }
}

/// One camera's frame: decoded, read where tags are expected, and maybe searched, whole or in a region.
fn look(eye: &mut Eye, scout: &mut Scout, whole: bool, frame: &Frame, motions: &Motions) -> CameraUpdate {
    let begun = std::time::Instant::now();
    let image = match frame.pixels.to_gray() {
        Ok(image) => image,
        Err(error) => return CameraUpdate::unusable(frame.camera, frame.capture_ns, error.to_string()),
    };
    let decode_ns = nanoseconds(begun.elapsed());
    let mut update = eye.look(&image, frame.capture_ns, motions);
    update.decode_ns = decode_ns;
    let region = eye.wanted().filter(|_| !whole);
    if whole || region.is_some() {
        scout.add_to(&mut update, eye, &image, region);
    }
    update
}

fn nanoseconds(duration: std::time::Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests;
