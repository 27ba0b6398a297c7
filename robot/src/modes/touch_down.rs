//! A foot that goes down until it feels the ground.
//!
//! The foot's own force tells; when it rises the way is at its end. Should its sensor be dumb, the other feet
//! feel the ground: they lose what that foot carries. Then it goes no deeper, so that it does not push the
//! robot over, and says that it found none.

use super::{foot_path::Descent, scene::Scene};
use crate::{
    joints::Leg,
    wbc::{ContactSet, PointReference},
};

/// Samples in a row that must feel the ground.
const TOUCH_SAMPLES: u32 = 4;
/// What the other feet may lose before the foot goes down more slowly, and what lets it turn back, N. [E] Above
/// what a foot's own sensor feels first, even one that shows half; below what would lift the foot opposite, 28.
const RELIEF_N: (f64, f64) = (14.0, 20.0);
/// Cut-off of the low-pass filter of what the other feet carry, rad/s. [E] 10 Hz
const CUTOFF_RAD_S: f64 = 63.0;
/// Pace on the ground.
const RESTING_PACE: f64 = 0.1;
/// A foot that makes no such progress, s along its way, for so long finds no ground, s. [E] 2.5 mm: half of what
/// it goes at the pace on the ground.
const PROGRESS_S: f64 = 0.05;
const PATIENCE_S: f64 = 1.0;

/// What a foot feels on its way down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Felt {
    /// Nothing so far.
    Nothing,
    /// The ground.
    Ground,
    /// It goes no deeper, and has felt nothing.
    NoGround,
}

/// A foot on its way down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchDown {
    descent: Descent,
    /// Time along the descent, s.
    at_s: f64,
    /// How far it was when it last made progress, s along the descent, and the time since.
    deepest_s: f64,
    stuck_s: f64,
    /// The greatest pace; small once the other feet have felt something.
    greatest_pace: f64,
    touching: u32,
    /// What the other feet carried at the beginning and carry now, N.
    carried: Option<(f64, f64)>,
}

impl TouchDown {
    /// At the beginning of a descent.
    pub fn new(descent: Descent) -> Self {
        Self {
            descent,
            at_s: 0.0,
            deepest_s: 0.0,
            stuck_s: 0.0,
            greatest_pace: 1.0,
            touching: 0,
            carried: None,
        }
    }

    /// One step: where the foot should be, and what it feels. `touch_n` is the force of a foot that stands.
    pub fn step(&mut self, scene: &Scene<'_>, leg: Leg, touch_n: f64) -> (PointReference, Felt) {
        let felt = scene.foot_force[leg.index()] > touch_n;
        self.touching = if felt { self.touching + 1 } else { 0 };

        let pace = self.pace(scene, leg);
        self.at_s = (self.at_s + pace * scene.dt_s).clamp(0.0, self.descent.duration_s());
        self.stuck_s += scene.dt_s;
        if self.at_s > self.deepest_s + PROGRESS_S {
            (self.deepest_s, self.stuck_s) = (self.at_s, 0.0);
        }

        let mut foot = self.descent.sample(self.at_s);
        foot.velocity *= pace;
        foot.acceleration *= pace * pace;
        let felt = if self.touching >= TOUCH_SAMPLES {
            Felt::Ground
        } else if self.at_s >= self.descent.duration_s() || self.stuck_s > PATIENCE_S {
            Felt::NoGround
        } else {
            Felt::Nothing
        };
        (foot, felt)
    }

    /// From 1, down, over 0, halt, to -1, up again: by what the other feet have lost. From the first halt on it
    /// is a tenth of that, so that the foot rests on what it has met in place of knocking at it.
    fn pace(&mut self, scene: &Scene<'_>, leg: Leg) -> f64 {
        let now: f64 = ContactSet::without(leg).legs().map(|other| scene.foot_force[other.index()]).sum();
        let (begin, carried) = self.carried.unwrap_or((now, now));
        let share = (scene.dt_s * CUTOFF_RAD_S).min(1.0);
        let carried = carried + (now - carried) * share;
        // The first moments, before the foot is down, say what the others carry without it.
        let begin = if self.at_s < 0.1 { carried } else { begin };
        self.carried = Some((begin, carried));
        let (slower, back) = RELIEF_N;
        let held = 0.5 * (slower + back);
        let pace = 1.0 - (begin - carried - slower) / (held - slower);
        if pace < 0.0 {
            self.greatest_pace = RESTING_PACE;
        }
        pace.clamp(-self.greatest_pace, self.greatest_pace)
    }
}
