//! `locoman-calib check`: what the tracker would read from rig and shells files.

use std::path::{Path, PathBuf};

use locoman_calib::check;
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;

use super::or_default;

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The rig file; by default `rigs/two_zed_pairs.toml` of the configs folder.
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// The shells file; by default `shells/standard.toml` of the configs folder.
    #[arg(long, value_name = "FILE")]
    shells: Option<PathBuf>,
}

/// Prints what is in the files.
pub fn run(args: &Args, configs: &Path) -> anyhow::Result<()> {
    let rig = or_default(args.rig.as_deref(), configs, "rigs/two_zed_pairs.toml");
    let shells = or_default(args.shells.as_deref(), configs, "shells/standard.toml");
    let (cameras, worn) = (Rig::load(&rig)?, ShellSet::load(&shells)?);
    println!("{}\n{}", rig.display(), check::describe_rig(&cameras));
    println!("{}\n{}", shells.display(), check::describe_shells(&worn));
    Ok(())
}
