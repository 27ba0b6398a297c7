//! Collisions: links as capsules, the pairs of them that can meet, how far those are apart, and how far links are
//! above the ground.
//!
//! ```text
//! collision.toml ──► shapes on links ──► pairs that can meet ──► those that are near ──► distance, gradient
//!                                        chosen once             by spheres about them   for each posture
//! ```
//! The whole-body controller stops links before they touch, the commander keeps targets out of the robot.

mod capsule;
mod ground;
mod links;
mod model;

pub use capsule::{Capsule, Separation, separation};
pub use ground::{Altitude, Ground, height_under};
pub use links::{Link, Part};
pub use model::{Clearance, Clearances, CollisionModel, MOST_NEAR, Pair, Shape};
