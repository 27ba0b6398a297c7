//! What extrinsics, shells and checks have in common: which body is waved, and reading a recording of it.

use std::path::{Path, PathBuf};

use locoman_calib::board::Board;
use locoman_calib::reading;
use locoman_vision::pose::Observation;
use locoman_vision::rig::Rig;
use locoman_vision::shells::{Shell, ShellSet};

use super::{or_default, progress};

/// Which files, and which body is waved.
#[derive(Debug, clap::Args)]
pub struct Body {
    /// The rig file; by default `rigs/two_zed_pairs.toml` of the configs folder.
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,
    /// The shells file; by default `shells/standard.toml` of the configs folder.
    #[arg(long, value_name = "FILE")]
    pub shells: Option<PathBuf>,
    /// The shell that is waved.
    #[arg(long, value_name = "NAME", default_value = "right_palm", conflicts_with = "board")]
    pub shell: String,
    /// A board is waved instead: its file.
    #[arg(long, value_name = "FILE")]
    pub board: Option<PathBuf>,
    /// Every so many images of each camera.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub stride: usize,
}

impl Body {
    /// The rig and the body.
    pub fn load(&self, configs: &Path) -> anyhow::Result<(Rig, Shell)> {
        let rig = Rig::load(&or_default(self.rig.as_deref(), configs, "rigs/two_zed_pairs.toml"))?;
        if let Some(board) = &self.board {
            return Ok((rig, Board::load(board)?.to_shell()));
        }
        let path = or_default(self.shells.as_deref(), configs, "shells/standard.toml");
        let set = ShellSet::load(&path)?;
        let names: Vec<&str> = set.shells.iter().map(|shell| shell.name.as_str()).collect();
        let known = names.join(", ");
        let found = set.shells.iter().find(|shell| shell.name == self.shell).cloned();
        let shell = found.ok_or_else(|| {
            anyhow::anyhow!("{} has no shell `{}`\n  hint: it has {known}", path.display(), self.shell)
        })?;
        Ok((rig, shell))
    }

    /// What a recording shows of the body.
    pub fn read(&self, recording: &Path, rig: &Rig, body: &Shell) -> anyhow::Result<Vec<Observation>> {
        let bar = progress("images");
        let mut hear = |done: usize| bar.set_position(done as u64);
        let seen = reading::read_recording(recording, rig, body, self.stride, &mut hear)?;
        bar.finish_and_clear();
        Ok(reading::observations(&seen))
    }
}
