//! The datagrams between `locoman-robot` and the simulated robot.
//!
//! A datagram is the four bytes [`MAGIC`], then the `postcard` form of a [`JointCommand`] (robot to
//! simulator) or of [`Sensors`] (simulator to robot). The real robot has bytes of its own; this is no
//! public format, and both ends are always of one build.

use serde::{Serialize, de::DeserializeOwned};

use super::{JointCommand, Sensors};

/// Begins every datagram; its last digit is the format's version.
pub const MAGIC: [u8; 4] = *b"LMS1";

/// Longer than any datagram of this format: 90 numbers of 8 bytes and 2 openings in a command.
pub const MAX_DATAGRAM: usize = 1024;

/// A message of this wire.
pub trait Datagram: Serialize + DeserializeOwned {
    /// Whether every number is finite.
    fn is_finite(&self) -> bool;
}

impl Datagram for JointCommand {
    fn is_finite(&self) -> bool {
        Self::is_finite(self)
    }
}

impl Datagram for Sensors {
    /// Sensors may lie: what is not finite is the supervisor's business, not the wire's.
    fn is_finite(&self) -> bool {
        true
    }
}

/// Why bytes are not a message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// It begins with something else.
    #[error(
        "a datagram that does not begin with LMS1: is another program, or another version, on this port?"
    )]
    Magic,
    /// The body is cut off or malformed.
    #[error("a datagram of {bytes} bytes does not decode: {source}")]
    Body {
        /// Its length.
        bytes: usize,
        /// What the decoder said.
        source: postcard::Error,
    },
    /// Numbers that are not finite.
    #[error("a datagram holds numbers that are not finite")]
    NotFinite,
    /// It does not fit the buffer.
    #[error("the datagram does not fit {MAX_DATAGRAM} bytes: {0}")]
    TooLong(postcard::Error),
}

/// Writes a datagram into the buffer and returns its bytes. Allocates nothing.
pub fn encode<'b, M: Datagram>(
    message: &M,
    buffer: &'b mut [u8; MAX_DATAGRAM],
) -> Result<&'b [u8], WireError> {
    let (magic, body) = buffer.split_at_mut(MAGIC.len());
    magic.copy_from_slice(&MAGIC);
    let length = postcard::to_slice(message, body).map_err(WireError::TooLong)?.len();
    Ok(&buffer[..MAGIC.len() + length])
}

/// Reads a datagram: any bytes give a message or an error. Allocates nothing.
pub fn decode<M: Datagram>(datagram: &[u8]) -> Result<M, WireError> {
    let body = datagram.strip_prefix(&MAGIC).ok_or(WireError::Magic)?;
    let message: M =
        postcard::from_bytes(body).map_err(|source| WireError::Body { bytes: datagram.len(), source })?;
    if message.is_finite() { Ok(message) } else { Err(WireError::NotFinite) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_command_survives_the_wire() {
        let mut command = JointCommand::damping();
        command.position[7] = -1.25;
        let mut buffer = [0; MAX_DATAGRAM];
        let bytes = encode(&command, &mut buffer).unwrap();
        assert_eq!(decode::<JointCommand>(bytes), Ok(command));
    }

    #[test]
    fn a_command_with_a_number_that_is_none_is_refused() {
        let mut command = JointCommand::damping();
        command.torque[3] = f64::NAN;
        let mut buffer = [0; MAX_DATAGRAM];
        let bytes = encode(&command, &mut buffer).unwrap();
        assert_eq!(decode::<JointCommand>(bytes), Err(WireError::NotFinite));
    }

    proptest! {
        #[test]
        fn any_bytes_give_a_message_or_an_error(mut bytes in prop::collection::vec(any::<u8>(), 0..MAX_DATAGRAM), magic: bool) {
            if magic && bytes.len() >= 4 {
                bytes[..4].copy_from_slice(&MAGIC);
            }
            let _ = decode::<JointCommand>(&bytes);
            let _ = decode::<Sensors>(&bytes);
        }
    }
}
