//! The stop button: any device may press it, on any thread, and the robot latches it.

use std::sync::{Arc, Mutex};

use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{Stop, stop::Level};
use locoman_protocol::{LinkError, Sender};

use crate::board::Board;
use crate::latest::lock;
use crate::pilot::Note;

/// A second press within this time damps at once.
const SECOND_PRESS_NS: u64 = 10_000_000_000;

/// Sends stops.
#[derive(Debug)]
pub struct StopButton {
    sender: Mutex<Sender<Stop>>,
    pressed_ns: Mutex<Option<u64>>,
    board: Arc<Board>,
}

impl StopButton {
    /// Over this sender.
    pub fn new(sender: Sender<Stop>, board: Arc<Board>) -> Self {
        Self { sender: Mutex::new(sender), pressed_ns: Mutex::new(None), board }
    }

    /// First press: settle. Second press: damp. Gives back what was sent.
    pub fn press(&self) -> Level {
        let now_ns = monotonic_ns();
        let before = lock(&self.pressed_ns).replace(now_ns);
        let again = before.is_some_and(|at| now_ns.saturating_sub(at) < SECOND_PRESS_NS);
        let level = if again { Level::Damp } else { Level::Settle };
        self.send(level);
        level
    }

    /// Stops at this level, and switches the autopilot off.
    pub fn send(&self, level: Level) {
        *lock(&self.board.auto) = Some(false);
        let stop = Stop { level: level.into(), ..Stop::default() };
        let sent: Result<_, LinkError> = lock(&self.sender).send(0, stop);
        match sent {
            Ok(_) => self.board.happened(Note { name: "stop", detail: level.as_str_name().to_owned() }),
            Err(error) => tracing::error!("the stop could not be sent: {error}"),
        }
    }
}
