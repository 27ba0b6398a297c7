//! Drops messages that come twice or late, and tells when another sender speaks.

use crate::messages::Header;

/// Senders remembered; of more, the one heard first is forgotten.
const REMEMBERED: usize = 8;

/// What a header means after those seen before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrival {
    /// The next one of the source that spoke last.
    Next,
    /// New, but from another source than the one before (or the first ever): engagements end here.
    NewSource,
    /// Seen before, or overtaken by a later one: drop it.
    Stale {
        /// Its number.
        sequence: u64,
        /// The highest number seen of its source.
        last: u64,
    },
}

/// Judges each message by its source and sequence number. Allocates nothing.
///
/// It remembers several sources: a replay of an earlier session's messages stays a replay after another
/// source has spoken.
#[derive(Debug, Clone, Default)]
pub struct SequenceGuard {
    sources: [Option<Seen>; REMEMBERED],
    current: Option<u64>,
    oldest: usize,
}

#[derive(Debug, Clone, Copy)]
struct Seen {
    source: u64,
    last: u64,
}

impl SequenceGuard {
    /// Judges a header and remembers it.
    pub fn check(&mut self, header: &Header) -> Arrival {
        let Header { source, sequence, .. } = *header;
        if let Some(seen) = self.sources.iter_mut().flatten().find(|seen| seen.source == source) {
            if sequence <= seen.last {
                return Arrival::Stale { sequence, last: seen.last };
            }
            seen.last = sequence;
        } else {
            if let Some(place) = self.sources.get_mut(self.oldest) {
                *place = Some(Seen { source, last: sequence });
            }
            self.oldest = (self.oldest + 1) % REMEMBERED;
        }
        if self.current.replace(source) == Some(source) { Arrival::Next } else { Arrival::NewSource }
    }

    /// Who spoke last.
    pub fn source(&self) -> Option<u64> {
        self.current
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn header(source: u64, sequence: u64) -> Header {
        Header { source, sequence, capture_ns: 0, send_ns: 0 }
    }

    #[test]
    fn replays_and_reordered_messages_are_dropped_and_gaps_are_not() {
        let mut sut = SequenceGuard::default();
        assert_eq!(sut.check(&header(1, 5)), Arrival::NewSource);
        assert_eq!(sut.check(&header(1, 6)), Arrival::Next);
        assert_eq!(sut.check(&header(1, 6)), Arrival::Stale { sequence: 6, last: 6 });
        assert_eq!(sut.check(&header(1, 9)), Arrival::Next);
        assert_eq!(sut.check(&header(1, 7)), Arrival::Stale { sequence: 7, last: 9 });
    }

    #[test]
    fn a_restarted_sender_is_a_new_source_and_its_past_stays_a_replay() {
        let mut sut = SequenceGuard::default();
        sut.check(&header(1, 100));
        assert_eq!(sut.check(&header(2, 1)), Arrival::NewSource);
        assert_eq!(sut.source(), Some(2));
        assert_eq!(sut.check(&header(1, 50)), Arrival::Stale { sequence: 50, last: 100 });
        assert_eq!(sut.check(&header(2, 2)), Arrival::Next);
        assert_eq!(sut.check(&header(1, 101)), Arrival::NewSource);
    }

    proptest! {
        #[test]
        fn of_one_source_only_rising_numbers_pass(numbers in prop::collection::vec(any::<u64>(), 1..60)) {
            let mut sut = SequenceGuard::default();
            let passed: Vec<_> = numbers
                .into_iter()
                .filter(|&n| !matches!(sut.check(&header(3, n)), Arrival::Stale { .. }))
                .collect();
            prop_assert!(passed.is_sorted_by(|a, b| a < b));
        }
    }
}
