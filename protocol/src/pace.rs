//! Steady rates: absolute deadlines on the monotonic clock.

use crate::clock::monotonic_ns;

/// What the system needs at most, as a rule, to wake a thread that it runs before others, ns.
///
/// A thread that sleeps until so long before its deadline and watches the clock for the rest is in time to the
/// microsecond; it costs so much of a core in each period.
pub const SPIN_NS: u64 = 100_000;

/// Wakes a thread at a steady rate.
#[derive(Debug, Clone)]
pub struct Pace {
    period_ns: u64,
    spin_ns: u64,
    next_ns: u64,
}

/// How a thread was woken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wake {
    /// The deadline, ns of the monotonic clock.
    pub deadline_ns: u64,
    /// How long after the deadline, ns.
    pub late_ns: u64,
    /// Deadlines that had passed altogether: they are not made up for.
    pub missed: u64,
}

impl Pace {
    /// The first deadline is one period from now.
    pub fn new(period_ns: u64) -> Self {
        let period_ns = period_ns.max(1);
        Self { period_ns, spin_ns: 0, next_ns: monotonic_ns() + period_ns }
    }

    /// Watches the clock for the last [`SPIN_NS`] before each deadline in place of sleeping.
    #[must_use]
    pub fn spinning(self) -> Self {
        Self { spin_ns: SPIN_NS, ..self }
    }

    /// Waits for the next deadline.
    pub fn wait(&mut self) -> Wake {
        sleep_until(self.next_ns, self.spin_ns);
        let late_ns = monotonic_ns().saturating_sub(self.next_ns);
        let missed = late_ns / self.period_ns;
        let deadline_ns = self.next_ns + missed * self.period_ns;
        self.next_ns = deadline_ns + self.period_ns;
        Wake { deadline_ns, late_ns: late_ns - missed * self.period_ns, missed }
    }
}

/// Sleeps until a time of the monotonic clock, watching the clock for the last `spin_ns`.
pub fn sleep_until(deadline_ns: u64, spin_ns: u64) {
    let wake_ns = deadline_ns.saturating_sub(spin_ns);
    let wake = libc::timespec {
        tv_sec: libc::time_t::try_from(wake_ns / 1_000_000_000).unwrap_or(libc::time_t::MAX),
        tv_nsec: (wake_ns % 1_000_000_000) as libc::c_long,
    };
    while monotonic_ns() < wake_ns {
        // SAFETY: the pointer is to a live local; no remaining time is asked for. On a signal it returns early
        // and is called again: the time is absolute.
        unsafe {
            libc::clock_nanosleep(
                libc::CLOCK_MONOTONIC,
                libc::TIMER_ABSTIME,
                &raw const wake,
                std::ptr::null_mut(),
            )
        };
    }
    while monotonic_ns() < deadline_ns {
        std::hint::spin_loop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: u64 = 2_000_000;

    #[test]
    fn deadlines_stand_a_period_apart_however_late_the_wake() {
        let mut sut = Pace::new(PERIOD_NS).spinning();
        let first = sut.wait();
        let mut passed = 0;
        for _ in 0..20 {
            let wake = sut.wait();
            passed += 1 + wake.missed;
            assert_eq!(wake.deadline_ns, first.deadline_ns + passed * PERIOD_NS);
            assert!(monotonic_ns() >= wake.deadline_ns);
        }
    }

    #[test]
    fn what_was_missed_is_counted_and_left_behind() {
        let mut sut = Pace::new(PERIOD_NS);
        let first = sut.wait();
        std::thread::sleep(std::time::Duration::from_nanos(7 * PERIOD_NS / 2));
        let wake = sut.wait();
        assert!(wake.missed >= 2, "{wake:?}");
        assert!(wake.late_ns < PERIOD_NS);
        assert_eq!(wake.deadline_ns, first.deadline_ns + (1 + wake.missed) * PERIOD_NS);
    }
}
