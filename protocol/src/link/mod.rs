//! Zenoh sessions between the processes: open, send, subscribe, close.
//!
//! Peers over TCP with explicit endpoints; nothing is scouted. A peer that is missing is not an error: it is
//! tried for ever, every 0.2 to 1 s, and the link heals by itself when it returns. All calls block and are
//! made from set-up or communication threads, never from the control thread (`ARCHITECTURE.md`).

mod config;
mod endpoints;
mod error;
mod sender;
mod subscription;

pub use endpoints::Endpoints;
pub use error::LinkError;
pub use sender::Sender;
pub use subscription::{Received, Subscription};

use crate::keys::{self, RobotName};
use crate::topic::Wire;
use std::collections::HashMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;
use zenoh::Wait;

/// Zenoh may take 10 s to say goodbye over a bad link; the process does not wait for longer than this.
const CLOSE_LIMIT: Duration = Duration::from_millis(500);

/// A session with the other processes of one robot.
///
/// Closed when dropped.
#[derive(Debug)]
pub struct Link {
    session: zenoh::Session,
    robot: RobotName,
    source: u64,
    /// One count for each key, so that two senders on one key do not repeat a sequence number.
    sequences: Mutex<HashMap<String, Arc<AtomicU64>>>,
}

impl Link {
    /// Opens a session: listens at once, connects in the background.
    ///
    /// # Errors
    /// A robot name or endpoint that is not well-formed; a port that is in use or an address that this
    /// machine does not have. Each names the endpoint and the remedy.
    pub fn open(robot: &str, endpoints: &Endpoints) -> Result<Self, LinkError> {
        let robot = RobotName::new(robot)?;
        endpoints.check()?;
        let config = config::peer(endpoints)?;
        let session = zenoh::open(config).wait().map_err(LinkError::zenoh("open a session"))?;
        Ok(Self {
            session,
            robot,
            // 0 stands for "nobody" in `RobotState::command_source`.
            source: rand::random::<u64>().max(1),
            sequences: Mutex::default(),
        })
    }

    /// The random id of this session: the `source` of the headers that it sends.
    pub fn source(&self) -> u64 {
        self.source
    }

    /// How many peers are connected now.
    pub fn peers(&self) -> usize {
        self.session.info().peers_zid().wait().count()
    }

    /// A sender for a topic of which there is one key.
    pub fn sender<M: Wire>(&self) -> Result<Sender<M>, LinkError> {
        self.sender_on(keys::publish(&self.robot, &M::TOPIC)?)
    }

    /// A sender for a topic of which each sender has a key of its own, as each camera's detections.
    pub fn sender_named<M: Wire>(&self, name: &str) -> Result<Sender<M>, LinkError> {
        self.sender_on(keys::publish_named(&self.robot, &M::TOPIC, name)?)
    }

    fn sender_on<M: Wire>(&self, key: String) -> Result<Sender<M>, LinkError> {
        let mut sequences = self.sequences.lock().unwrap_or_else(PoisonError::into_inner);
        let sequence = Arc::clone(sequences.entry(key.clone()).or_default());
        Sender::declare(&self.session, key, self.source, sequence)
    }

    /// Calls `on_message` for each message of a topic, from any sender, on one of Zenoh's threads.
    ///
    /// The callback must be short: while it runs, nothing else arrives from that peer. Hand the message to a
    /// slot or a queue. What cannot be decoded is dropped and counted: see [`Subscription`].
    pub fn subscribe<M: Wire>(
        &self,
        on_message: impl FnMut(Received<M>) + Send + 'static,
    ) -> Result<Subscription, LinkError> {
        Subscription::declare(&self.session, keys::subscribe(&self.robot, &M::TOPIC), on_message)
    }

    /// Says goodbye to the peers, so that they notice at once; gives up after half a second.
    pub fn close(self) {
        drop(self);
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        let (done, closed) = mpsc::channel();
        let session = self.session.clone();
        let closing = std::thread::Builder::new().name("link close".to_owned()).spawn(move || {
            let outcome = session.close().wait();
            // The receiver may have given up.
            let _ = done.send(outcome);
        });
        match closing.map(|_| closed.recv_timeout(CLOSE_LIMIT)) {
            Ok(Ok(Ok(()))) => {}
            Ok(Ok(Err(error))) => tracing::warn!("the session did not close cleanly: {error}"),
            Ok(Err(_)) => tracing::warn!("the session did not close within {CLOSE_LIMIT:?}"),
            Err(error) => tracing::warn!("no thread to close the session: {error}"),
        }
    }
}
