//! The whole system under test: the real programs, over real sockets, on ports of their own.
//!
//! The programs come from cargo's target folder: `cargo build --workspace --bins` builds them
//! (`cargo xtask test` does so first).

pub mod observer;
pub mod programs;
pub mod relay;
pub mod system;

pub use observer::Observer;
pub use relay::Relay;
pub use system::{Part, System, Wires};
