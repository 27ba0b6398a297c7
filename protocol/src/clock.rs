//! The one clock of the system.

/// Now, in nanoseconds of `CLOCK_MONOTONIC`.
///
/// Comparable between processes of one machine (it counts from the machine's start), never set back, and
/// without meaning on another machine.
pub fn monotonic_ns() -> u64 {
    // Linux always has CLOCK_MONOTONIC; should it ever not, time stands still at 0 and every watchdog trips.
    read(libc::CLOCK_MONOTONIC)
}

/// Processor time that the calling thread has used, ns: how long something takes, whatever else runs.
pub fn thread_cpu_ns() -> u64 {
    read(libc::CLOCK_THREAD_CPUTIME_ID)
}

fn read(clock: libc::clockid_t) -> u64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a live, exclusively borrowed timespec.
    unsafe { libc::clock_gettime(clock, &raw mut now) };
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

    #[test]
    fn a_sleeping_thread_uses_no_processor() {
        let before = thread_cpu_ns();
        std::thread::sleep(Duration::from_millis(50));
        assert!(thread_cpu_ns() - before < 25_000_000);
    }
}
