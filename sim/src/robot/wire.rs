//! The datagrams between `locoman-robot` and the simulated robot: `LMS1`, then the `postcard` form of a
//! [`JointCommand`] or of [`Sensors`]. Both ends are always of one build.

use locoman_robot::plant::{JointCommand, Sensors};

/// Begins every datagram; its last digit is the format's version.
pub const MAGIC: [u8; 4] = *b"LMS1";

/// Longer than any datagram of this format: 92 numbers of 8 bytes in a command.
pub const MAX_DATAGRAM: usize = 1024;

/// Writes a datagram into the buffer; nothing if it does not fit, which no message of this format does.
pub fn encode<'b, M: serde::Serialize>(message: &M, buffer: &'b mut [u8; MAX_DATAGRAM]) -> Option<&'b [u8]> {
    let (magic, body) = buffer.split_at_mut(MAGIC.len());
    magic.copy_from_slice(&MAGIC);
    let length = postcard::to_slice(message, body).ok()?.len();
    Some(&buffer[..MAGIC.len() + length])
}

/// Reads a command: any bytes give one or nothing.
pub fn decode_command(datagram: &[u8]) -> Option<JointCommand> {
    postcard::from_bytes(datagram.strip_prefix(&MAGIC)?).ok()
}

/// Reads sensors: any bytes give them or nothing.
pub fn decode_sensors(datagram: &[u8]) -> Option<Sensors> {
    postcard::from_bytes(datagram.strip_prefix(&MAGIC)?).ok()
}
