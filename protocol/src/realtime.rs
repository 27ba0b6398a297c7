//! Lets a thread with a deadline run before those without.

/// Priority within `SCHED_FIFO` (1 to 99): above ordinary threads, below the kernel's own (50).
const PRIORITY: libc::c_int = 20;

/// Asks the system to run the calling thread before all ordinary ones (`SCHED_FIFO`), and tells whether it
/// agreed: it does for root, or with an `rtprio` limit or `CAP_SYS_NICE`. Threads that it starts do not inherit it.
///
/// For threads that mostly sleep: one that does not would starve the rest.
pub fn run_before_others() -> bool {
    // SAFETY: an all-zero `sched_param` is a valid value of this C struct of integers.
    let mut parameters: libc::sched_param = unsafe { std::mem::zeroed() };
    parameters.sched_priority = PRIORITY;
    // SAFETY: 0 is the calling thread; the pointer is to a live local.
    unsafe {
        libc::sched_setscheduler(0, libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, &raw const parameters) == 0
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn asking_never_fails_hard() {
        // Granted or not is the system's affair; the thread goes on either way.
        let _granted = super::run_before_others();
    }
}
