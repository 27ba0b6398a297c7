//! The messages of both sides of the link, the keys they travel on, the sessions that carry them, and the
//! recordings that keep them: one protobuf schema for wire and file.
//!
//! ```text
//!    operator's station                                             robot
//!  ┌────────────────────┐  command   OperatorCommand   60-120 Hz  ┌───────────────┐
//!  │ tracker, joystick, │ ──────────────────────────────────────► │ supervisor,   │
//!  │ browser            │  stop      Stop              any client │ controller    │
//!  │                    │ ──────────────────────────────────────► │               │
//!  │ console, recorder  │  state     RobotState           100 Hz  │               │
//!  │                    │ ◄────────────────────────────────────── │               │
//!  └────────────────────┘                                         └───────────────┘
//!     ▲   ▲         ▲
//!     │   │         │      truth     SimTruth             100 Hz  ┌───────────────┐
//!     │   │         └──────────────────────────────────────────── │ simulator     │
//!     │   │                                                       └───────────────┘
//!     │   │ detections/<camera>      Detections       each frame  ┌───────────────┐
//!     │   └────────────────────────────────────────────────────── │ camera nodes  │
//!     │          motions                  Motions     each solve  │               │
//!     │     ────────────────────────────────────────────────────► │               │
//!     │          clock_ping, clock_pong               5 Hz        │               │
//!     │     ◄───────────────────────────────────────────────────► └───────────────┘
//!     └ tracking, event              Tracking, Event              (within the station)
//! ```
//!
//! Keys are `locoman/1/<robot>/<suffix>`. How each travels:
//!
//! | suffix | priority | when the link is full | express | longest |
//! |---|---|---|---|---|
//! | `command`, `stop` | real time | drop | yes | 16 KiB |
//! | `clock_ping`, `clock_pong` | real time | drop | yes | 256 B |
//! | `state`, `detections/*`, `motions` | interactive high | drop | yes | 64 KiB |
//! | `truth` | interactive low | drop | yes | 64 KiB |
//! | `tracking` | data high | drop | yes | 64 KiB |
//! | `event` | data low | drop | no | 64 KiB |
//!
//! What a receiver may rely on: bytes decode to a message or are counted and dropped ([`Subscription`]); every
//! message opens with a [`messages::Header`] that tells source, sequence and times. What it has to ask for
//! itself: whether the numbers are numbers ([`validate()`]), whether it is new ([`SequenceGuard`]), and how old
//! it is ([`Received::received_ns`] against [`clock::monotonic_ns`]).
//!
//! # Example
//! ```no_run
//! use locoman_protocol::messages::{OperatorCommand, RobotState};
//! use locoman_protocol::{Endpoints, Link, LinkError};
//!
//! # fn main() -> Result<(), LinkError> {
//! let link = Link::open("go1", &Endpoints::connect(&["tcp/127.0.0.1:7447"]))?;
//! let _states = link.subscribe(|state: locoman_protocol::Received<RobotState>| {
//!     println!("{} at {} ns", state.message.phase, state.received_ns);
//! })?;
//! let mut commands = link.sender::<OperatorCommand>()?;
//! commands.send(0, OperatorCommand { engagement: 0, ..OperatorCommand::default() })?;
//! # Ok(())
//! # }
//! ```

pub mod clock;
pub mod geometry;
pub mod keys;
pub mod link;
pub mod messages;
pub mod offset;
pub mod pace;
pub mod realtime;
pub mod recording;
pub mod sequence;
pub mod topic;
pub mod trajectory;
pub mod validate;

pub use link::{Endpoints, Link, LinkError, Received, Sender, Subscription};
pub use sequence::{Arrival, SequenceGuard};
pub use topic::{Topic, Wire};
pub use validate::{Rejection, validate};
