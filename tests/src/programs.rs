//! Where the programs are, and the recording that drives them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use anyhow::{Context, Result, bail};

/// A program of the workspace, run in the repository's root so that it finds `configs/`.
pub fn program(name: &str) -> Result<Command> {
    // This test's executable is target/debug/deps/NAME-HASH.
    let here = std::env::current_exe()?;
    let folder = here.parent().and_then(Path::parent).context("no target folder above this test")?;
    let path = folder.join(name);
    if !path.exists() {
        bail!("{} is not built: run `cargo build --workspace --bins`", path.display());
    }
    let mut command = Command::new(path);
    command.current_dir(root());
    Ok(command)
}

/// Runs a program to its end and returns its exit status and what it printed.
pub fn finish(name: &str, args: &[&str]) -> Result<Output> {
    Ok(program(name)?.args(args).output()?)
}

/// The repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A recorded operator: the demo's if `cargo xtask test` names it, else a short one, rendered here.
pub fn operator_recording(folder: &Path) -> Result<PathBuf> {
    if let Some(path) = std::env::var_os("LOCOMAN_OPERATOR_RECORDING") {
        return Ok(path.into());
    }
    let path = folder.join("operator.mcap");
    let text = path.to_string_lossy();
    let output = finish("locoman-sim", &["operator", "--seconds", "8", "--output", &text])?;
    if !output.status.success() {
        bail!("cannot render the operator: {}", String::from_utf8_lossy(&output.stderr));
    }
    Ok(path)
}
