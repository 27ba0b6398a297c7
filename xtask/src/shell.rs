//! Running other programs, and speaking to the person at the terminal.

use std::ffi::OsStr;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, bail};

/// Prints one line for the person who ran this (standard error: data alone goes to standard output).
pub fn say(line: &str) {
    // Nothing can be done about a closed standard error.
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Whether a question can be asked: not in CI, and only with a person at the terminal.
pub fn interactive() -> bool {
    std::env::var_os("CI").is_none() && std::io::stdin().is_terminal()
}

/// Runs a program to its end; anything but success is an error that names it.
pub fn run(command: &mut Command) -> Result<()> {
    let line = describe(command);
    let status = command.status().with_context(|| format!("cannot start `{line}`"))?;
    if !status.success() {
        bail!("`{line}` failed ({status})");
    }
    Ok(())
}

/// Runs cargo with these arguments.
pub fn cargo<S: AsRef<OsStr>>(args: &[S]) -> Result<()> {
    run(cargo_command().args(args))
}

/// The cargo that runs this program.
pub fn cargo_command() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// A program of this workspace, built by `cargo build --workspace --bins`.
pub fn program(name: &str) -> Command {
    Command::new(target_dir().join("debug").join(name))
}

/// Cargo's target folder.
pub fn target_dir() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from)
}

fn describe(command: &Command) -> String {
    let mut words = vec![command.get_program().to_string_lossy().into_owned()];
    words.extend(command.get_args().map(|arg| arg.to_string_lossy().into_owned()));
    words.join(" ")
}
