//! From images to 6D poses of tag-covered shells.
//!
//! ```text
//!  source ──► FrameSet ──► detect ────────► pose ─────────► track ──────► TrackUpdate
//!  recording  frames       expected tags    one shell from  filter,       poses, verdicts,
//!  folder     exposed      are read, what   all corners in  prediction,   covariances,
//!  video      together     is lost is       all views, each verdict,      tags, durations
//!  device                  searched         at its own time motions ─────┐
//!                             ▲                                          │
//!                             └──────────────────────────────────────────┘
//!  rig (cameras) and shells (tags) come from files: `configs/rigs`, `configs/shells`
//! ```
//!
//! Entry points: [`Rig::load`](rig::Rig::load), [`ShellSet::load`](shells::ShellSet::load),
//! [`FrameSets`](source::FrameSets) over a [`FrameSource`](source::FrameSource),
//! [`Tracker::update`](track::Tracker::update).
//!
//! Conventions: metres, radians, nanoseconds; `world_from_shell` maps points of the shell to the world;
//! pixel centres at integers; corners of a tag in the order bottom left, bottom right, top right, top left.

pub mod camera;
mod cholesky;
pub mod config;
pub mod detect;
pub mod image;
pub mod pose;
pub mod rig;
pub mod shells;
pub mod source;
pub mod track;
mod vector;

#[cfg(test)]
mod testing;
