//! The Unitree Go1: its low-level datagrams, and the line that they travel on.
//!
//! ```text
//! JointCommand ─► limits ─► driver ══ feed ══► sender: watchdog ─► line ═══ UDP ═══► motor board
//!      Sensors ◄─ feet ◄───── driver ◄═ feed ═══ sender: sample_clock ◄─ line ◄══ UDP ══════┘
//!                 controller's process          a process of its own (apart)
//! ```
//! The datagrams ([`command`], [`state`], [`checksum`], [`remote`]) are
//! little-endian and packed. A command has 614 bytes; a state has 820, of which 807 have a known meaning.
//! Twenty motor slots travel, the first twelve are the legs' joints in the order of [`crate::joints`].
//! Every datagram ends with a [`checksum`]; what it does not fit is refused before it is looked at.

pub mod apart;
mod bytes;
pub mod checksum;
pub mod command;
pub mod driver;
mod feed;
mod feet;
mod limits;
mod line;
pub mod remote;
mod sample_clock;
pub mod sender;
mod settings;
pub mod state;
mod watchdog;

pub use checksum::Checksum;
pub use command::{LowCommand, MOTORS, MotorCommand};
pub use driver::Driver;
pub use feed::Report;
pub use feet::Feet;
pub use limits::Limits;
pub use line::LineCounts;
pub use remote::Remote;
pub use settings::Go1Settings;
pub use state::{Battery, LowState, MotorMode, MotorState};
pub use watchdog::{Verdict, WatchdogSettings, asks_for_damping};

/// Motor slots of a datagram.
pub const SLOTS: usize = 20;
/// Begins every datagram.
const HEAD: [u8; 2] = [0xFE, 0xEF];

/// Why bytes are not a datagram of the Go1's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DatagramError {
    /// Too few bytes.
    #[error("a datagram of {bytes} bytes, {needed} are needed: does another program use this port?")]
    Short {
        /// Its length.
        bytes: usize,
        /// The least length.
        needed: usize,
    },
    /// It begins with something else.
    #[error("a datagram begins with {0:02x?} in place of fe ef: does another program use this port?")]
    Head([u8; 2]),
    /// The checksum is neither the plain nor the encrypted one.
    #[error(
        "a datagram ends with checksum {found:08x}, its bytes have {computed:08x}: look at cable and switch"
    )]
    Checksum {
        /// What stands at its end.
        found: u32,
        /// The plain checksum of its bytes.
        computed: u32,
    },
}

/// The datagram's first `N` bytes and how their checksum is written, if head and checksum are right.
fn checked<const N: usize>(datagram: &[u8]) -> Result<(&[u8; N], Checksum), DatagramError> {
    let short = DatagramError::Short { bytes: datagram.len(), needed: N };
    let raw = datagram.first_chunk::<N>().ok_or(short)?;
    let head = bytes::take(raw, 0);
    if head != HEAD {
        return Err(DatagramError::Head(head));
    }
    let found = u32::from_le_bytes(bytes::take(raw, N - 4));
    let computed = checksum::of_words(raw);
    let kind = Checksum::of(found, computed).ok_or(DatagramError::Checksum { found, computed })?;
    Ok((raw, kind))
}
