//! The simulated robot.

use std::path::Path;

/// Arguments of `locoman-sim robot`.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Runs `locoman-sim robot`.
pub fn run(_args: &Args, _configs: &Path) -> anyhow::Result<()> {
    anyhow::bail!("`locoman-sim robot` is not built yet")
}
