//! The operator's station: from cameras or a joystick to the robot's command, with recorder and console.
//!
//! ```text
//! replay, cameras ─► sight ──┐
//!                            ├─► gather ─► solving ─► observe ─┐
//! camera nodes ─► node ──────┘                                 ├─► pilot ─► command_loop ─► Zenoh `command`
//! gamepad, console (browser) ──────────────────────────────────┘    ▲
//!                                               robot_view ◄────────┴── Zenoh `state`
//! ```
//!
//! What decides is pure (`gather`, `observe`, `map`, `stick`, `auto`, `pilot`): time and inputs come from outside.
//! Threads: capture, eyes, scout ([`sight`]), solver ([`solving`]), commands (`command_loop`), recorder, gamepad,
//! console; they meet on the [`board`], where each takes the newest and none waits for another.

pub mod auto;
pub mod board;
pub mod command_loop;
pub mod config;
pub mod console;
pub mod doctor;
pub mod gamepad;
pub mod gather;
pub mod ids;
pub mod latency;
pub mod latest;
pub mod map;
pub mod motion;
pub mod node;
pub mod observe;
pub mod pilot;
pub mod play;
pub mod poses;
pub mod record;
pub mod recorder;
pub mod replay;
pub mod report;
pub mod review;
pub mod robot_view;
pub mod run;
pub mod shown;
pub mod sight;
pub mod solving;
pub mod sources;
pub mod stick;
pub mod stop;
