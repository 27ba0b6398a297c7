//! Motions given beforehand: poses and when to be there, instead of an operator's hand.
//!
//! A trajectory holds displacements since engagement, as an operator's commands do, and goes the same way
//! through every limit; only its samples need not arrive one by one.
//!
//! ```text
//! Trajectory ──► Player: pace, time along it ──► Sample: displacements, velocities, accelerations
//! ```

mod bezier;
mod path;
mod player;

pub use bezier::Segment;
pub use path::{Sample, Trajectory, Waypoint};
pub use player::Player;
