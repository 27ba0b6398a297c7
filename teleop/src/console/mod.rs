//! The console: a page in the browser, served by the station itself; no other network is needed.
//!
//! ```text
//! board ──► status (JSON, 20 Hz) ────────────────► browser: 3D view, tables, curves
//! rig, shells ──► operator.json (once) ──────────► browser: the cloud of tags, the cameras
//! board ──► preview (JPEG and overlay, 8 Hz) ────► browser: camera images
//! board ◄── requests (dead-man and sticks, modes, autopilot, stop) ── browser
//! ```
//!
//! Runs on a runtime of its own; nothing else waits for it. A browser that cannot keep up gets less, never
//! older. What a browser says counts for 150 ms: see [`crate::board::Board::browser`].

mod client;
mod operator;
mod preview;
mod request;
mod server;
mod status;

use std::path::PathBuf;
use std::sync::Arc;

use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;

use crate::board::Board;
use crate::config;
use crate::stop::StopButton;

pub use server::{Server, start};

/// What the console shows and reaches.
#[derive(Debug)]
pub struct Console {
    /// The newest of everything.
    pub board: Arc<Board>,
    /// Stops the robot.
    pub stop: Arc<StopButton>,
    /// Cameras and shells, to draw them; `None` without a tracker.
    pub view: Option<(Rig, ShellSet)>,
    /// Rates.
    pub config: config::Console,
    /// A robot silent for longer is shown as silent.
    pub silent_ms: u64,
    /// The robot's picture.
    pub urdf: PathBuf,
    /// This station's id on the link: to tell whom the robot obeys.
    pub source: u64,
}
