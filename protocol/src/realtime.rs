//! Lets a thread with a deadline run before those without, and never wait for a page of memory.

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

/// Asks the system to run the calling thread only when others leave a processor free for it, nearly: work that may
/// be late, so that other work is not.
pub fn run_after_others() {
    /// Niceness: 0 is ordinary, 19 the last.
    const NICENESS: libc::c_int = 15;
    // SAFETY: plain integers. On Linux niceness is a thread's own, and 0 is the calling thread.
    // A refusal leaves it ordinary, which is no harm.
    unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, NICENESS) };
}

/// Keeps all of the process's memory, now and later, in the machine's: a thread with a deadline never waits
/// for a page. Tells whether the system agreed: it does for root, or without a limit on locked memory
/// (`ulimit -l unlimited`).
///
/// Not asked for under a finite limit: what is allocated beyond it later would fail.
pub fn lock_memory() -> bool {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: the pointer is to a live, exclusively borrowed rlimit; geteuid and mlockall take no pointers.
    unsafe {
        libc::getrlimit(libc::RLIMIT_MEMLOCK, &raw mut limit);
        (limit.rlim_cur == libc::RLIM_INFINITY || libc::geteuid() == 0)
            && libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) == 0
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn asking_never_fails_hard() {
        // Granted or not is the system's affair; the thread goes on either way.
        let _granted = super::run_before_others();
        std::thread::spawn(super::run_after_others).join().unwrap();
        let _granted = super::lock_memory();
    }
}
