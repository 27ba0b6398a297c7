//! The servos of arms and grippers: eight Dynamixel XC330-T288-T on one half-duplex bus.
//!
//! ```text
//!  send(commands) ─► slot ─► driver's thread, 200 Hz: goals in counts ─► sync write ─► line ═══ bus ═══ servos
//!  latest()       ◄─ slot ◄─ angles, currents, health, losses ◄──────── sync read  ◄──┘
//! ```
//! `wire` is bytes, `line` the port, `bus` one exchange, `registers` the servos' table, `driver` the thread,
//! `cli` what a person who assembles the hand runs. The driver never ends by itself: what is lost is counted and told.

mod angles;
mod bus;
pub mod cli;
mod driver;
mod error;
mod line;
mod member;
mod place;
pub mod registers;
mod settings;
mod state;
mod station;
pub mod wire;
mod zeros;

pub use angles::Angles;
pub use bus::{Bus, Found};
pub use driver::ServoDriver;
pub use error::ServoError;
pub use line::{Line, SerialLine, find_port, latency_timer_ms, readable};
pub use place::{NoPlace, Part, Place, SERVOS};
pub use settings::{
    AUTO_PORT, Gains, Gripper, Limb, Motor, ReadKind, ServoSettings, Watch, default_zeros_file,
};
pub use state::{LineCounts, ServoCommand, ServoState, ServoStates, commands_of};
pub use zeros::{Zero, Zeros};
