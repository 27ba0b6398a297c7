//! Which mode requests are new.

use crate::{
    commander::{Command, RequestId},
    modes::Mode,
};

/// Remembers the last request of the sender that speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RequestLog {
    last: Option<RequestId>,
}

impl RequestLog {
    /// The mode asked for, once for each request. What a sender had asked for before we met it is not new:
    /// a robot that restarts does not repeat the last request.
    pub fn fresh(&mut self, command: &Command) -> Option<Mode> {
        let id = RequestId { source: command.source, number: command.mode_request };
        let before = self.last.replace(id)?;
        let is_new = before.source == id.source && before.number != id.number && id.number != 0;
        if is_new { command.mode } else { None }
    }

    /// Number of the last request.
    pub fn acknowledged(&self) -> u64 {
        self.last.map_or(0, |id| id.number)
    }
}
