//! From what the operator wants to what each body should do now.
//!
//! ```text
//! Command ──► Engagement ──► anchor, Ramp ──► PoseFollower ──► Limits, Reach ───► PoseFollower ──► PoseReference
//!             who moves it   DrivenBody       at the body's    range, reach,      the same way     pose, velocity,
//!                                             own pace         over the feet      or along limits  acceleration
//! ```

mod body;
mod command;
mod engagement;
mod follower;
mod foot_reach;
mod limits;
mod quintic;
mod ramp;
mod reach;
mod reference;
mod support;
mod torso_reach;

pub use body::DrivenBody;
pub use command::{Command, EngagementId, RequestId};
pub use engagement::{Engagement, Grip};
pub use follower::PoseFollower;
pub use foot_reach::FootReach;
pub use limits::{LimbRange, Limits, Range, RateLimits, ReachRange, TorsoRange, WalkingLimits};
pub use quintic::{PointMotion, PoseMotion, RotationMotion};
pub use ramp::{Ramp, SampleClock};
pub use reach::{LimbReference, Reach};
pub use reference::{PoseReference, rebased_point};
pub use support::{deepest_margin, from_above, push_inside};
pub use torso_reach::{Footing, TorsoReach};
