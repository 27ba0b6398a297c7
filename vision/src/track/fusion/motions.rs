//! What an eye has to know: where each shell is going to be.

use crate::track::TrackerSettings;
use crate::track::filter::Motion;
use crate::track::hinge::Hinge;

/// How each shell moved when it was last measured, in the order of the shells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Motions {
    pub(super) motions: Vec<Option<Motion>>,
    /// For each thumb, its palm and how it hangs on it.
    pub(super) hinges: Vec<Option<(usize, Hinge)>>,
    pub(super) horizon_ns: u64,
}

impl Motions {
    /// Motions that were described elsewhere, in the order of the shells; they may be trusted for `horizon_ns`
    /// after their time. `hinges` has, for each thumb of which it was learned, its palm and how it hangs on it.
    pub fn new(motions: Vec<Option<Motion>>, hinges: Vec<Option<(usize, Hinge)>>, horizon_ns: u64) -> Self {
        Self { motions, hinges, horizon_ns }
    }

    /// Each as of its last measurement.
    pub fn latest(&self) -> &[Option<Motion>] {
        &self.motions
    }

    /// For each shell, its palm and how it hangs on it, if it is a thumb and this was learned.
    pub fn hinges(&self) -> &[Option<(usize, Hinge)>] {
        &self.hinges
    }

    /// For how long after its measurement a motion may be trusted.
    pub fn horizon_ns(&self) -> u64 {
        self.horizon_ns
    }

    /// Which shells are not lost.
    pub fn known_at(&self, time_ns: u64) -> Vec<bool> {
        let known = |motion: &Option<Motion>| motion.as_ref().is_some_and(|m| self.is_recent(m, time_ns));
        self.motions.iter().map(known).collect()
    }

    /// The motion of each shell at an instant; `None` for those that are lost.
    pub fn at(&self, time_ns: u64, settings: &TrackerSettings) -> Vec<Option<Motion>> {
        self.motions.iter().map(|motion| self.one_at(motion, time_ns, settings)).collect()
    }

    fn one_at(&self, motion: &Option<Motion>, time_ns: u64, settings: &TrackerSettings) -> Option<Motion> {
        let motion = motion.as_ref().filter(|motion| self.is_recent(motion, time_ns))?;
        Some(motion.predicted(time_ns, &settings.filter))
    }

    /// As [`Motions::at`], but a thumb that is lost is expected where its palm and what was learned of the two
    /// say; its covariance says how wide to search.
    pub fn expected_at(&self, time_ns: u64, settings: &TrackerSettings) -> Vec<Option<Motion>> {
        let mut motions = Vec::new();
        self.expect_at(time_ns, settings, &mut motions);
        motions
    }

    /// [`Motions::expected_at`] in memory that is there already.
    pub fn expect_at(&self, time_ns: u64, settings: &TrackerSettings, motions: &mut Vec<Option<Motion>>) {
        motions.clear();
        motions.extend(self.motions.iter().map(|motion| self.one_at(motion, time_ns, settings)));
        for (shell, hinge) in self.hinges.iter().enumerate() {
            let Some((palm, hinge)) = hinge else { continue };
            if motions.get(shell).is_some_and(Option::is_none)
                && let Some(Some(palm)) = motions.get(*palm)
            {
                motions[shell] = hinge.expected(palm, &settings.filter);
            }
        }
    }

    /// Whether all shells are lost.
    pub fn nothing_known_at(&self, time_ns: u64) -> bool {
        self.motions.iter().flatten().all(|motion| !self.is_recent(motion, time_ns))
    }

    fn is_recent(&self, motion: &Motion, time_ns: u64) -> bool {
        time_ns.abs_diff(motion.time_ns) <= self.horizon_ns
    }
}
