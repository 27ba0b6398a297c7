//! The receiving end of a topic.

use super::LinkError;
use crate::clock::monotonic_ns;
use crate::topic::Wire;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use zenoh::Wait;

/// A message and when it came.
#[derive(Debug, Clone, PartialEq)]
pub struct Received<M> {
    /// The message. Its numbers are unchecked: see [`crate::validate()`].
    pub message: M,
    /// When it arrived, on this machine's monotonic clock. Staleness is measured from here.
    pub received_ns: u64,
}

/// Keeps a callback subscribed; unsubscribes when dropped.
#[derive(Debug)]
pub struct Subscription {
    _subscriber: zenoh::pubsub::Subscriber<()>,
    counts: Arc<Counts>,
}

#[derive(Debug, Default)]
struct Counts {
    received: AtomicU64,
    undecodable: AtomicU64,
}

impl Subscription {
    pub(super) fn declare<M: Wire>(
        session: &zenoh::Session,
        key: String,
        on_message: impl FnMut(Received<M>) + Send + 'static,
    ) -> Result<Self, LinkError> {
        let counts = Arc::new(Counts::default());
        let counted = Arc::clone(&counts);
        // Each peer has its thread at Zenoh: one message at a time.
        let on_message = Mutex::new(on_message);
        let subscriber = session
            .declare_subscriber(key)
            .callback(move |sample| {
                let received_ns = monotonic_ns();
                let Some(message) = decode::<M>(&sample.payload().to_bytes()) else {
                    counted.undecodable.fetch_add(1, Ordering::Relaxed);
                    return;
                };
                counted.received.fetch_add(1, Ordering::Relaxed);
                let mut on_message = on_message.lock().unwrap_or_else(PoisonError::into_inner);
                on_message(Received { message, received_ns });
            })
            .wait()
            .map_err(LinkError::zenoh("subscribe"))?;
        Ok(Self { _subscriber: subscriber, counts })
    }

    /// Messages handed to the callback.
    pub fn received(&self) -> u64 {
        self.counts.received.load(Ordering::Relaxed)
    }

    /// Messages dropped because they were longer than the topic allows or not of its type.
    pub fn undecodable(&self) -> u64 {
        self.counts.undecodable.load(Ordering::Relaxed)
    }
}

fn decode<M: Wire>(bytes: &[u8]) -> Option<M> {
    if bytes.len() > M::TOPIC.max_bytes {
        return None;
    }
    M::decode(bytes).ok()
}
