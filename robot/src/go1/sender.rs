//! The loop that owns the line: a command goes out every 2 ms, whatever the controller does.
//!
//! ```text
//!           board ─► newest state ─► report ─► controller ─► command ─► watchdog ─► board
//!  in each period:  │◄── answer_us ──────────────────────────────────────►│
//! ```
//! It lives in a process of its own ([`super::apart`]) or, in tests, on a thread. It decides nothing but what
//! [`super::watchdog`] does, allocates nothing in its loop, and ends when the controller has ended and the motors
//! have been damped for long enough.

use std::{
    io::ErrorKind,
    time::{Duration, Instant},
};

use locoman_protocol::{
    clock::monotonic_ns,
    pace::{Pace, sleep_until},
    realtime,
};

use super::{
    Go1Settings, LowCommand,
    feed::{Arrival, FeedEnd, Report},
    line::Line,
    sample_clock::SampleClock,
    watchdog::{Signs, Verdict, Watchdog, asks_for_damping},
};

/// Time between two commands, ns.
pub const PERIOD_NS: u64 = 2_000_000;

/// A period of the sender counts as at most so long.
const LONGEST_PERIOD_NS: u64 = 2 * PERIOD_NS;
/// How long a taken port is waited for: longer than a sender lingers by default.
const PORT_PATIENCE: Duration = Duration::from_secs(5);

/// Why the sender cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum SenderError {
    /// The local port is taken.
    #[error(
        "cannot speak to the robot from {local}: {source}; another program that drives it may still run, \
         or choose another `local` in go1.toml"
    )]
    Port {
        /// The address.
        local: std::net::SocketAddr,
        /// What the system said.
        source: std::io::Error,
    },
}

/// Everything that the loop remembers.
struct Sender<'a> {
    line: Line,
    feed: &'a FeedEnd,
    watchdog: Watchdog,
    clock: SampleClock,
    /// The controller's last command.
    last: Option<LowCommand>,
    /// Its age, ns: as far as the sender itself was awake.
    age_ns: u64,
    /// When something was sent last.
    spoke_ns: u64,
    ended: bool,
    /// The robot has not answered yet.
    unheard: bool,
    chord: bool,
    verdict: Verdict,
    late_ns: u64,
    missed: u64,
}

/// Runs until the controller has ended and its motors have been damped for `linger_ms`.
///
/// Sends nothing before the controller has sent something.
pub fn run(settings: &Go1Settings, feed: &FeedEnd) -> Result<(), SenderError> {
    let Go1Settings { board, local, checksum, answer_us, watchdog, .. } = *settings;
    let line =
        open(|| Line::open(board, local, checksum)).map_err(|source| SenderError::Port { local, source })?;
    realtime::run_before_others();
    tracing::info!(%board, from = ?line.local().ok(), "the sender is up");
    let mut sender = Sender {
        line,
        feed,
        watchdog: Watchdog::new(watchdog),
        clock: SampleClock::default(),
        last: None,
        age_ns: 0,
        spoke_ns: 0,
        ended: false,
        unheard: true,
        chord: false,
        verdict: Verdict::Follow,
        late_ns: 0,
        missed: 0,
    };
    let linger_ns = (watchdog.linger_ms * 1e6) as u64;
    let mut ended_ns = None;
    let mut pace = Pace::new(PERIOD_NS).spinning();
    let mut wake = pace.wait();
    loop {
        sleep_until(wake.deadline_ns + PERIOD_NS - answer_us * 1000, 0);
        sender.hear();
        wake = pace.wait();
        sender.late_ns = wake.late_ns;
        sender.missed += wake.missed;
        let now_ns = monotonic_ns();
        sender.speak(now_ns);
        if sender.ended {
            let since = *ended_ns.get_or_insert(now_ns);
            if sender.last.is_none() || now_ns - since >= linger_ns {
                return Ok(());
            }
        }
    }
}

/// Opens the line; while the port is taken, the sender of a program that has just ended may still be damping.
fn open(mut line: impl FnMut() -> std::io::Result<Line>) -> std::io::Result<Line> {
    let deadline = Instant::now() + PORT_PATIENCE;
    let mut told = false;
    loop {
        match line() {
            Err(error) if error.kind() == ErrorKind::AddrInUse && Instant::now() < deadline => {
                if !std::mem::replace(&mut told, true) {
                    tracing::info!("another sender still speaks to the robot; waiting for its end");
                }
                std::thread::sleep(Duration::from_millis(20));
            }
            result => return result,
        }
    }
}

impl Sender<'_> {
    /// Takes the newest state in and hands it on.
    fn hear(&mut self) {
        let Some(received) = self.line.newest() else { return };
        if std::mem::take(&mut self.unheard) {
            tracing::info!(checksum = ?received.checksum, "the robot answers");
        }
        self.chord = received.state.remote().is_some_and(|remote| remote.asks_for_stop());
        let report = Report {
            sample_ns: self.clock.time_ns(received.state.tick_ms, received.received_ns),
            received_ns: received.received_ns,
            late_ns: self.late_ns,
            missed: self.missed,
            counts: self.line.counts(),
            verdict: self.verdict,
            state: received.state,
        };
        // Whether the controller is still there, its next command tells.
        self.feed.send_report(&report, &received.raw);
    }

    /// Takes the newest command in and sends what the watchdog makes of it.
    fn speak(&mut self, now_ns: u64) {
        // What holds the sender up may hold the controller up too, and nothing can be sent meanwhile: that time
        // does not count against the controller, which gets the time to answer that it always has.
        self.age_ns += now_ns.saturating_sub(self.spoke_ns).min(LONGEST_PERIOD_NS);
        self.spoke_ns = now_ns;
        match self.feed.newest_command() {
            Arrival::New(command) => (self.last, self.age_ns) = (Some(command), 0),
            Arrival::Nothing => {}
            Arrival::Ended => self.ended = true,
        }
        let Some(command) = self.last else { return };
        self.verdict = self.watchdog.judge(&Signs {
            age_ns: self.age_ns,
            asks_for_damping: asks_for_damping(&command),
            chord: self.chord,
            ended: self.ended,
        });
        self.line.send(&self.watchdog.outgoing(&command));
    }
}
