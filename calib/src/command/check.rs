//! `locoman-calib check`: what the tracker would read from rig and shells files, and whether a recording agrees.

use std::path::{Path, PathBuf};

use locoman_calib::{check, inspect};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;

use super::{Body, or_default};

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A recording: residuals by camera, tag and time; which camera was bumped, which tag is damaged.
    #[arg(value_name = "REC")]
    recording: Option<PathBuf>,
    #[command(flatten)]
    body: Body,
}

/// Prints what is in the files, and what the recording says of them.
pub fn run(args: &Args, configs: &Path) -> anyhow::Result<()> {
    let rig = or_default(args.body.rig.as_deref(), configs, "rigs/two_zed_pairs.toml");
    let shells = or_default(args.body.shells.as_deref(), configs, "shells/standard.toml");
    let (cameras, worn) = (Rig::load(&rig)?, ShellSet::load(&shells)?);
    println!("{}\n{}", rig.display(), check::describe_rig(&cameras));
    println!("{}\n{}", shells.display(), check::describe_shells(&worn));
    let Some(recording) = &args.recording else { return Ok(()) };
    let (rig, body) = args.body.load(configs)?;
    let observations = args.body.read(recording, &rig, &body)?;
    println!(
        "{}\n{}",
        recording.display(),
        inspect::describe(&inspect::inspect(&rig, &body, &observations)?)
    );
    Ok(())
}
