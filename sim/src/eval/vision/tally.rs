//! A tracker's updates beside the truth, shell by shell.

use locoman_vision::shells::{Shell, ShellSet};
use locoman_vision::track::{ShellUpdate, TrackUpdate, Verdict};

use super::error::PoseError;
use super::film::{Shot, scene_s, truth_at};
use crate::eval::statistics::{mean, rms};
use crate::operator::motion::{Body, Posture};
use crate::operator::sight::Sighting;
use crate::operator::studio::Studio;

/// What one tracker made of a film.
#[derive(Debug, Clone)]
pub struct Tally {
    /// In the order of the shells file.
    pub shells: Vec<ShellTally>,
}

/// One shell.
#[derive(Debug, Clone)]
pub struct ShellTally {
    /// Its name.
    pub name: String,
    /// Who wears it.
    pub body: Option<Body>,
    /// Instants.
    pub instants: usize,
    /// Those in which at least two cameras had a readable tag of it before them.
    pub seen: usize,
    /// Those of them in which its pose was measured.
    pub solved: usize,
    /// Poses that were called measured and are wrong: see [`PoseError::is_wrong`].
    pub wrong: usize,
    /// Error of every measured pose.
    pub errors: Vec<PoseError>,
}

impl Tally {
    /// Nothing compared yet.
    pub fn new(shells: &ShellSet) -> Self {
        let tally = |shell: &Shell| ShellTally {
            name: shell.name.clone(),
            body: Body::from_name(&shell.name),
            instants: 0,
            seen: 0,
            solved: 0,
            wrong: 0,
            errors: Vec::new(),
        };
        Self { shells: shells.shells.iter().map(tally).collect() }
    }

    /// Compares an update with the truth at the update's own time.
    pub fn add(&mut self, studio: &Studio, shot: &Shot, update: &TrackUpdate) {
        let (time_s, truth) = (scene_s(update.time_ns), truth_at(studio, update.time_ns));
        for (shell, update) in self.shells.iter_mut().zip(&update.shells) {
            shell.add(time_s, &truth, shot, update);
        }
    }

    /// Instants times shells.
    pub fn instants(&self) -> usize {
        self.shells.iter().map(|shell| shell.instants).sum()
    }

    /// Wrong poses of all shells.
    pub fn wrong(&self) -> usize {
        self.shells.iter().map(|shell| shell.wrong).sum()
    }
}

impl ShellTally {
    fn add(&mut self, time_s: f64, truth: &Posture, shot: &Shot, update: &ShellUpdate) {
        let Some(body) = self.body else { return };
        let readable =
            |sightings: &[Sighting]| sightings.iter().any(|tag| tag.body == body && tag.is_readable());
        let seen = shot.sightings.iter().filter(|(_, sightings)| readable(sightings)).count() >= 2;
        self.instants += 1;
        self.seen += usize::from(seen);
        if update.verdict != Verdict::Tracked {
            return;
        }
        self.solved += usize::from(seen);
        if let Some(error) = PoseError::new(time_s, truth.of(body), update) {
            self.wrong += usize::from(error.is_wrong());
            self.errors.push(error);
        }
    }

    /// Position error, RMS of the distance.
    pub fn position_rms_mm(&self) -> f64 {
        1e3 * rms(&self.each(|error| error.position_m.norm()))
    }

    /// Largest distance from the truth.
    pub fn position_worst_mm(&self) -> f64 {
        1e3 * self.errors.iter().map(|error| error.position_m.norm()).fold(f64::NAN, f64::max)
    }

    /// Rotation error, RMS of the angle.
    pub fn rotation_rms_deg(&self) -> f64 {
        rms(&self.each(|error| error.rotation_rad.norm())).to_degrees()
    }

    /// Share of the seen instants that were solved.
    pub fn solved_share(&self) -> f64 {
        self.solved as f64 / self.seen as f64
    }

    /// Share of all instants in which two cameras see it.
    pub fn seen_share(&self) -> f64 {
        self.seen as f64 / self.instants as f64
    }

    /// Mean of the errors squared by the tracker's covariance, per degree of freedom.
    pub fn normalized_error(&self) -> f64 {
        mean(&self.each(PoseError::normalized))
    }

    fn each(&self, of: impl Fn(&PoseError) -> f64) -> Vec<f64> {
        self.errors.iter().map(of).collect()
    }
}
