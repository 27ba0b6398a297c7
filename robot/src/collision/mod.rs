//! Self-collision: links as capsules, the pairs of them that can meet, and how far those are apart.
//!
//! ```text
//! collision.toml ──► shapes on links ──► pairs that can meet ──► those that are near ──► distance, gradient
//!                                        chosen once             by spheres about them   for each posture
//! ```
//! The whole-body controller stops links before they touch, the commander keeps targets out of the robot.

mod capsule;
mod links;
mod model;

pub use capsule::{Capsule, Separation, separation};
pub use links::{Link, Part};
pub use model::{Clearance, Clearances, CollisionModel, MOST_NEAR, Pair, Shape};
