//! Dynamixel Protocol 2.0: bytes only, no port. Both sides of the wire are made from it, the driver's and the
//! virtual servo's.
//!
//! ```text
//! FF FF FD 00 | id | length | instruction | parameters … | CRC-16      (little-endian)
//!                             └───── stuffed ──────────┘
//! ```
//! `length` counts from the instruction to the end. Source: the maker's manual, "DYNAMIXEL Protocol 2.0".

pub mod crc;
pub mod fast;
pub mod instruction;
pub mod packet;
pub mod scanner;
pub mod status;
pub mod timing;

#[cfg(test)]
mod examples;
#[cfg(test)]
mod mutations;

pub use instruction::{Instruction, Request};
pub use packet::Packet;
pub use scanner::Scanner;
pub use status::{HardwareError, Refusal, Status};

/// Begins every packet.
pub const HEADER: [u8; 4] = [0xFF, 0xFF, 0xFD, 0x00];
/// What in a packet's inside would look like the beginning of another; an `FD` is stuffed in behind it.
const MARK: [u8; 3] = [0xFF, 0xFF, 0xFD];
const STUFFING: u8 = 0xFD;
/// All servos at once.
pub const BROADCAST: u8 = 0xFE;
/// The highest id of a servo.
pub const MAX_ID: u8 = 252;
/// Bytes from the header to the instruction.
const HEAD_BYTES: usize = 7;
/// Bytes of a packet without parameters.
pub const EMPTY_PACKET_BYTES: usize = HEAD_BYTES + 3;
/// Longest packet that is taken in. The longest of this program has 166 bytes; a damaged length must not make us
/// wait for 64 KiB.
pub const MAX_PACKET_BYTES: usize = 1024;
