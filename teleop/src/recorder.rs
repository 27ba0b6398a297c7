//! Records the session: what was commanded, what the robot said, what was tracked, what happened.
//!
//! A thread of its own behind a bounded queue: whoever offers a message never waits, and what did not fit
//! is counted, reported at the end and written into the recording.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;

use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{Event, OperatorCommand, RobotState, SimTruth, Tracking};
use locoman_protocol::recording::{RecordingError, Writer};
use locoman_protocol::{Received, Wire};

/// Several seconds of everything.
const QUEUE: usize = 2048;

/// Something to record.
#[derive(Debug)]
#[expect(missing_docs, reason = "each is the message of that name")]
pub enum Item {
    Command(Box<OperatorCommand>),
    State(Arc<Received<RobotState>>),
    Truth(Arc<Received<SimTruth>>),
    Tracking(Arc<Tracking>),
    Event(Event),
}

/// Offers messages to the recorder; cheap to clone. Without a recorder it does nothing.
#[derive(Debug, Clone, Default)]
pub struct Tap {
    queue: Option<SyncSender<(u64, Item)>>,
    dropped: Arc<AtomicU64>,
}

impl Tap {
    /// Records a message as of now; never waits.
    pub fn offer(&self, item: Item) {
        let Some(queue) = &self.queue else { return };
        if let Err(TrySendError::Full(_)) = queue.try_send((monotonic_ns(), item)) {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Whether there is a recorder.
    pub fn recording(&self) -> bool {
        self.queue.is_some()
    }

    /// Messages that did not fit into the queue.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

/// The recorder's thread; it ends when every [`Tap`] is gone.
#[derive(Debug)]
pub struct Recorder {
    thread: JoinHandle<Result<(), RecordingError>>,
}

impl Recorder {
    /// Creates the file and starts the thread. `attachments`: name and text of configuration files.
    pub fn start(path: &Path, attachments: &[(String, String)]) -> Result<(Self, Tap), RecordingError> {
        let mut writer = Writer::create(path)?;
        for (name, text) in attachments {
            writer.attach(name, "application/toml", text.as_bytes())?;
        }
        let (queue, items) = sync_channel(QUEUE);
        let tap = Tap { queue: Some(queue), dropped: Arc::default() };
        let dropped = Arc::clone(&tap.dropped);
        let thread = std::thread::spawn(move || {
            write_all(writer, &items, &dropped)
                // Now, not only at the end: a session may be worth nothing without its recording.
                .inspect_err(|error| tracing::error!("the session is no longer recorded: {error}"))
        });
        Ok((Self { thread }, tap))
    }

    /// Waits for the file to be complete. Drop every [`Tap`] before.
    pub fn finish(self) -> Result<(), RecordingError> {
        // The thread does not panic; if it did, the file has been closed by its drop.
        self.thread.join().unwrap_or(Ok(()))
    }
}

fn write_all(
    mut writer: Writer,
    items: &Receiver<(u64, Item)>,
    dropped: &AtomicU64,
) -> Result<(), RecordingError> {
    while let Ok((time_ns, item)) = items.recv() {
        match item {
            Item::Command(message) => write(&mut writer, time_ns, message.as_ref()),
            Item::State(received) => write(&mut writer, time_ns, &received.message),
            Item::Truth(received) => write(&mut writer, time_ns, &received.message),
            Item::Tracking(message) => write(&mut writer, time_ns, message.as_ref()),
            Item::Event(message) => write(&mut writer, time_ns, &message),
        }?;
    }
    let dropped = dropped.load(Ordering::Relaxed).to_string();
    writer.metadata("recorder", [("dropped".to_owned(), dropped)].into())?;
    writer.finish()
}

fn write<M: Wire>(writer: &mut Writer, time_ns: u64, message: &M) -> Result<(), RecordingError> {
    writer.write(&M::TOPIC.recording_name(), time_ns, message)
}
