//! Wrong poses that were called measured, over everything that was tracked.

use super::tally::Tally;
use crate::eval::{Figure, Must, Report};

/// A count.
#[derive(Debug, Clone, Copy, Default)]
pub struct Ledger {
    /// Instants times shells.
    instants: usize,
    /// Poses that were called measured.
    tracked: usize,
    /// Those of them that are off by more than 10 mm and five standard deviations.
    wrong: usize,
}

impl Ledger {
    /// Enters a film.
    pub fn add(&mut self, tally: &Tally) {
        self.instants += tally.instants();
        self.tracked += tally.shells.iter().map(|shell| shell.errors.len()).sum::<usize>();
        self.wrong += tally.wrong();
    }

    /// Adds the figures.
    pub fn report(&self, report: &mut Report) {
        report.push(Figure::new("wrong.instants_by_shells", self.instants as f64, ""));
        report.push(Figure::new("wrong.called_tracked", self.tracked as f64, ""));
        report.push(Figure::new("wrong.poses_called_tracked", self.wrong as f64, "").must(Must::AtMost(0.0)));
    }
}
