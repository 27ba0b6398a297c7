//! Messages of both sides of the link, their keys, sessions and recordings.

pub mod clock;
pub mod geometry;
pub mod keys;
pub mod link;
pub mod messages;
pub mod recording;
pub mod sequence;
pub mod topic;
pub mod validate;

pub use link::{Endpoints, Link, LinkError, Received, Sender, Subscription};
pub use sequence::{Arrival, SequenceGuard};
pub use topic::{Topic, Wire};
pub use validate::{Rejection, validate};
