//! From what the cameras saw to the motion of each shell, each corner at its own time.

mod motions;

use std::time::Instant;

use super::admission::{Admission, Admitted, Dropped};
use super::alignment::Alignment;
use super::filter::Motion;
use super::hinge::Hinge;
use super::shell::ShellTracker;
use super::update::{self, CameraUpdate, ShellUpdate, TrackUpdate};
use super::{TrackerSettings, nanoseconds};
use crate::pose::{self, Observation, Views};
use crate::rig::Rig;
use crate::shells::ShellSet;
pub use motions::Motions;

/// Solves, filters and judges all shells.
#[derive(Debug)]
pub struct Fusion {
    rig: Rig,
    shells: ShellSet,
    settings: TrackerSettings,
    trackers: Vec<ShellTracker>,
    /// For each shell, how it hangs on its palm if it is a thumb.
    hinges: Vec<Option<Hinge>>,
    /// All shells, thumbs after their palms.
    order: Vec<usize>,
    admission: Admission,
    alignment: Alignment,
    /// The last instant that was reported: readers never go back in time.
    reported_ns: u64,
    /// Memory for the observations of one shell, and where in the updates they stand.
    observations: Vec<Observation>,
    places: Vec<(usize, usize)>,
    /// For each shell, when it was measured in this update.
    measured: Vec<Option<u64>>,
}

impl Fusion {
    /// Nothing is known yet.
    pub fn new(rig: Rig, shells: ShellSet, settings: TrackerSettings) -> Self {
        let count = shells.shells.len();
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by_key(|shell| shells.palm_of(*shell).is_some());
        Self {
            trackers: (0..count).map(|_| ShellTracker::new()).collect(),
            hinges: vec![None; count],
            order,
            admission: Admission::new(rig.cameras.len()),
            alignment: Alignment::new(rig.cameras.len()),
            reported_ns: 0,
            observations: Vec::new(),
            places: Vec::new(),
            measured: vec![None; count],
            rig,
            shells,
            settings,
        }
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
            hinges: (0..self.trackers.len())
                .map(|shell| Some((self.shells.palm_of(shell)?, self.hinges[shell].clone()?)))
                .collect(),
            horizon_ns: self.settings.horizon_ns,
        }
    }

    /// Frames that were not taken in so far.
    pub fn dropped(&self) -> Dropped {
        self.admission.dropped()
    }

    /// For each shell, the variance of its corners in units of what their covariances say; 1 if they are right.
    pub fn corner_variances(&self) -> impl Iterator<Item = f64> + '_ {
        self.trackers.iter().map(ShellTracker::variance)
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
        self.trackers.iter().map(|tracker| tracker.at(time_ns, None, &self.settings)).collect()
    }

    /// Takes in what a search of an image has found, however late it comes, of shells that nothing newer follows: those that
    /// are lost begin to move at the time of that image, those that were not where they were expected are found again.
    /// Of the others it only says whether the camera is where it should be. Whether there was anything to take in.
    pub fn found(&mut self, search: CameraUpdate) -> bool {
        let capture_ns = search.capture_ns;
        // Not judged by its time: a search takes long, and its image was already taken in by an eye.
        let mut search = [search];
        for (shell, tracker) in self.trackers.iter().enumerate() {
            if let Some(motion) = tracker.motion_at(capture_ns, &self.settings) {
                update::reproject(shell, &self.shells.shells[shell], &motion, &self.rig.cameras, &mut search);
            }
        }
        // Who is told is the next update.
        let _ = self.alignment.judge(&search[0]);
        let trackers = &self.trackers;
        let follows = |shell: usize| trackers.get(shell).is_none_or(|tracker| tracker.follows(capture_ns));
        search[0].tags.retain(|seen| !follows(seen.shell));
        if search[0].tags.is_empty() {
            return false;
        }
        for index in 0..self.order.len() {
            let shell = self.order[index];
            self.update_shell(shell, self.shells.palm_of(shell), &mut search);
        }
        true
    }

    /// Takes in what cameras saw, each at its own time; frames that are late by up to 50 ms included.
    pub fn update(&mut self, mut cameras: Vec<CameraUpdate>) -> TrackUpdate {
        let begun = Instant::now();
        for camera in &mut cameras {
            self.admit(camera);
        }
        let admitted = || cameras.iter().filter(|camera| camera.problem.is_none());
        if let Some(mean_ns) = update::mean_time_ns(admitted()) {
            self.reported_ns = self.reported_ns.max(mean_ns);
        }
        let mut updates = vec![ShellUpdate::lost(); self.trackers.len()];
        self.measured.fill(None);
        for index in 0..self.order.len() {
            let shell = self.order[index];
            let palm = self.shells.palm_of(shell);
            let at_ns = self.update_shell(shell, palm, &mut cameras);
            let (time_ns, quality) = at_ns.unzip();
            updates[shell] = self.trackers[shell].at(self.reported_ns, quality.flatten(), &self.settings);
            self.measured[shell] = quality.flatten().and(time_ns);
            if let Some(palm) = palm
                && let (Some(_), Some(time_ns)) = (self.measured[palm], self.measured[shell])
            {
                self.learn_hinge(shell, palm, time_ns);
            }
            let motion = self.trackers[shell].motion_at(self.reported_ns, &self.settings);
            if let Some(motion) = motion {
                let described = &self.shells.shells[shell];
                update::reproject(shell, described, &motion, &self.rig.cameras, &mut cameras);
            }
        }
        for camera in cameras.iter_mut().filter(|camera| camera.problem.is_none()) {
            camera.moved_px = self.alignment.judge(camera);
        }
        let slowest = |of: fn(&CameraUpdate) -> u64| cameras.iter().map(of).max().unwrap_or(0);
        TrackUpdate {
            time_ns: self.reported_ns,
            shells: updates,
            decode_ns: slowest(|camera| camera.decode_ns),
            detect_ns: slowest(|camera| camera.detect_ns),
            solve_ns: nanoseconds(begun.elapsed()),
            cameras,
        }
    }

    /// Judges a frame by its time; says in it why it is left aside.
    fn admit(&mut self, camera: &mut CameraUpdate) {
        let before = self.admission.dropped();
        match self.admission.judge(camera) {
            Admitted::Yes => {}
            Admitted::Anew => {
                self.trackers.iter_mut().for_each(|tracker| *tracker = ShellTracker::new());
                self.reported_ns = 0;
            }
            Admitted::No => {
                let now = self.admission.dropped();
                let problem = if now.duplicates > before.duplicates {
                    "this frame came twice"
                } else if now.late > before.late {
                    "this frame came more than 50 ms late"
                } else if now.clock_jumps > before.clock_jumps {
                    "its capture time is seconds away from that of the others: check the camera's clock"
                } else {
                    "the rig has no such camera"
                };
                camera.problem.get_or_insert_with(|| problem.to_owned());
            }
        }
    }

    /// Solves one shell; when it was seen, and how well if it was believed.
    fn update_shell(
        &mut self,
        shell: usize,
        palm: Option<usize>,
        cameras: &mut [CameraUpdate],
    ) -> Option<(u64, Option<super::shell::Quality>)> {
        self.collect(shell, cameras);
        let time_ns = pose::exposure_ns(&self.rig.cameras, &self.observations)?;
        let expected = palm.and_then(|palm| {
            let palm = self.trackers[palm].motion_at(time_ns, &self.settings)?;
            self.hinges[shell].as_ref()?.expected(&palm, &self.settings.filter)
        });
        let tracker = &mut self.trackers[shell];
        let views = Views {
            shell: &self.shells.shells[shell],
            cameras: &self.rig.cameras,
            observations: &self.observations,
            time_ns,
            variance: tracker.variance(),
        };
        let quality = tracker.update(&views, expected.as_ref(), &self.settings);
        for ((c, k), fate) in self.places.iter().zip(tracker.fates()) {
            cameras[*c].tags[*k].fate = *fate;
        }
        Some((time_ns, quality))
    }

    /// The observations of one shell in frames that are taken in.
    fn collect(&mut self, shell: usize, cameras: &[CameraUpdate]) {
        self.observations.clear();
        self.places.clear();
        for (c, camera) in cameras.iter().enumerate().filter(|(_, camera)| camera.problem.is_none()) {
            for (k, seen) in camera.tags.iter().enumerate().filter(|(_, seen)| seen.shell == shell) {
                self.places.push((c, k));
                self.observations.push(Observation {
                    camera: camera.camera,
                    tag: seen.tag,
                    capture_ns: camera.capture_ns,
                    corners_px: seen.detection.corners_px,
                    covariance_px2: self.settings.corner_covariance_px2(&seen.detection),
                });
            }
        }
    }

    fn learn_hinge(&mut self, thumb: usize, palm: usize, time_ns: u64) {
        let at = |shell: usize| -> Option<Motion> { self.trackers[shell].motion_at(time_ns, &self.settings) };
        let (Some(palm), Some(thumb_motion)) = (at(palm), at(thumb)) else { return };
        match &mut self.hinges[thumb] {
            Some(hinge) => hinge.learn(&palm, &thumb_motion),
            none => *none = Some(Hinge::begin(&palm, &thumb_motion)),
        }
    }
}

#[cfg(test)]
mod tests;
