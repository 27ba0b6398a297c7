//! The tracker's updates beside the truth.

use std::time::Instant as Clock;

use locoman_vision::camera::Camera;
use locoman_vision::shells::{Shell, ShellSet};
use locoman_vision::track::{SeenTag, ShellUpdate, TrackUpdate, Tracker, Verdict};
use nalgebra::{Isometry3, Vector6};

use super::passage::{Instant, Passage};
use crate::eval::statistics::rms;
use crate::operator::motion::Body;
use crate::operator::sight::Sighting;

/// An accepted tag whose corners lie farther than this from where the truth projects them is a false one:
/// far beyond noise (0.1 px) and motion blur (1 px), well below the size of any tag.
const FALSE_TAG_PX: f64 = 4.0;

/// From this size on a corner's noise hardly depends on the size.
const LARGE_TAG_PX: f64 = 30.0;

/// Everything measured, over all passages.
#[derive(Debug)]
pub struct Outcome {
    /// In the order of the shells file.
    pub shells: Vec<ShellOutcome>,
    /// Tags that a pose rests on and that are not where they were found.
    pub false_accepted: usize,
    readable: usize,
    read: usize,
    large_corner_errors_px: Vec<f64>,
    small_corner_errors_px: Vec<f64>,
    update_s: Vec<f64>,
}

/// One shell.
#[derive(Debug)]
pub struct ShellOutcome {
    /// Its name.
    pub name: String,
    body: Option<Body>,
    /// Instants.
    pub instants: usize,
    /// Those in which at least two cameras have a readable tag of it before them.
    pub seen: usize,
    /// Those of them in which its pose was measured.
    pub solved: usize,
    /// Error of every measured pose.
    pub errors: Vec<PoseError>,
}

/// The error of one measured pose.
#[derive(Debug, Clone, Copy)]
pub struct PoseError {
    /// Scene time.
    pub time_s: f64,
    /// Distance from the truth.
    pub position_m: f64,
    /// Angle from the truth.
    pub rotation_rad: f64,
    /// Squared error by the tracker's own covariance, per degree of freedom: 1 on average if it is honest.
    pub normalized: f64,
}

impl Outcome {
    /// Nothing measured yet.
    pub fn new(shells: &ShellSet) -> Self {
        let outcome = |shell: &Shell| ShellOutcome {
            name: shell.name.clone(),
            body: Body::from_name(&shell.name),
            instants: 0,
            seen: 0,
            solved: 0,
            errors: Vec::new(),
        };
        Self {
            shells: shells.shells.iter().map(outcome).collect(),
            false_accepted: 0,
            readable: 0,
            read: 0,
            large_corner_errors_px: Vec::new(),
            small_corner_errors_px: Vec::new(),
            update_s: Vec::new(),
        }
    }

    /// Tracks a passage and compares.
    pub fn track(&mut self, tracker: &mut Tracker, passage: Passage) {
        for instant in passage.0 {
            let begun = Clock::now();
            let update = tracker.update(&instant.frames);
            self.update_s.push(begun.elapsed().as_secs_f64());
            for (shell, update) in self.shells.iter_mut().zip(&update.shells) {
                shell.compare(&instant, update);
            }
            self.compare_tags(&instant, &update, tracker);
        }
    }

    fn compare_tags(&mut self, instant: &Instant, update: &TrackUpdate, tracker: &Tracker) {
        let views = tracker.rig().cameras.iter().enumerate().zip(&instant.sightings);
        for ((index, camera), sightings) in views {
            let Some(update) = update.camera(index) else { continue };
            for seen in update.tags.iter().filter(|seen| seen.is_used()) {
                let error_px = self.worst_corner_px(instant, camera, seen, tracker.shells());
                self.false_accepted += usize::from(error_px > FALSE_TAG_PX);
            }
            for truth in sightings.iter().filter(|truth| truth.is_readable()) {
                self.readable += 1;
                if let Some(seen) = update.tags.iter().find(|seen| seen.detection.id == truth.id) {
                    self.read += 1;
                    let errors_px = if truth.side_px >= LARGE_TAG_PX {
                        &mut self.large_corner_errors_px
                    } else {
                        &mut self.small_corner_errors_px
                    };
                    for (a, b) in seen.detection.corners_px.iter().zip(&truth.corners_px) {
                        errors_px.extend((a - b).iter());
                    }
                }
            }
        }
    }

    fn worst_corner_px(&self, instant: &Instant, camera: &Camera, seen: &SeenTag, shells: &ShellSet) -> f64 {
        let body = self.shells.get(seen.shell).and_then(|shell| shell.body);
        let tag = shells.shells.get(seen.shell).and_then(|shell| shell.tags.get(seen.tag));
        let (Some(body), Some(tag)) = (body, tag) else { return f64::INFINITY };
        let camera_from_shell = camera.world_from_camera.inverse() * instant.truth.of(body);
        tag.corners()
            .iter()
            .zip(&seen.detection.corners_px)
            .map(|(corner, found)| {
                camera
                    .project(&(camera_from_shell * corner))
                    .map_or(f64::INFINITY, |truth| (truth - found).norm())
            })
            .fold(0.0, f64::max)
    }

    /// Readable tags that were read, whether or not a pose rests on them.
    pub fn read_share(&self) -> f64 {
        self.read as f64 / self.readable as f64
    }

    /// Error of the corners of readable tags per axis: with sides of at least 30 pixels, and of 16 to 30.
    pub fn corner_rms_px(&self) -> (f64, f64) {
        (rms(&self.large_corner_errors_px), rms(&self.small_corner_errors_px))
    }

    /// Instants that the tracker can take in each second, decoding included.
    pub fn updates_per_s(&self) -> f64 {
        self.update_s.len() as f64 / self.update_s.iter().sum::<f64>()
    }
}

impl ShellOutcome {
    fn compare(&mut self, instant: &Instant, update: &ShellUpdate) {
        let Some(body) = self.body else { return };
        let readable =
            |sightings: &&Vec<Sighting>| sightings.iter().any(|tag| tag.body == body && tag.is_readable());
        let seen = instant.sightings.iter().filter(readable).count() >= 2;
        self.instants += 1;
        self.seen += usize::from(seen);
        if let (Verdict::Tracked, Some(found)) = (update.verdict, &update.world_from_shell) {
            self.solved += usize::from(seen);
            self.errors.push(PoseError::new(instant.time_s, instant.truth.of(body), found, update));
        }
    }

    /// Position error, RMS of the distance.
    pub fn position_rms_mm(&self) -> f64 {
        1e3 * rms(&self.each(|error| error.position_m))
    }

    /// Largest distance from the truth.
    pub fn position_worst_mm(&self) -> f64 {
        1e3 * self.errors.iter().map(|error| error.position_m).fold(f64::NAN, f64::max)
    }

    /// Rotation error, RMS of the angle.
    pub fn rotation_rms_deg(&self) -> f64 {
        rms(&self.each(|error| error.rotation_rad)).to_degrees()
    }

    /// Share of the seen instants that were solved.
    pub fn solved_share(&self) -> f64 {
        self.solved as f64 / self.seen as f64
    }

    /// Share of all instants in which two cameras see it.
    pub fn seen_share(&self) -> f64 {
        self.seen as f64 / self.instants as f64
    }

    /// Mean of the errors squared by the tracker's covariance.
    pub fn normalized_error(&self) -> f64 {
        self.errors.iter().map(|error| error.normalized).sum::<f64>() / self.errors.len() as f64
    }

    fn each(&self, of: impl Fn(&PoseError) -> f64) -> Vec<f64> {
        self.errors.iter().map(of).collect()
    }
}

impl PoseError {
    fn new(time_s: f64, truth: &Isometry3<f64>, found: &Isometry3<f64>, update: &ShellUpdate) -> Self {
        // As the covariance has it: position in world axes, rotation in the shell's.
        let position = truth.translation.vector - found.translation.vector;
        let rotation = (found.rotation.inverse() * truth.rotation).scaled_axis();
        let mut error = Vector6::zeros();
        error.fixed_rows_mut::<3>(0).copy_from(&position);
        error.fixed_rows_mut::<3>(3).copy_from(&rotation);
        let normalized = update
            .covariance
            .cholesky()
            .map_or(f64::NAN, |covariance| error.dot(&covariance.solve(&error)) / 6.0);
        Self { time_s, position_m: position.norm(), rotation_rad: rotation.norm(), normalized }
    }
}
