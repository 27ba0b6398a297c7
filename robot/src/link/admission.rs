//! Which commands get to the control loop.

use locoman_protocol::{Arrival, Rejection, SequenceGuard, messages::OperatorCommand, validate};

/// Judgement of a command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ruling {
    /// To be acted on.
    Accepted,
    /// It holds something that cannot be used.
    Invalid(Rejection),
    /// Seen before, or overtaken by a later one.
    Stale,
    /// Another source is at work.
    Occupied {
        /// Whose robot it is.
        owner: u64,
    },
}

/// One station moves the robot at a time; another may when the first has been silent for a while.
#[derive(Debug)]
pub struct Admission {
    guard: SequenceGuard,
    source_stale_ns: u64,
    owner: Option<Owner>,
}

#[derive(Debug, Clone, Copy)]
struct Owner {
    source: u64,
    heard_ns: u64,
}

impl Admission {
    /// A source silent for `source_stale_ns` may be followed by another.
    pub fn new(source_stale_ns: u64) -> Self {
        Self { guard: SequenceGuard::default(), source_stale_ns, owner: None }
    }

    /// Judges a command and remembers it.
    pub fn judge(&mut self, command: &OperatorCommand, received_ns: u64) -> Ruling {
        if let Err(rejection) = validate(command) {
            return Ruling::Invalid(rejection);
        }
        let header = command.header.unwrap_or_default();
        if let Some(owner) = self.owner
            && owner.source != header.source
            && received_ns.saturating_sub(owner.heard_ns) < self.source_stale_ns
        {
            return Ruling::Occupied { owner: owner.source };
        }
        match self.guard.check(&header) {
            Arrival::Stale { .. } => Ruling::Stale,
            Arrival::Next | Arrival::NewSource => {
                self.owner = Some(Owner { source: header.source, heard_ns: received_ns });
                Ruling::Accepted
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use locoman_protocol::messages::Header;

    use super::*;

    const MS: u64 = 1_000_000;

    fn command(source: u64, sequence: u64) -> OperatorCommand {
        OperatorCommand {
            header: Some(Header { source, sequence, capture_ns: 0, send_ns: 0 }),
            ..OperatorCommand::default()
        }
    }

    #[test]
    fn r_safe_008_a_second_station_is_turned_away_while_the_first_speaks() {
        let mut sut = Admission::new(1_000 * MS);
        assert_eq!(sut.judge(&command(1, 1), 0), Ruling::Accepted);
        assert_eq!(sut.judge(&command(2, 1), 10 * MS), Ruling::Occupied { owner: 1 });
        assert_eq!(sut.judge(&command(1, 2), 500 * MS), Ruling::Accepted);
        assert_eq!(sut.judge(&command(2, 2), 1_499 * MS), Ruling::Occupied { owner: 1 });
        assert_eq!(sut.judge(&command(2, 3), 1_500 * MS), Ruling::Accepted);
        assert_eq!(sut.judge(&command(1, 3), 1_501 * MS), Ruling::Occupied { owner: 2 });
    }

    #[test]
    fn r_safe_009_replayed_and_ill_formed_commands_are_turned_away() {
        let mut sut = Admission::new(1_000 * MS);
        assert_eq!(sut.judge(&command(1, 5), 0), Ruling::Accepted);
        assert_eq!(sut.judge(&command(1, 5), 1), Ruling::Stale);
        let broken = OperatorCommand { right_opening: Some(f64::NAN), ..command(1, 6) };
        assert!(matches!(sut.judge(&broken, 2), Ruling::Invalid(_)));
    }
}
