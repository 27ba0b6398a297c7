//! Modes, the way between them, and what is moved on that way.
//!
//! ```text
//!            ┌────────────── lie down ◄──────────────┐
//!            ▼                                       │
//! damped ─► stand up ─► recentre ───────────────► stance ─► shift torso ─► lift foot ─► single foot or gripper
//!                          ▲                                     │           ▲ │             │
//!                          ├─────────────────────────────────────┘           │ ▼             │
//!                          └────────────────── lower foot ◄───────────────── stow ◄──────────┘
//! ```
//! From stance also, and back: unfold ─► walk, or walk and hold ─► halt; kneel ─► sit up ─► bimanual ─► sit down ─► get up.
//! What the whole-body controller tracks in each of them is a row of a [`table`].
//! [`Machine`] decides, and is a pure function of its state and inputs; [`Choreography`] moves, and where the
//! operator moves, [`Driving`] does.

mod bimanual;
mod choreography;
mod driving;
mod foot_path;
mod leg_return;
mod machine;
mod mode;
mod posture_motion;
mod scene;
mod setpoint;
mod settings;
mod shift;
pub mod table;
mod touch_down;
mod upright;
mod walking;

pub use choreography::{Choreography, Progress};
pub use driving::{Driving, Operator};
pub use machine::{Inputs, Machine, Refusal, Request, Start};
pub use mode::{Arms, Effector, Mode, Phase};
pub use scene::Scene;
pub use setpoint::{ObjectiveList, Setpoint};
pub use settings::{JointGains, MotionSettings, PoseSettings, UprightSettings};
