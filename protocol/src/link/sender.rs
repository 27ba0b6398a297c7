//! The sending end of one key.

use super::LinkError;
use crate::clock::monotonic_ns;
use crate::messages::Header;
use crate::topic::Wire;
use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use zenoh::Wait;
use zenoh::pubsub::Publisher;

/// Sends messages of one type; knows who sends and counts them.
#[derive(Debug)]
pub struct Sender<M> {
    publisher: Publisher<'static>,
    source: u64,
    sequence: Arc<AtomicU64>,
    message: PhantomData<fn(M)>,
}

impl<M: Wire> Sender<M> {
    pub(super) fn declare(
        session: &zenoh::Session,
        key: String,
        source: u64,
        sequence: Arc<AtomicU64>,
    ) -> Result<Self, LinkError> {
        let publisher = session
            .declare_publisher(key)
            .priority(M::TOPIC.priority)
            .congestion_control(M::TOPIC.congestion)
            .express(M::TOPIC.express)
            .wait()
            .map_err(LinkError::zenoh("declare a publisher"))?;
        Ok(Self { publisher, source, sequence, message: PhantomData })
    }

    /// Fills in the header and sends; nobody listening is not an error, a full link drops the message.
    ///
    /// `capture_ns` is when the sensor was exposed or the state sampled, 0 where there is none. Gives back
    /// the message as sent, for the recorder. Takes some 25 us, at worst about a millisecond.
    pub fn send(&mut self, capture_ns: u64, mut message: M) -> Result<M, LinkError> {
        *message.header_mut() = Some(Header {
            source: self.source,
            sequence: self.sequence.fetch_add(1, Ordering::Relaxed) + 1,
            capture_ns,
            send_ns: monotonic_ns(),
        });
        self.publisher
            .put(message.encode_to_vec())
            .wait()
            .map_err(LinkError::zenoh("send; the session is closed"))?;
        Ok(message)
    }
}
