//! Bundle adjustment: cameras, object and motion together, from where points were seen.
//!
//! ```text
//! Problem: eyes ─┐                       ┌─► whitened residuals, derivatives (term)
//!          parts ├─► adjust: each step ──┤                                          ─► Outcome: covariances, variance
//!          motion┘                       └─► banded, bordered normal equations (normal)
//! ```
//!
//! One solver serves intrinsics (one fixed camera, a pose a view), extrinsics (a path, clocks, line times) and shells
//! (tags that may move): what is free is data ([`EyeLoose`], [`Part::loose`]).
//!
//! Conventions: metres, radians, seconds, pixels; `world_from_object` maps points of the object to the world; rotations
//! are perturbed on the right.

mod columns;
pub mod lens;
mod motion;
mod normal;
mod problem;
mod rotation;
mod solve;
mod term;

pub use motion::{Motion, Path};
pub use problem::{Eye, EyeLoose, FIXED, FREE, Loose, POINTS, Part, Problem, Sighting};
pub use solve::{Outcome, Settings, adjust, cameras, errors_px};

#[cfg(test)]
mod tests;
