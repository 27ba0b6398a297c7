//! The program's subcommands, one file each: its arguments and what it prints.
//!
//! To add one: a file with `Args` and `run`, and a variant of [`Command`].

mod check;
mod export;
mod import;
mod print;

use std::path::{Path, PathBuf};

use clap::Subcommand;

/// What the program can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Check a rig file and a shells file, and say what is in them.
    Check(check::Args),
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
        Command::Export(args) => export::run(args),
        Command::Import(args) => import::run(args),
        Command::Print(args) => print::run(args, configs),
    }
}

/// The file that was named, or the default one of the configs folder.
fn or_default(path: Option<&Path>, configs: &Path, default: &str) -> PathBuf {
    path.map_or_else(|| configs.join(default), Path::to_owned)
}
