//! The virtual servos: eight Dynamixel XC330-T288-T behind a pseudo-terminal, for the real driver and for anyone who
//! speaks the protocol.
//!
//! ```text
//! driver ═ pseudo-terminal ═ terminal (thread, line's time) ─► chain (who answers, in which order) ─► servo ◄─► table
//!                                                                            simulated robot: feed(), goals() ┘
//! ```
//! Time is handed in, so that all but the terminal is a function of its inputs.

mod chain;
mod fault;
mod servo;
mod table;
mod terminal;

pub use chain::Chain;
pub use fault::ServoFault;
pub use servo::{JointMotion, ServoGoal, VirtualServo};
pub use terminal::{VirtualBus, VirtualBusError, VirtualBusSetup};
