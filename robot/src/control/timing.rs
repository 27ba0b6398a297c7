//! Percentiles over the last second, without allocation.

use hdrhistogram::Histogram;

const SECOND_NS: u64 = 1_000_000_000;
/// Longest duration told apart, ns: a minute.
const LONGEST_NS: u64 = 60 * SECOND_NS;

/// Of the durations of one second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Percentiles {
    /// Median, ns.
    pub p50_ns: u64,
    /// Exceeded by one in a hundred, ns.
    pub p99_ns: u64,
    /// The longest, ns.
    pub worst_ns: u64,
    /// How many.
    pub count: u64,
}

/// Collects durations and sums up each second.
#[derive(Debug, Clone)]
pub struct SecondHistogram {
    histogram: Histogram<u32>,
    started_ns: Option<u64>,
    last: Percentiles,
}

impl SecondHistogram {
    /// Takes all memory that it will need. Nothing only if the histogram's constants were wrong.
    pub fn new() -> Option<Self> {
        let histogram = Histogram::new_with_bounds(100, LONGEST_NS, 2).ok()?;
        Some(Self { histogram, started_ns: None, last: Percentiles::default() })
    }

    /// Takes in a duration.
    pub fn record(&mut self, now_ns: u64, duration_ns: u64) {
        self.histogram.saturating_record(duration_ns);
        let started_ns = *self.started_ns.get_or_insert(now_ns);
        if now_ns.saturating_sub(started_ns) >= SECOND_NS {
            self.last = Percentiles {
                p50_ns: self.histogram.value_at_quantile(0.5),
                p99_ns: self.histogram.value_at_quantile(0.99),
                worst_ns: self.histogram.max(),
                count: self.histogram.len(),
            };
            self.histogram.reset();
            self.started_ns = Some(now_ns);
        }
    }

    /// Of the last full second.
    pub fn last_second(&self) -> Percentiles {
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_is_summed_up_when_it_is_over() {
        let mut sut = SecondHistogram::new().unwrap();
        for i in 1..=400_u64 {
            sut.record(i * 2_500_000, if i == 77 { 9_000_000 } else { 2_500_000 });
        }
        assert_eq!(sut.last_second(), Percentiles::default());
        sut.record(401 * 2_500_000, 2_500_000);
        let Percentiles { p50_ns, p99_ns, worst_ns, count } = sut.last_second();
        assert_eq!(count, 401);
        // Two significant digits.
        assert!((2_480_000..2_530_000).contains(&p50_ns), "{p50_ns}");
        assert!((2_480_000..2_530_000).contains(&p99_ns), "{p99_ns}");
        assert!(worst_ns >= 9_000_000);
    }
}
