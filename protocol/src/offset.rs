//! How the clock of another machine stands to ours, from messages that go there and back.
//!
//! With times of an exchange `asked`, `returned` on our clock and `received`, `answered` on the other's, the
//! offset `other − own` lies in
//!
//! ```text
//! answered − returned  ≤  offset  ≤  received − asked
//! ```
//!
//! whatever the delays were: a message cannot arrive before it was sent. The interval is as wide as the two
//! delays together. Each exchange gives one; widened by how far the clocks may have drifted apart since, all of
//! them hold at once, and the offset is in their intersection (Marzullo's idea; NTP's minimum-delay filter is the
//! case of one best exchange). The estimate is its middle, the error bound half its width: a bound, not a
//! standard deviation.
//!
//! Once the offset has been watched for a while its drift is taken out, so that old exchanges count for longer.

use std::collections::VecDeque;

use crate::messages::ClockOffset;

/// Exchanges that are remembered: some twelve seconds at five a second.
const REMEMBERED: usize = 64;
/// Quartz clocks of two machines drift apart by less than this.
const MOST_DRIFT: f64 = 50e-6;
/// What is left once the drift has been measured: it changes with temperature.
const DRIFT_CHANGE: f64 = 5e-6;
/// The drift is measured over at least this time,
const DRIFT_SPAN_NS: u64 = 20_000_000_000;
/// at most this,
const DRIFT_MEMORY_NS: u64 = 120_000_000_000;
/// from estimates at this distance.
const DRIFT_STEP_NS: u64 = 4_000_000_000;

/// One question and its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exchange {
    /// When we asked, on our clock.
    pub asked_ns: u64,
    /// When the question came, on the other's.
    pub received_ns: u64,
    /// When the answer was sent, on the other's.
    pub answered_ns: u64,
    /// When it came back, on ours.
    pub returned_ns: u64,
}

/// What an exchange says of the offset at its time.
#[derive(Debug, Clone, Copy)]
struct Bound {
    at_ns: u64,
    low_ns: f64,
    high_ns: f64,
}

/// The offset at a time, and its error.
#[derive(Debug, Clone, Copy)]
struct Middle {
    at_ns: u64,
    offset_ns: f64,
    error_ns: f64,
}

/// Drift of the other clock against ours.
#[derive(Debug, Clone, Copy)]
struct Drift {
    rate: f64,
    error: f64,
}

/// Estimates the offset of another clock. Pure: all times come from outside.
#[derive(Debug, Clone, Default)]
pub struct OffsetEstimator {
    bounds: VecDeque<Bound>,
    history: VecDeque<Middle>,
    drift: Option<Drift>,
    exchanges: u32,
}

impl OffsetEstimator {
    /// Takes in an exchange. One that contradicts all before it says that a clock was set: they are forgotten.
    pub fn add(&mut self, exchange: &Exchange) {
        let Exchange { asked_ns, received_ns, answered_ns, returned_ns } = *exchange;
        let (low_ns, high_ns) = (difference(answered_ns, returned_ns), difference(received_ns, asked_ns));
        if returned_ns < asked_ns || answered_ns < received_ns || low_ns > high_ns {
            return;
        }
        if self.bounds.len() == REMEMBERED {
            self.bounds.pop_front();
        }
        self.bounds.push_back(Bound { at_ns: asked_ns.midpoint(returned_ns), low_ns, high_ns });
        self.exchanges = self.exchanges.saturating_add(1);
        match self.middle(returned_ns) {
            Some(middle) => self.watch_drift(middle),
            None => self.begin_anew(),
        }
    }

    /// The offset at a time on our clock; `None` before the first exchange.
    pub fn at(&self, now_ns: u64) -> Option<ClockOffset> {
        let middle = self.middle(now_ns)?;
        Some(ClockOffset {
            offset_ns: middle.offset_ns.round() as i64,
            error_ns: middle.error_ns.ceil() as u64,
            drift_ppm: self.drift.map_or(0.0, |drift| drift.rate * 1e6),
            exchanges: self.exchanges,
        })
    }

    fn begin_anew(&mut self) {
        let newest = self.bounds.pop_back();
        *self = Self { bounds: newest.into_iter().collect(), exchanges: 1, ..Self::default() };
    }

    /// The middle of the intersection; `None` if it is empty.
    fn middle(&self, now_ns: u64) -> Option<Middle> {
        let (rate, doubt) =
            self.drift.map_or((0.0, MOST_DRIFT), |drift| (drift.rate, drift.error + DRIFT_CHANGE));
        let (mut low_ns, mut high_ns) = (f64::NEG_INFINITY, f64::INFINITY);
        for bound in &self.bounds {
            let age_ns = difference(now_ns, bound.at_ns);
            let (moved_ns, wider_ns) = (rate * age_ns, doubt * age_ns.abs());
            low_ns = low_ns.max(bound.low_ns + moved_ns - wider_ns);
            high_ns = high_ns.min(bound.high_ns + moved_ns + wider_ns);
        }
        (low_ns.is_finite() && low_ns <= high_ns).then(|| Middle {
            at_ns: now_ns,
            offset_ns: low_ns.midpoint(high_ns),
            error_ns: (high_ns - low_ns) / 2.0,
        })
    }

    fn watch_drift(&mut self, newest: Middle) {
        let due = |last: &Middle| newest.at_ns.saturating_sub(last.at_ns) >= DRIFT_STEP_NS;
        if !self.history.back().is_none_or(due) {
            return;
        }
        while self.history.front().is_some_and(|old| newest.at_ns - old.at_ns > DRIFT_MEMORY_NS) {
            self.history.pop_front();
        }
        if let Some(oldest) = self.history.front().filter(|old| newest.at_ns - old.at_ns >= DRIFT_SPAN_NS) {
            let span_ns = (newest.at_ns - oldest.at_ns) as f64;
            let rate = (newest.offset_ns - oldest.offset_ns) / span_ns;
            let error = (newest.error_ns + oldest.error_ns) / span_ns;
            // Before it knows better than the general bound it is no help.
            self.drift = (error + DRIFT_CHANGE < MOST_DRIFT).then_some(Drift { rate, error });
        }
        self.history.push_back(newest);
    }
}

/// Of two times, which may be the farthest apart.
fn difference(a_ns: u64, b_ns: u64) -> f64 {
    (i128::from(a_ns) - i128::from(b_ns)) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;
    const START_NS: u64 = 1_000_000_000_000;

    /// A clock that is ahead by `offset_ns` at the start and faster by `drift_ppm`.
    #[derive(Clone, Copy)]
    struct Other {
        offset_ns: f64,
        drift_ppm: f64,
    }

    impl Other {
        fn offset_at(&self, own_ns: u64) -> f64 {
            self.offset_ns + self.drift_ppm * 1e-6 * difference(own_ns, START_NS)
        }

        fn reads(&self, own_ns: u64) -> u64 {
            own_ns.saturating_add_signed(self.offset_at(own_ns).round() as i64)
        }

        fn exchange(&self, asked_ns: u64, there_ns: u64, back_ns: u64) -> Exchange {
            let arrived = asked_ns + there_ns;
            Exchange {
                asked_ns,
                received_ns: self.reads(arrived),
                answered_ns: self.reads(arrived + 20_000),
                returned_ns: arrived + 20_000 + back_ns,
            }
        }
    }

    #[test]
    fn nothing_is_known_before_the_first_exchange() {
        assert_eq!(OffsetEstimator::default().at(START_NS), None);
    }

    #[test]
    fn a_drifting_clock_is_followed_and_its_drift_told() {
        let other = Other { offset_ns: -5e11, drift_ppm: 18.0 };
        let mut sut = OffsetEstimator::default();
        for k in 0..600 {
            let delay_ns = 100_000 + (k * 7919) % 400_000;
            sut.add(&other.exchange(START_NS + k * 200 * MS, delay_ns, 500_000 - delay_ns + 100_000));
        }
        let now_ns = START_NS + 120_000 * MS;
        let estimate = sut.at(now_ns).unwrap();
        assert!((estimate.drift_ppm - 18.0).abs() < 8.0, "{estimate:?}");
        let error_ns = (estimate.offset_ns as f64 - other.offset_at(now_ns)).abs();
        assert!(error_ns < 100_000.0, "{error_ns} {estimate:?}");
    }

    #[test]
    fn a_clock_that_was_set_is_believed_at_once() {
        let (before, after) =
            (Other { offset_ns: 5e9, drift_ppm: 0.0 }, Other { offset_ns: -2e9, drift_ppm: 0.0 });
        let mut sut = OffsetEstimator::default();
        for k in 0..20 {
            sut.add(&before.exchange(START_NS + k * 200 * MS, 100_000, 100_000));
        }
        sut.add(&after.exchange(START_NS + 5000 * MS, 100_000, 100_000));
        let estimate = sut.at(START_NS + 5001 * MS).unwrap();
        assert_eq!((estimate.exchanges, estimate.offset_ns), (1, -2_000_000_000));
    }

    #[test]
    fn times_that_cannot_be_are_left_out() {
        let mut sut = OffsetEstimator::default();
        let good = Other { offset_ns: 0.0, drift_ppm: 0.0 }.exchange(START_NS, 100_000, 100_000);
        sut.add(&Exchange { returned_ns: good.asked_ns - 1, ..good });
        sut.add(&Exchange { answered_ns: good.received_ns - 1, ..good });
        sut.add(&Exchange { answered_ns: u64::MAX, ..good });
        assert_eq!(sut.at(START_NS), None);
    }

    proptest! {
        #[test]
        fn the_true_offset_is_always_within_the_bound(
            offset_ns in -1e13..1e13f64, drift_ppm in -40.0..40.0f64,
            delays in prop::collection::vec((0..3_000_000u64, 0..3_000_000u64), 1..300),
        ) {
            // The other clock cannot count below 0.
            let other = Other { offset_ns: offset_ns.max(-0.9e12), drift_ppm };
            let mut sut = OffsetEstimator::default();
            for (k, (there_ns, back_ns)) in delays.into_iter().enumerate() {
                let asked_ns = START_NS + k as u64 * 200 * MS;
                sut.add(&other.exchange(asked_ns, there_ns, back_ns));
                let later_ns = asked_ns + 150 * MS;
                let estimate = sut.at(later_ns).unwrap();
                let error_ns = (estimate.offset_ns as f64 - other.offset_at(later_ns)).abs();
                // Clocks count whole nanoseconds.
                prop_assert!(error_ns <= estimate.error_ns as f64 + 2.0, "{} {:?}", error_ns, estimate);
            }
        }
    }
}
