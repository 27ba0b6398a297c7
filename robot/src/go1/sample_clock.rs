//! When a state was sampled, on our clock: the board's milliseconds, shifted by what the fastest datagrams show.
//!
//! Datagrams are late by different times; the board's own clock is even. The shift is the least of `arrival - tick`,
//! so a state that was held up still says when it was measured. The two clocks drift apart: the least is let go by
//! [`DRIFT`], so that a shift which has become too small is left behind.

/// How fast the shift may grow, s/s: more than two quartz clocks drift apart.
const DRIFT: f64 = 5e-4;
/// An arrival that is off by so much shows another clock, ns: the board has begun anew.
const ANOTHER_CLOCK_NS: i64 = 1_000_000_000;

/// The shift between the board's clock and ours.
#[derive(Debug, Clone, Copy, Default)]
pub struct SampleClock {
    /// Our time at the board's zero, and the tick at which it was last corrected.
    shift: Option<(i64, u32)>,
}

impl SampleClock {
    /// Time of a sample, ns of our monotonic clock: never later than its arrival.
    pub fn time_ns(&mut self, tick_ms: u32, arrival_ns: u64) -> u64 {
        let arrival = i64::try_from(arrival_ns).unwrap_or(i64::MAX);
        let board = i64::from(tick_ms) * 1_000_000;
        let seen = arrival - board;
        let shift = match self.shift {
            Some((shift, last_ms)) if (seen - shift).abs() < ANOTHER_CLOCK_NS => {
                let passed_ns = f64::from(tick_ms.saturating_sub(last_ms)) * 1e6;
                seen.min(shift + (DRIFT * passed_ns) as i64)
            }
            _ => seen,
        };
        self.shift = Some((shift, tick_ms));
        u64::try_from(board + shift).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_stand_as_far_apart_as_the_board_says_however_late_they_come() {
        let mut sut = SampleClock::default();
        let late_us = [300_u64, 900, 4_900, 310, 2_500, 350];
        let times: Vec<u64> = (0..60_u32)
            .map(|k| {
                let arrival = 7_000_000_000 + u64::from(k) * 2_000_000 + late_us[k as usize % 6] * 1000;
                sut.time_ns(500 + 2 * k, arrival)
            })
            .collect();
        for pair in times[1..].windows(2) {
            let step = pair[1] - pair[0];
            assert!(step.abs_diff(2_000_000) < 20_000, "{step} ns");
        }
    }

    #[test]
    fn a_board_that_begins_anew_has_another_clock() {
        let mut sut = SampleClock::default();
        sut.time_ns(1_000_000, 5_000_000_000_000);
        assert_eq!(sut.time_ns(1, 5_001_000_000_000), 5_001_000_000_000);
        assert_eq!(sut.time_ns(2, 5_001_001_000_000), 5_001_001_000_000);
    }

    #[test]
    fn clocks_that_drift_apart_are_followed() {
        let mut sut = SampleClock::default();
        let mut last = 0;
        for k in 0..100_000_u32 {
            // 100 millionths slow.
            let arrival = 1_000_000_000 + (f64::from(k) * 1e6 * 1.0001) as u64;
            last = arrival - sut.time_ns(k, arrival);
        }
        assert!(last < 100_000, "{last} ns behind");
    }
}
