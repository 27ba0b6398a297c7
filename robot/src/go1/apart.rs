//! The sender as a process of its own, so that a controller that dies, however it dies, leaves damped motors.
//!
//! The program starts itself again as `locoman-robot wire`, its standard input the sender's end of the feed. When
//! the controller's process ends, the system closes the other end: the sender reads that in its next period. To
//! outlive its parent it leaves the parent's session (no Ctrl-C, no hang-up of a terminal reaches it), takes the
//! name [`NAME`] (no `pkill locoman-robot` either), and passes over requests to end, which come with Ctrl-C or from
//! a service manager: it ends by itself, soon after its parent.

use std::{
    os::fd::AsFd,
    process::{Child, Command, Stdio},
};

use locoman_protocol::realtime;

use super::{Go1Settings, feed::FeedEnd, sender};

/// What the process is called; at most 15 letters.
pub const NAME: &std::ffi::CStr = c"go1-wire";

/// How to start this program as a sender.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    /// The program.
    pub path: std::path::PathBuf,
    /// Its arguments, subcommand included.
    pub args: Vec<std::ffi::OsString>,
}

/// Starts the sender's process with its end of the feed.
pub fn spawn(program: &Program, feed: FeedEnd) -> std::io::Result<Child> {
    Command::new(&program.path)
        .args(&program.args)
        .stdin(Stdio::from(feed.into_fd()))
        .stdout(Stdio::null())
        .spawn()
}

/// What `locoman-robot wire` does: makes itself independent of its parent, and sends.
pub fn run(settings: &Go1Settings) -> anyhow::Result<()> {
    leave_session();
    ctrlc::set_handler(|| {})?;
    realtime::lock_memory();
    let feed = FeedEnd::new(std::io::stdin().as_fd().try_clone_to_owned()?)?;
    // The copy counts: this one must not keep the feed's end open.
    sender::run(settings, &feed)?;
    Ok(())
}

fn leave_session() {
    // SAFETY: takes no pointers. It fails only for the leader of a group of processes, which a child is not.
    unsafe { libc::setsid() };
    // SAFETY: the pointer is to a constant string that ends with a zero byte.
    unsafe { libc::prctl(libc::PR_SET_NAME, NAME.as_ptr()) };
}
