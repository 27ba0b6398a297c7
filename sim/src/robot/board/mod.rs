//! The virtual Go1: the simulated robot behind the very datagrams of the real one.
//!
//! ```text
//!  UDP ─► gauntlet ─► mainboard ─► SimRobot (MuJoCo, the motors' law at 2 kHz) ─► mainboard ─► gauntlet ─► UDP
//!          faults      latches                                        states at 1 kHz         faults
//! ```
//! It does what is known of the real board: it says nothing before the first good command, answers whoever spoke
//! last, takes nothing with a wrong length, head or checksum, and keeps its last command until it is told another.

mod arms;
mod fault;
mod gauntlet;
mod hosted;
mod mainboard;
mod serve;

pub use arms::VirtualArms;
pub use fault::{Fault, Faults, Planned};
pub use hosted::{HostedRobot, ServoLine, VirtualRobot};
pub use mainboard::Mainboard;
pub use serve::{Heard, Host, STATE_NS, serve};
