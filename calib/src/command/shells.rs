//! `locoman-calib shells`: where the tags of a shell really are, from a recording of the waved shell.

use std::path::{Path, PathBuf};

use anyhow::Context;
use locoman_calib::file::write_whole;
use locoman_calib::{layout, toml_out};
use locoman_vision::shells::ShellSet;

use super::{Body, or_default, progress};

/// Arguments of `shells`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The recording.
    #[arg(value_name = "REC")]
    recording: PathBuf,
    #[command(flatten)]
    body: Body,
    /// Place the cameras along with the tags: the rig file's places are not believed.
    #[arg(long)]
    joint: bool,
    /// The shells file to write: the other shells stay as they are.
    #[arg(short, long, value_name = "FILE", default_value = "shells.toml")]
    output: PathBuf,
}

/// Measures, prints what is wrong, writes the shells file.
pub fn run(args: &Args, configs: &Path) -> anyhow::Result<()> {
    let (rig, drawn) = args.body.load(configs)?;
    let observations = args.body.read(&args.recording, &rig, &drawn)?;
    let bar = progress("steps");
    let found = layout::measure(&rig, &drawn, &observations, args.joint, &mut |step, rms_px| {
        bar.set_position(step as u64);
        bar.set_message(format!("{rms_px:.3} px"));
    })?;
    bar.finish_and_clear();
    let text = layout::describe(&found);
    print!("{text}");
    let mut set = ShellSet::load(&or_default(args.body.shells.as_deref(), configs, "shells/standard.toml"))?;
    if let Some(shell) = set.shells.iter_mut().find(|shell| shell.name == found.shell.name) {
        *shell = found.shell.clone();
    }
    write_whole(
        &args.output,
        &toml_out::shells_text(&set, &format!("Measured by `locoman-calib shells`.\n{text}")),
    )
    .with_context(|| format!("cannot write {}", args.output.display()))?;
    println!("shells file: {}", args.output.display());
    Ok(())
}
