//! The simulated robot: MuJoCo behind the same boundary as the real one.
//!
//! ```text
//! configs/robot ─► body ─► mjcf, rubber ─► world (MuJoCo) ◄─► drives, servo ◄─► machine ◄─► lockstep (tests)
//!  (URDF, drives)                              ▲                               noise         server (UDP, Zenoh)
//! configs/scenes/robot.toml: all of them       └─ disturbance
//! ```
//! What a profile of the scene file makes imperfect: the masses (`body`), friction and play (`mjcf`), the feet
//! (`rubber`), the servos (`servo`), the wire (`go1_wire`), the sensors (`noise`).

pub mod board;
pub mod body;
pub mod command;
pub mod disturbance;
mod disturbed;
pub mod drives;
mod error;
pub mod go1_wire;
pub mod jaws;
pub mod lockstep;
pub mod machine;
pub mod mjcf;
pub mod noise;
pub mod profile;
pub mod publish;
mod rubber;
pub mod scene;
pub mod server;
pub mod servo;
pub mod shapes;
pub mod terrain;
pub mod world;

pub use command::{Args, run};
pub use disturbance::{Disturbance, Target};
pub use error::SimRobotError;
pub use lockstep::LockstepPlant;
pub use machine::{Options, SimRobot};
pub use terrain::Terrain;
pub use world::Truth;

/// One exchange: the control period of the robot.
pub const EXCHANGE_S: f64 = 0.0025;
/// The same in nanoseconds.
pub const EXCHANGE_NS: u64 = 2_500_000;
/// Longest command latency that a profile may ask for, s.
pub const MAX_LATENCY_S: f64 = 0.05;
