//! The Zenoh side: commands and stops in, state out. None of it runs on the control thread.
//!
//! ```text
//! Zenoh ─► admission ─► triple buffer ─► control loop ─► triple buffer ─► state thread ─► Zenoh, 100 Hz
//!               stop ─► atomic ────────►
//! ```
//! The control loop's ends of the slots never wait: [`Inbox`] and [`Outbox`].

mod admission;
mod state;

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering},
    },
    thread::JoinHandle,
};

pub use admission::{Admission, Ruling};
use locoman_protocol::{
    Endpoints, Link, LinkError, Received, Subscription,
    messages::{self, OperatorCommand, RobotState},
    pace::Pace,
};
pub use state::message;
use triple_buffer::{Input, Output, TripleBuffer};

use crate::{commander::Command, control::Snapshot, supervisor::Stop};

/// Time between two states, ns.
const STATE_PERIOD_NS: u64 = 10_000_000;

/// What arrives, for the control loop.
#[derive(Debug)]
pub struct Inbox {
    command: Output<Option<Command>>,
    stop: Arc<AtomicU8>,
}

impl Inbox {
    /// The latest accepted command. Never waits.
    pub fn command(&mut self) -> Option<Command> {
        *self.command.read()
    }

    /// The strongest stop since the last call. Never waits.
    pub fn take_stop(&self) -> Stop {
        match self.stop.swap(0, Ordering::Relaxed) {
            0 => Stop::None,
            1 => Stop::Settle,
            _ => Stop::Damp,
        }
    }

    /// An inbox that the program itself can put a stop into.
    pub fn stop_handle(&self) -> StopHandle {
        StopHandle(Arc::clone(&self.stop))
    }
}

/// Asks the control loop to stop.
#[derive(Debug, Clone)]
pub struct StopHandle(Arc<AtomicU8>);

impl StopHandle {
    /// Asks for it; the stronger of two stands.
    pub fn ask(&self, stop: Stop) {
        let level = match stop {
            Stop::None => 0,
            Stop::Settle => 1,
            Stop::Damp => 2,
        };
        self.0.fetch_max(level, Ordering::Relaxed);
    }
}

/// What leaves, from the control loop.
pub type Outbox = Input<Option<Snapshot>>;

/// How many commands were taken.
#[derive(Debug, Default)]
struct Counts {
    accepted: AtomicU64,
    rejected: AtomicU64,
}

/// The robot's presence on the network; leaves when dropped.
#[derive(Debug)]
pub struct RobotLink {
    _subscriptions: (Subscription, Subscription),
    ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl RobotLink {
    /// Listens, subscribes, and begins to publish what comes out of the outbox.
    pub fn open(
        robot: &str,
        endpoints: &Endpoints,
        source_stale_ms: f64,
    ) -> Result<(Self, Inbox, Outbox), LinkError> {
        let link = Link::open(robot, endpoints)?;
        let (command_in, command) = TripleBuffer::new(&None).split();
        let (outbox, state_out) = TripleBuffer::new(&None).split();
        let stop = Arc::new(AtomicU8::new(0));
        let counts = Arc::new(Counts::default());
        let inbox = Inbox { command, stop: Arc::clone(&stop) };
        let subscriptions = (
            subscribe_commands(&link, command_in, Arc::clone(&counts), source_stale_ms)?,
            subscribe_stops(&link, StopHandle(stop))?,
        );
        let ended = Arc::new(AtomicBool::new(false));
        let thread = publish_states(link, state_out, counts, Arc::clone(&ended))?;
        Ok((Self { _subscriptions: subscriptions, ended, thread: Some(thread) }, inbox, outbox))
    }
}

impl Drop for RobotLink {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so already.
            let _ = thread.join();
        }
    }
}

fn subscribe_commands(
    link: &Link,
    mut slot: Input<Option<Command>>,
    counts: Arc<Counts>,
    source_stale_ms: f64,
) -> Result<Subscription, LinkError> {
    let mut admission = Admission::new((source_stale_ms * 1e6) as u64);
    link.subscribe::<OperatorCommand>(move |Received { message, received_ns }| {
        match admission.judge(&message, received_ns) {
            Ruling::Accepted => {
                counts.accepted.fetch_add(1, Ordering::Relaxed);
                slot.write(Some(Command::from_message(&message, received_ns)));
            }
            ruling => {
                let rejected = counts.rejected.fetch_add(1, Ordering::Relaxed);
                // The first few tell what is wrong; all are counted.
                if rejected < 5 {
                    tracing::warn!(?ruling, "command rejected");
                }
            }
        }
    })
}

fn subscribe_stops(link: &Link, stop: StopHandle) -> Result<Subscription, LinkError> {
    link.subscribe::<messages::Stop>(move |received| {
        tracing::warn!(level = ?received.message.level(), "stop received");
        stop.ask(match received.message.level() {
            messages::stop::Level::Damp => Stop::Damp,
            // Whatever else someone meant by a stop, it was a stop.
            messages::stop::Level::Settle | messages::stop::Level::Unspecified => Stop::Settle,
        });
    })
}

fn publish_states(
    link: Link,
    mut slot: Output<Option<Snapshot>>,
    counts: Arc<Counts>,
    ended: Arc<AtomicBool>,
) -> Result<JoinHandle<()>, LinkError> {
    let mut sender = link.sender::<RobotState>()?;
    let thread = move || {
        // The session lives as long as this thread.
        let _link = link;
        let mut pace = Pace::new(STATE_PERIOD_NS);
        while !ended.load(Ordering::Relaxed) {
            if let Some(snapshot) = slot.read() {
                let accepted = counts.accepted.load(Ordering::Relaxed);
                let rejected = counts.rejected.load(Ordering::Relaxed);
                if let Err(error) = sender.send(snapshot.time_ns, message(snapshot, accepted, rejected)) {
                    tracing::debug!(%error, "state not sent");
                }
            }
            pace.wait();
        }
    };
    std::thread::Builder::new()
        .name("state".into())
        .spawn(thread)
        .map_err(|source| LinkError::CannotListen { endpoint: "the state thread".into(), source })
}
