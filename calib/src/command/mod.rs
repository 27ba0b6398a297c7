//! The program's subcommands, one file each: its arguments and what it prints.
//!
//! To add one: a file with `Args` and `run`, and a variant of [`Command`].

mod body;
mod check;
mod extrinsics;
mod intrinsics;
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
}

/// Runs a command; `configs` is the folder of rigs and shells.
pub fn run(command: &Command, configs: &Path) -> anyhow::Result<()> {
    match command {
        Command::Check(args) => check::run(args, configs),
        Command::Intrinsics(args) => intrinsics::run(args, configs),
        Command::Extrinsics(args) => extrinsics::run(args, configs),
        Command::Shells(args) => shells::run(args, configs),
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
