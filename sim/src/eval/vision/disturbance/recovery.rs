//! How long the shells take to be measured again, and what was said of them meanwhile.

use locoman_vision::track::{TrackUpdate, Verdict};

use crate::eval::vision::error::PoseError;
use crate::eval::vision::film::{Shot, scene_s, truth_at};
use crate::operator::motion::Body;
use crate::operator::sight::Sighting;
use crate::operator::studio::Studio;

/// Nearer to the truth than this a shell has recovered.
const GOOD_M: f64 = 0.003;
const GOOD_RAD: f64 = 0.035;

/// After one disturbance.
#[derive(Debug)]
pub struct Recovery {
    from_s: f64,
    end_s: f64,
    /// For each shell, when a camera first saw a readable tag of it after the end, and when it was first measured well.
    shells: Vec<(Option<f64>, Option<f64>)>,
    seen: usize,
    tracked: usize,
    /// Largest error of a pose that was called measured, from the begin on.
    pub worst_m: f64,
}

impl Recovery {
    /// Of a disturbance from one scene time to another.
    pub fn new(from_s: f64, end_s: f64, shells: usize) -> Self {
        Self { from_s, end_s, shells: vec![(None, None); shells], seen: 0, tracked: 0, worst_m: 0.0 }
    }

    /// Looks at an update of what was seen at a moment.
    pub fn add(&mut self, studio: &Studio, shot: &Shot, update: &TrackUpdate) {
        /// Errors long after are those of the next disturbance.
        const AFTER_S: f64 = 1.0;
        if shot.time_s < self.from_s || shot.time_s > self.end_s + AFTER_S {
            return;
        }
        let truth = truth_at(studio, update.time_ns);
        let solids = studio.solids().iter().map(|solid| solid.body);
        for ((body, shell), found) in solids.zip(&mut self.shells).zip(&update.shells) {
            let is_seen = is_readable(shot, body);
            let error = PoseError::new(scene_s(update.time_ns), truth.of(body), found)
                .filter(|_| found.verdict == Verdict::Tracked);
            if let Some(error) = &error {
                self.worst_m = self.worst_m.max(error.position_m.norm());
            }
            if shot.time_s < self.end_s {
                self.seen += usize::from(is_seen);
                self.tracked += usize::from(is_seen && error.is_some());
                continue;
            }
            if is_seen {
                shell.0.get_or_insert(shot.time_s);
            }
            if error.is_some_and(|it| it.position_m.norm() < GOOD_M && it.rotation_rad.norm() < GOOD_RAD) {
                shell.1.get_or_insert(shot.time_s);
            }
        }
    }

    /// Until the last shell was measured well; no number if one never was.
    pub fn seconds(&self) -> f64 {
        let seen = self.shells.iter().filter(|(seen_s, _)| seen_s.is_some());
        seen.map(|(seen_s, good_s)| {
            let since_s = seen_s.unwrap_or(self.end_s).max(self.end_s);
            good_s.map_or(f64::INFINITY, |good_s| (good_s - since_s).max(0.0))
        })
        .fold(0.0, f64::max)
    }

    /// While it lasted: of the moments at which a camera saw a shell, the share at which it was measured.
    pub fn tracked_share(&self) -> f64 {
        self.tracked as f64 / self.seen as f64
    }
}

fn is_readable(shot: &Shot, body: Body) -> bool {
    let readable = |tags: &[Sighting]| tags.iter().any(|tag| tag.body == body && tag.is_readable());
    shot.sightings.iter().any(|(_, tags)| readable(tags))
}
