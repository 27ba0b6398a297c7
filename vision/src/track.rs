//! From frames of all cameras at one instant to the pose of each shell, update after update.
//!
//! ```text
//!  FrameSet ──► decode ──► search plan ──► detect ──► solve each shell ──► filter ──► TrackUpdate
//!              (a thread   predicted        tags in    joint, robust,      gate,
//!               a camera)  regions, or      each       start from the      verdict
//!                          the whole image  image      prediction
//! ```
//!
//! Nothing depends on the wall clock but the reported durations: the same frames give the same poses.

mod filter;
mod plan;
mod settings;
mod shell;
mod update;

use std::collections::HashMap;
use std::time::Instant;

use rayon::prelude::*;

use crate::detect::{Detection, Detector, DetectorError, Search};
use crate::image::Frame;
use crate::pose::Observation;
use crate::rig::Rig;
use crate::shells::ShellSet;
use crate::source::FrameSet;
pub use filter::FilterSettings;
pub use settings::TrackerSettings;
use shell::ShellTracker;
pub use update::{CameraUpdate, SeenTag, ShellUpdate, TrackUpdate, Verdict};

/// Follows all shells of a set with all cameras of a rig.
#[derive(Debug)]
pub struct Tracker {
    rig: Rig,
    shells: ShellSet,
    settings: TrackerSettings,
    detectors: Vec<Detector>,
    trackers: Vec<ShellTracker>,
    /// Shell and tag index of each id.
    owner_of_id: HashMap<u32, (usize, usize)>,
    /// Counts updates: whose turn it is to search its whole image.
    turn: usize,
}

impl Tracker {
    /// A tracker that has seen nothing yet.
    pub fn new(rig: Rig, shells: ShellSet, settings: TrackerSettings) -> Result<Self, DetectorError> {
        let mut owner_of_id = HashMap::new();
        for (s, shell) in shells.shells.iter().enumerate() {
            for (t, tag) in shell.tags.iter().enumerate() {
                owner_of_id.insert(tag.id, (s, t));
            }
        }
        let ids: Vec<u32> = owner_of_id.keys().copied().collect();
        let detectors = rig.cameras.iter().map(|_| Detector::new(&ids)).collect::<Result<_, _>>()?;
        let trackers = shells.shells.iter().map(|_| ShellTracker::default()).collect();
        Ok(Self { rig, shells, settings, detectors, trackers, owner_of_id, turn: 0 })
    }

    /// The cameras.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// The shells, in the order of every update.
    pub fn shells(&self) -> &ShellSet {
        &self.shells
    }

    /// Takes in what the cameras saw at one instant.
    pub fn update(&mut self, frames: &FrameSet) -> TrackUpdate {
        let time_ns = frames.time_ns();
        self.turn = self.turn.wrapping_add(1);
        let begun = Instant::now();
        let plans = plan::plan(&self.rig, &self.shells, &self.trackers, &self.settings, self.turn, time_ns);
        let mut cameras: Vec<CameraUpdate> =
            self.rig.cameras.iter().map(|_| CameraUpdate::default()).collect();
        let mut frame_of_camera: Vec<Option<&Frame>> = vec![None; cameras.len()];
        for frame in &frames.frames {
            if let Some(slot) = frame_of_camera.get_mut(frame.camera) {
                *slot = Some(frame);
            }
        }
        self.detectors
            .par_iter_mut()
            .zip(cameras.par_iter_mut())
            .zip(frame_of_camera.par_iter().zip(&plans))
            .zip(&self.rig.cameras)
            .for_each(|(((detector, update), (frame, plan)), camera)| {
                if let Some(frame) = frame {
                    let size = (camera.width, camera.height);
                    look(detector, frame, plan, size, &self.owner_of_id, update);
                }
            });
        let looked = begun.elapsed();
        let shells = self.solve(time_ns, &mut cameras);
        let total = begun.elapsed();
        let decode_ns = cameras.iter().map(|camera| camera.decode_ns).max().unwrap_or(0);
        TrackUpdate {
            time_ns,
            shells,
            cameras,
            decode_ns,
            detect_ns: nanoseconds(looked).saturating_sub(decode_ns),
            solve_ns: nanoseconds(total.saturating_sub(looked)),
        }
    }

    /// Where the shells will be at another instant, in the order of the shells.
    pub fn predict(&self, time_ns: u64) -> Vec<ShellUpdate> {
        self.trackers.iter().map(|tracker| tracker.at(time_ns, &self.settings)).collect()
    }

    fn solve(&mut self, time_ns: u64, cameras: &mut [CameraUpdate]) -> Vec<ShellUpdate> {
        let mut updates = Vec::with_capacity(self.trackers.len());
        for (s, (shell, tracker)) in self.shells.shells.iter().zip(&mut self.trackers).enumerate() {
            let mut observations = Vec::new();
            let mut places = Vec::new();
            for (c, camera) in cameras.iter().enumerate() {
                for (k, seen) in camera.tags.iter().enumerate().filter(|(_, seen)| seen.shell == s) {
                    places.push((c, k));
                    observations.push(Observation {
                        camera: c,
                        tag: seen.tag,
                        corners_px: seen.detection.corners_px,
                        sigma_px: self.settings.corner_sigma_px(&seen.detection),
                    });
                }
            }
            let (update, used) =
                tracker.update(time_ns, shell, &self.rig.cameras, &observations, &self.settings);
            for ((c, k), used) in places.into_iter().zip(used) {
                cameras[c].tags[k].used = used;
            }
            if let Some(pose) = update.world_from_shell {
                update::reproject(s, shell, &pose, &self.rig.cameras, cameras);
            }
            updates.push(update);
        }
        updates
    }
}

/// Decodes one camera's frame and searches it.
fn look(
    detector: &mut Detector,
    frame: &Frame,
    plan: &plan::Plan,
    size: (u32, u32),
    owner_of_id: &HashMap<u32, (usize, usize)>,
    update: &mut CameraUpdate,
) {
    update.capture_ns = Some(frame.capture_ns);
    let begun = Instant::now();
    let image = match frame.pixels.to_gray() {
        Ok(image) => image,
        Err(error) => {
            update.problem = Some(error.to_string());
            return;
        }
    };
    update.decode_ns = nanoseconds(begun.elapsed());
    if (image.width(), image.height()) != size {
        update.problem = Some(format!(
            "the image has {}x{} pixels, the rig file says {}x{}",
            image.width(),
            image.height(),
            size.0,
            size.1
        ));
        return;
    }
    let mut found = detector.detect(&image, Search::Regions(&plan.regions));
    if let Some(decimate) = plan.full_decimate {
        let known: Vec<u32> = found.iter().map(|detection| detection.id).collect();
        let rest = detector.detect(&image, Search::Full { decimate });
        found.extend(rest.into_iter().filter(|detection| !known.contains(&detection.id)));
    }
    update.searched = plan.regions.iter().map(|region| region.rect).collect();
    update.searched_whole = plan.full_decimate.is_some();
    let seen = |detection: Detection| {
        let &(shell, tag) = owner_of_id.get(&detection.id)?;
        Some(SeenTag { detection, shell, tag, used: false, reprojected_px: None })
    };
    update.tags = found.into_iter().filter_map(seen).collect();
}

fn nanoseconds(duration: std::time::Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests;
