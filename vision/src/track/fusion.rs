//! From what the cameras saw to the motion of each shell.

use std::time::Instant;

use super::filter::Motion;
use super::shell::ShellTracker;
use super::update::{self, CameraUpdate, ShellUpdate, TrackUpdate};
use super::{TrackerSettings, nanoseconds};
use crate::pose::Observation;
use crate::rig::Rig;
use crate::shells::ShellSet;

/// How each shell moved when it was last measured, in the order of the shells: what an eye has to know.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Motions {
    motions: Vec<Option<Motion>>,
    horizon_ns: u64,
}

impl Motions {
    /// Motions that were described elsewhere: one for each shell, in the order of the shells; they may be
    /// trusted for `horizon_ns` after their time.
    pub fn new(motions: Vec<Option<Motion>>, horizon_ns: u64) -> Self {
        Self { motions, horizon_ns }
    }

    /// Each as of its last measurement.
    pub fn latest(&self) -> &[Option<Motion>] {
        &self.motions
    }

    /// For how long after its measurement a motion may be trusted.
    pub fn horizon_ns(&self) -> u64 {
        self.horizon_ns
    }

    /// The motion of each shell at an instant; `None` for those that are lost.
    pub fn at(&self, time_ns: u64, settings: &TrackerSettings) -> Vec<Option<Motion>> {
        let at = |motion: &Option<Motion>| {
            let motion = motion.as_ref().filter(|motion| self.is_recent(motion, time_ns))?;
            Some(motion.predicted(time_ns, &settings.filter))
        };
        self.motions.iter().map(at).collect()
    }

    /// Which shells are not lost.
    pub fn known_at(&self, time_ns: u64) -> Vec<bool> {
        let known = |motion: &Option<Motion>| motion.as_ref().is_some_and(|m| self.is_recent(m, time_ns));
        self.motions.iter().map(known).collect()
    }

    /// Whether all shells are lost.
    pub fn nothing_known_at(&self, time_ns: u64) -> bool {
        self.motions.iter().flatten().all(|motion| !self.is_recent(motion, time_ns))
    }

    fn is_recent(&self, motion: &Motion, time_ns: u64) -> bool {
        time_ns.abs_diff(motion.time_ns) <= self.horizon_ns
    }
}

/// Solves, filters and judges all shells.
#[derive(Debug)]
pub struct Fusion {
    rig: Rig,
    shells: ShellSet,
    settings: TrackerSettings,
    trackers: Vec<ShellTracker>,
}

impl Fusion {
    /// Nothing is known yet.
    pub fn new(rig: Rig, shells: ShellSet, settings: TrackerSettings) -> Self {
        let trackers = shells.shells.iter().map(|_| ShellTracker::default()).collect();
        Self { rig, shells, settings, trackers }
    }

    /// The cameras.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// The shells, in the order of every update.
    pub fn shells(&self) -> &ShellSet {
        &self.shells
    }

    /// What the eyes have to know.
    pub fn motions(&self) -> Motions {
        Motions {
            motions: self.trackers.iter().map(|tracker| tracker.motion().cloned()).collect(),
            horizon_ns: self.settings.horizon_ns,
        }
    }

    /// Whether a shell is lost that only a search of whole images can find: thumbs are found by their palms.
    pub fn lost_at(&self, time_ns: u64) -> bool {
        let lost = |(index, tracker): (usize, &ShellTracker)| {
            self.shells.palm_of(index).is_none() && tracker.motion_at(time_ns, &self.settings).is_none()
        };
        self.trackers.iter().enumerate().any(lost)
    }

    /// Where the shells are at an instant, without a measurement at it.
    pub fn predict(&self, time_ns: u64) -> Vec<ShellUpdate> {
        self.trackers.iter().map(|tracker| tracker.at(time_ns, &self.settings)).collect()
    }

    /// Takes in what a search of a whole image has found of shells that are lost, however late it comes: it begins
    /// their motion at the time of that image. What it saw of others is left aside: newer frames follow them. Whether
    /// there was anything.
    pub fn found(&mut self, mut search: CameraUpdate) -> bool {
        let known = self.motions().known_at(search.capture_ns);
        search.tags.retain(|seen| known.get(seen.shell) == Some(&false));
        let anything = !search.tags.is_empty();
        if anything {
            self.update(vec![search]);
        }
        anything
    }

    /// Takes in what cameras saw, each at its own time; frames that are late included.
    pub fn update(&mut self, mut cameras: Vec<CameraUpdate>) -> TrackUpdate {
        let begun = Instant::now();
        let time_ns = update::mean_time_ns(&cameras);
        let mut updates = Vec::with_capacity(self.trackers.len());
        for (s, (shell, tracker)) in self.shells.shells.iter().zip(&mut self.trackers).enumerate() {
            let mut observations = Vec::new();
            let mut places = Vec::new();
            for (c, camera) in cameras.iter().enumerate() {
                for (k, seen) in camera.tags.iter().enumerate().filter(|(_, seen)| seen.shell == s) {
                    places.push((c, k));
                    observations.push(Observation {
                        camera: camera.camera,
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
                update::reproject(s, shell, &pose, &self.rig.cameras, &mut cameras);
            }
            updates.push(update);
        }
        let slowest = |of: fn(&CameraUpdate) -> u64| cameras.iter().map(of).max().unwrap_or(0);
        TrackUpdate {
            time_ns,
            shells: updates,
            decode_ns: slowest(|camera| camera.decode_ns),
            detect_ns: slowest(|camera| camera.detect_ns),
            solve_ns: nanoseconds(begun.elapsed()),
            cameras,
        }
    }
}
