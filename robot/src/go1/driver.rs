//! The controller's end of the line to a Go1: commands out, states in, and a sender that is kept alive.
//!
//! Never waits but for a state. A sender that dies is started again: until then the board keeps its last command,
//! for some tens of milliseconds; how often is counted.

use std::{
    process::Child,
    thread::JoinHandle,
    time::{Duration, Instant},
};

use super::{
    Go1Settings,
    apart::{self, Program},
    feed::{self, Arrival, FeedEnd, Report},
    sender,
};
use crate::plant::JointCommand;

/// A sender that cannot be kept alive is not started more often than this.
const RESTART_PAUSE: Duration = Duration::from_millis(100);

/// Where the sender runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// In a process of its own, which damps the motors when this one dies.
    Process(Program),
    /// On a thread of this process: for tests.
    Thread,
}

/// A running sender.
#[derive(Debug)]
enum Running {
    Process(Child),
    Thread(Option<JoinHandle<()>>),
}

/// The driver.
#[derive(Debug)]
pub struct Driver {
    settings: Go1Settings,
    place: Place,
    feed: FeedEnd,
    running: Running,
    started: Instant,
    restarts: u64,
}

impl Driver {
    /// Starts a sender. Succeeds also while no robot is there.
    pub fn start(settings: Go1Settings, place: Place) -> std::io::Result<Self> {
        let (feed, running) = start(&settings, &place)?;
        Ok(Self { settings, place, feed, running, started: Instant::now(), restarts: 0 })
    }

    /// Hands a command for the legs over, cut to the limits, and waits for the next state at most so long.
    ///
    /// Nothing if none came, or if the sender died: it is started again, and the next call may have more luck.
    pub fn exchange(&mut self, command: &JointCommand, timeout: Duration) -> std::io::Result<Option<Report>> {
        if !self.feed.send_command(&self.settings.limits.apply(command)) {
            self.restart()?;
            return Ok(None);
        }
        let deadline = Instant::now() + timeout;
        loop {
            match self.feed.newest_report() {
                Arrival::New(report) => return Ok(Some(report)),
                Arrival::Ended => {
                    self.restart()?;
                    return Ok(None);
                }
                Arrival::Nothing => {}
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            self.feed.wait(left);
        }
    }

    /// How often a sender had to be started again.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }

    /// Id of the sender's process, if it has one of its own.
    pub fn sender_id(&self) -> Option<u32> {
        match &self.running {
            Running::Process(child) => Some(child.id()),
            Running::Thread(_) => None,
        }
    }

    /// What it was started with.
    pub fn settings(&self) -> &Go1Settings {
        &self.settings
    }

    fn restart(&mut self) -> std::io::Result<()> {
        std::thread::sleep(RESTART_PAUSE.saturating_sub(self.started.elapsed()));
        if let Running::Process(child) = &mut self.running {
            // Its end is closed, so it has ended or is of no use; two senders must never speak at once.
            let _ = child.kill();
            let _ = child.wait();
        }
        (self.feed, self.running) = start(&self.settings, &self.place)?;
        self.started = Instant::now();
        self.restarts += 1;
        Ok(())
    }
}

impl Drop for Driver {
    /// A thread is waited for while it damps; a process goes on by itself.
    fn drop(&mut self) {
        if let Running::Thread(thread) = &mut self.running {
            if let Ok((unused, _)) = feed::pair() {
                self.feed = unused;
            }
            if let Some(thread) = thread.take() {
                // A thread that panicked has said so already.
                let _ = thread.join();
            }
        }
    }
}

fn start(settings: &Go1Settings, place: &Place) -> std::io::Result<(FeedEnd, Running)> {
    let (ours, theirs) = feed::pair()?;
    let running = match place {
        Place::Process(program) => Running::Process(apart::spawn(program, theirs)?),
        Place::Thread => {
            let settings = *settings;
            let send = move || {
                if let Err(error) = sender::run(&settings, &theirs) {
                    tracing::error!(%error, "the sender has ended");
                }
            };
            Running::Thread(Some(std::thread::Builder::new().name("go1-wire".into()).spawn(send)?))
        }
    };
    Ok((ours, running))
}
