//! Numbers that name engagements and mode requests: never 0, never used twice, also not by the station that
//! is started next.

use std::time::{SystemTime, UNIX_EPOCH};

/// Gives out rising numbers that start at the wall clock's microseconds.
///
/// A robot that outlives this station still sees the next station's first number as new.
#[derive(Debug)]
pub struct Ids {
    last: u64,
}

impl Ids {
    /// Starts from the wall clock.
    pub fn new() -> Self {
        let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { last: u64::try_from(since_epoch.as_micros()).unwrap_or(0) }
    }

    /// The next number.
    pub fn next_id(&mut self) -> u64 {
        self.last = self.last.wrapping_add(1).max(1);
        self.last
    }
}

impl Default for Ids {
    fn default() -> Self {
        Self::new()
    }
}
