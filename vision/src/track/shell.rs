//! The life of one shell: found, followed, predicted, lost, found again.
//!
//! The last measurements are kept with the motion after each. A frame that comes late is taken in at its own
//! time, between those that came before and after it, and the later ones are taken in again: what is known of
//! now never goes back in time.

use std::collections::VecDeque;

use super::TrackerSettings;
use super::filter::{Evidence, Judgement, Motion};
use super::update::{ShellUpdate, Verdict};
use crate::pose::{Fate, Refusal, Solution, Solver, Views};

/// Measurements that are kept for those that come late: at 240 a second, 0.1 s.
const KEPT: usize = 24;

/// What is known of one shell.
#[derive(Debug)]
pub(super) struct ShellTracker {
    solver: Solver,
    /// The newest last.
    history: VecDeque<Measured>,
    /// What began where the motion could not have led to, and how often it was confirmed.
    rival: Option<(Motion, u32)>,
    /// Variance of the corners in units of what their covariances say, as the residuals show it.
    variance: f64,
}

/// The motion after a measurement.
#[derive(Debug)]
struct Measured {
    motion: Motion,
    /// What the measurement said; `None` where it was the first.
    evidence: Option<Evidence>,
}

/// Numbers about a measurement that was believed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quality {
    rms_px: f64,
    tags: usize,
    cameras: usize,
}

impl ShellTracker {
    /// Nothing is known.
    pub fn new() -> Self {
        Self {
            solver: Solver::default(),
            history: VecDeque::with_capacity(KEPT + 1),
            rival: None,
            variance: 1.0,
        }
    }

    /// The motion as of the last measurement.
    pub fn motion(&self) -> Option<&Motion> {
        self.history.back().map(|last| &last.motion)
    }

    /// Whether it was measured at an instant or since.
    pub fn follows(&self, time_ns: u64) -> bool {
        /// A measurement is as old as the rows that it rests on: half of a slow shutter's, and half of the time between two
        /// frames of cameras out of step.
        const ABOUT_NS: u64 = 20_000_000;
        self.motion().is_some_and(|motion| motion.time_ns + ABOUT_NS >= time_ns)
    }

    /// The motion at an instant, if the last measurement is recent enough.
    pub fn motion_at(&self, time_ns: u64, settings: &TrackerSettings) -> Option<Motion> {
        recent(self.motion()?, time_ns, settings)
    }

    /// What is known at an instant; `quality` if it was measured just now.
    pub fn at(&self, time_ns: u64, quality: Option<Quality>, settings: &TrackerSettings) -> ShellUpdate {
        let Some(motion) = self.motion_at(time_ns, settings) else { return ShellUpdate::lost() };
        let Quality { rms_px, tags, cameras } =
            quality.unwrap_or(Quality { rms_px: 0.0, tags: 0, cameras: 0 });
        ShellUpdate {
            verdict: if quality.is_some() { Verdict::Tracked } else { Verdict::Predicted },
            world_from_shell: Some(motion.world_from_shell),
            covariance: motion.pose_covariance(),
            velocity_m_s: motion.velocity_m_s,
            rate_rad_s: motion.rate_rad_s,
            rms_px,
            tags,
            cameras,
        }
    }

    /// What became of each observation of the last update.
    pub fn fates(&self) -> &[Fate] {
        self.solver.fates()
    }

    /// Variance of the corners in units of what their covariances say.
    pub fn variance(&self) -> f64 {
        self.variance
    }

    /// Takes in what was seen about an instant; `expected` is where another shell says that this one is.
    pub fn update(
        &mut self,
        views: &Views<'_>,
        expected: Option<&Motion>,
        settings: &TrackerSettings,
    ) -> Option<Quality> {
        let earlier = self.history.iter().rposition(|known| known.motion.time_ns <= views.time_ns);
        if earlier.is_none() && !self.history.is_empty() {
            // Older than all that is remembered.
            self.solver.leave(views);
            return None;
        }
        let base = earlier.map(|index| self.history[index].motion.clone());
        let own = base.as_ref().and_then(|base| recent(base, views.time_ns, settings));
        let solution = self.solve(views, own.as_ref().or(expected), settings)?;
        let evidence = Evidence::of(views.time_ns, &solution);
        let believed = match (&own, &base) {
            (Some(own), Some(base)) => {
                let loose = base.loosened(&settings.filter);
                follow(own, &evidence, settings).or_else(|| {
                    follow(&loose.predicted(views.time_ns, &settings.filter), &evidence, settings)
                })
            }
            _ => {
                self.begin(begun(views.time_ns, &solution));
                return Some(self.believed(&solution));
            }
        };
        match believed {
            Some(motion) => {
                self.rival = None;
                self.insert(earlier.map_or(0, |index| index + 1), motion, evidence, settings);
                Some(self.believed(&solution))
            }
            None if self.confirms_rival(views.time_ns, &solution, &evidence, settings) => {
                Some(self.believed(&solution))
            }
            None => {
                self.solver.refuse();
                None
            }
        }
    }

    /// Near what is expected, and if that contradicts what is seen, without it.
    fn solve(
        &mut self,
        views: &Views<'_>,
        expected: Option<&Motion>,
        settings: &TrackerSettings,
    ) -> Option<Solution> {
        let fine = |solution: &Solution| solution.rms_px <= settings.max_rms_px;
        if let Some(prior) = expected.and_then(Motion::prior) {
            match self.solver.near(views, &prior, &settings.solver) {
                Ok(solution) if fine(&solution) => return Some(solution),
                Err(Refusal::Ambiguous | Refusal::NothingSeen) => return None,
                Ok(_) | Err(Refusal::NothingAgrees) => {}
            }
        }
        let solution = self.solver.afresh(views, &settings.solver).ok()?;
        if fine(&solution) {
            return Some(solution);
        }
        self.solver.refuse();
        None
    }

    fn begin(&mut self, motion: Motion) {
        self.history.clear();
        self.history.push_back(Measured { motion, evidence: None });
        self.rival = None;
    }

    /// Puts a measurement in its place and takes in again what is newer.
    fn insert(&mut self, at: usize, motion: Motion, evidence: Evidence, settings: &TrackerSettings) {
        self.history.insert(at, Measured { motion, evidence: Some(evidence) });
        for later in at + 1..self.history.len() {
            let time_ns = self.history[later].motion.time_ns;
            let mut motion = self.history[later - 1].motion.predicted(time_ns, &settings.filter);
            if let Some(evidence) = &self.history[later].evidence {
                motion.correct(evidence, &settings.filter);
            }
            self.history[later].motion = motion;
        }
        if self.history.len() > KEPT {
            self.history.pop_front();
        }
    }

    /// Whether a measurement that the motion cannot have led to is now believed instead of the motion: when
    /// several in a row agree with each other, each resting on two tags or more.
    fn confirms_rival(
        &mut self,
        time_ns: u64,
        solution: &Solution,
        evidence: &Evidence,
        settings: &TrackerSettings,
    ) -> bool {
        /// A single tag may be mirrored, or one of two that somebody else wears.
        const LEAST_TAGS: usize = 2;
        if solution.tags < LEAST_TAGS {
            return false;
        }
        let confirmed = self.rival.take().and_then(|(rival, times)| {
            let there = recent(&rival.loosened(&settings.filter), time_ns, settings)?;
            follow(&there, evidence, settings).map(|motion| (motion, times + 1))
        });
        let (motion, times) = confirmed.unwrap_or_else(|| (begun(time_ns, solution), 1));
        if times < settings.jumps_to_restart {
            self.rival = Some((motion, times));
            return false;
        }
        self.begin(motion);
        true
    }

    /// Notes how large the residuals are.
    fn believed(&mut self, solution: &Solution) -> Quality {
        /// What one measurement of very many degrees of freedom changes in the logarithm of the variance,
        /// and how many are half of very many.
        const GAIN: f64 = 0.03;
        const MANY: f64 = 50.0;
        const MOST: f64 = 3.0;
        const BOUNDS: (f64, f64) = (0.5, 400.0);
        let share = solution.freedom / (solution.freedom + MANY);
        let change = GAIN * share * (solution.excess.min(MOST) - 1.0);
        self.variance = (self.variance * change.exp()).clamp(BOUNDS.0, BOUNDS.1);
        Quality { rms_px: solution.rms_px, tags: solution.tags, cameras: solution.cameras }
    }
}

fn recent(motion: &Motion, time_ns: u64, settings: &TrackerSettings) -> Option<Motion> {
    let recent = time_ns.abs_diff(motion.time_ns) <= settings.horizon_ns;
    recent.then(|| motion.predicted(time_ns, &settings.filter))
}

/// The motion after evidence; `None` if it jumps.
fn follow(motion: &Motion, evidence: &Evidence, settings: &TrackerSettings) -> Option<Motion> {
    let mut motion = motion.clone();
    (motion.correct(evidence, &settings.filter) == Judgement::Accepted).then_some(motion)
}

fn begun(time_ns: u64, solution: &Solution) -> Motion {
    Motion::begin(time_ns, &solution.state, &solution.covariance)
}
