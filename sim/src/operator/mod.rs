//! The operator's side without cameras: images of tag shells along a scripted motion, with the truth.

use std::path::{Path, PathBuf};

/// Arguments of `locoman-sim operator`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Recording (MCAP) to write: images and truth.
    #[arg(short, long, value_name = "REC.mcap", required_unless_present = "folder")]
    pub output: Option<PathBuf>,
    /// Also write (or only write) images in the EuRoC layout: `CAMERA/data/T_NS.png`.
    #[arg(long, value_name = "DIR")]
    pub folder: Option<PathBuf>,
    /// Also write the truth as poses CSV.
    #[arg(long, value_name = "CSV")]
    pub truth: Option<PathBuf>,
    /// Length in seconds; the scene's own period loops without a seam.
    #[arg(long, value_name = "S")]
    pub seconds: Option<f64>,
    /// Images a second of each camera.
    #[arg(long, value_name = "HZ", default_value_t = 30.0)]
    pub rate: f64,
    /// Cameras and where they stand; default: `rigs/two_zed_pairs.toml` in the configs folder.
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,
    /// What the operator wears; default: `shells/standard.toml` in the configs folder.
    #[arg(long, value_name = "FILE")]
    pub shells: Option<PathBuf>,
    /// Motion, light and sensor; default: `scenes/operator.toml` in the configs folder.
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Seed of noise and textures.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// Runs `locoman-sim operator`.
pub fn run(_args: &Args, _configs: &Path) -> anyhow::Result<()> {
    anyhow::bail!("`locoman-sim operator` is not built yet")
}
