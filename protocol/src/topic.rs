//! What travels on which key, and how urgently: the quality-of-service table of the whole system.
//!
//! Every stream is `Drop`: a late sample is worth less than the next one, and `Block` may hold the sender
//! for seconds and then close the transport. Every stream but the event log is express, that is sent at
//! once and not batched: batching costs small messages their latency.

use crate::messages::{
    ClockPing, ClockPong, Detections, Event, Header, Motions, OperatorCommand, RobotState, SimTruth, Stop,
    Tracking,
};
pub use zenoh::qos::{CongestionControl, Priority};

/// How one message type travels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topic {
    /// The last part of the key `locoman/1/<robot>/<suffix>`; recordings use `/<suffix>`.
    pub suffix: &'static str,
    /// Whether each sender has a name below the suffix, as in `detections/<camera>`.
    pub named: bool,
    /// Which messages overtake which on a busy link.
    pub priority: Priority,
    /// What happens when the link is full.
    pub congestion: CongestionControl,
    /// Sent at once, not batched.
    pub express: bool,
    /// Longer messages are dropped undecoded, and counted.
    pub max_bytes: usize,
}

impl Topic {
    const fn stream(suffix: &'static str, priority: Priority, max_bytes: usize) -> Self {
        let congestion = CongestionControl::Drop;
        Self { suffix, named: false, priority, congestion, express: true, max_bytes }
    }

    /// The topic's name in a recording.
    pub fn recording_name(&self) -> String {
        format!("/{}", self.suffix)
    }
}

/// A message that goes over the link: it has a [`Topic`] and opens with a [`Header`].
pub trait Wire: prost::Name + Default + Send + 'static {
    /// How it travels.
    const TOPIC: Topic;

    /// Who sent it and when, if the sender said so.
    fn header(&self) -> Option<&Header>;

    /// For the sender to fill in.
    fn header_mut(&mut self) -> &mut Option<Header>;
}

macro_rules! wire {
    ($($message:ty: $topic:expr;)*) => {$(
        impl Wire for $message {
            const TOPIC: Topic = $topic;

            fn header(&self) -> Option<&Header> {
                self.header.as_ref()
            }

            fn header_mut(&mut self) -> &mut Option<Header> {
                &mut self.header
            }
        }
    )*};
}

/// Enough for a command with a trajectory of 32 poses of three bodies (8 kB), with room for fields to come.
pub(crate) const COMMAND_MAX_BYTES: usize = 16 * 1024;
const STATE_MAX_BYTES: usize = 64 * 1024;
const CLOCK_MAX_BYTES: usize = 256;

wire! {
    OperatorCommand: Topic::stream("command", Priority::RealTime, COMMAND_MAX_BYTES);
    Stop: Topic::stream("stop", Priority::RealTime, COMMAND_MAX_BYTES);
    RobotState: Topic::stream("state", Priority::InteractiveHigh, STATE_MAX_BYTES);
    Detections: Topic { named: true, ..Topic::stream("detections", Priority::InteractiveHigh, STATE_MAX_BYTES) };
    Motions: Topic::stream("motions", Priority::InteractiveHigh, STATE_MAX_BYTES);
    // Nothing waits before them: what they measure is the way.
    ClockPing: Topic::stream("clock_ping", Priority::RealTime, CLOCK_MAX_BYTES);
    ClockPong: Topic::stream("clock_pong", Priority::RealTime, CLOCK_MAX_BYTES);
    SimTruth: Topic::stream("truth", Priority::InteractiveLow, STATE_MAX_BYTES);
    Tracking: Topic::stream("tracking", Priority::DataHigh, STATE_MAX_BYTES);
    Event: Topic { express: false, ..Topic::stream("event", Priority::DataLow, STATE_MAX_BYTES) };
}
