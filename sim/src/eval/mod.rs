//! Evaluations: each runs one reproducible experiment and reports its figures.
//!
//! To add one: a module with `run`, and a variant of [`Name`].

use std::path::{Path, PathBuf};

/// Arguments of `locoman-sim eval`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Which experiment.
    pub name: Name,
    /// Where to write the report; its plots go beside it.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Seed of everything random in it.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// The experiments.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Name {
    /// Poses from rendered images against the truth.
    Vision,
}

/// Runs `locoman-sim eval`.
pub fn run(args: &Args, _configs: &Path) -> anyhow::Result<()> {
    match args.name {
        Name::Vision => anyhow::bail!("`locoman-sim eval vision` is not built yet"),
    }
}
