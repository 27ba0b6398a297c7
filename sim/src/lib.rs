//! The stand-in world: a simulated robot, a rendered operator, and the evaluations that use both.
//!
//! ```text
//!  operator ──► recording with truth ──► (vision, teleop)  …  (robot) ◄──► robot (MuJoCo)
//!                      └────────────── eval ──────────────────────────────────┘
//! ```

pub mod eval;
pub mod operator;
pub mod robot;
pub mod servo_bus;
