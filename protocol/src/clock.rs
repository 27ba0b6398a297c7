//! The one clock of the system.

/// Now, in nanoseconds of `CLOCK_MONOTONIC`.
///
/// Comparable between processes of one machine (it counts from the machine's start), never set back, and
/// without meaning on another machine.
pub fn monotonic_ns() -> u64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a live, exclusively borrowed timespec. The call cannot fail: Linux always
    // has CLOCK_MONOTONIC; should it ever, time stands still at 0 and every watchdog trips.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut now) };
    u64::try_from(now.tv_sec).unwrap_or(0) * 1_000_000_000 + u64::try_from(now.tv_nsec).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn never_runs_backwards_and_counts_nanoseconds() {
        let before = monotonic_ns();
        std::thread::sleep(Duration::from_millis(2));
        let after = monotonic_ns();
        assert!(after - before >= 2_000_000);
        assert!(after - before < 60_000_000_000, "not nanoseconds");
    }
}
