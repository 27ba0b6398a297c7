//! The program's subcommands, one file each: its arguments and what it prints.
//!
//! To add one: a file with `Args` and `run`, and a variant of [`Command`].

mod body;
mod check;
mod export;
mod extrinsics;
mod import;
mod intrinsics;
mod print;
mod shells;

use std::path::{Path, PathBuf};

use body::Body;
use clap::Subcommand;
use indicatif::{ProgressBar, ProgressStyle};

/// What the program can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Check a rig file and a shells file, alone or against a recording.
    Check(check::Args),
    /// Find focal lengths, centre and distortion of cameras from pictures of a board.
    Intrinsics(intrinsics::Args),
    /// Find where cameras stand, their clocks and rows, from a recording of a waved board or shell.
    Extrinsics(extrinsics::Args),
    /// Find where the tags of a shell really are, from a recording of the waved shell.
    Shells(shells::Args),
    /// Write a rig (and a board) in a format of others: Kalibr, ROS.
    Export(export::Args),
    /// Make a rig or board file from one of others: ZED, Kalibr, OpenCV, ROS.
    Import(import::Args),
    /// Print boards, tag sheets and shells: SVG and PDF at true scale, STL, and the files that describe them.
    Print(print::Args),
}

/// Runs a command; `configs` is the folder of rigs and shells.
pub fn run(command: &Command, configs: &Path) -> anyhow::Result<()> {
    match command {
        Command::Check(args) => check::run(args, configs),
        Command::Intrinsics(args) => intrinsics::run(args, configs),
        Command::Extrinsics(args) => extrinsics::run(args, configs),
        Command::Shells(args) => shells::run(args, configs),
        Command::Export(args) => export::run(args),
        Command::Import(args) => import::run(args),
        Command::Print(args) => print::run(args, configs),
    }
}

/// The file that was named, or the default one of the configs folder.
fn or_default(path: Option<&Path>, configs: &Path, default: &str) -> PathBuf {
    path.map_or_else(|| configs.join(default), Path::to_owned)
}

/// A counter on stderr; nothing where there is no terminal.
fn progress(of: &'static str) -> ProgressBar {
    let bar = ProgressBar::no_length();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {pos} {prefix} {msg}") {
        bar.set_style(style);
    }
    bar.with_prefix(of)
}
