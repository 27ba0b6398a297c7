//! Opening what `--replay`, `track` and `--cameras` name.

use std::path::Path;

use locoman_protocol::recording::Overview;
use locoman_vision::rig::Rig;
use locoman_vision::source::{FrameSource, ImageFolder, Recording, SourceError, VideoSource};

/// A recording: an MCAP file, or a folder `CAMERA/data/T_NS.png`.
pub fn recording(path: &Path, rig: &Rig) -> Result<Box<dyn FrameSource>, SourceError> {
    if path.is_dir() {
        return Ok(Box::new(ImageFolder::open(path, rig)?));
    }
    Ok(Box::new(Recording::open(path, rig)?))
}

/// Refuses a recording that is not whole before anything moves, in place of minutes later.
pub fn check(path: &Path) -> anyhow::Result<()> {
    if path.is_dir() {
        return Ok(());
    }
    anyhow::ensure!(
        path.exists(),
        "there is no recording `{}`; `locoman-teleop record` makes one from cameras, `locoman-sim operator` \
         without",
        path.display()
    );
    let overview = Overview::read(path)?;
    anyhow::ensure!(
        overview.complete,
        "the recording `{}` is not whole: its recorder was killed or the file was cut short; \
         `mcap recover` makes a whole file of what is good, or record again",
        path.display()
    );
    Ok(())
}

/// The live cameras that the rig file names.
pub fn cameras(rig: &Rig) -> Result<Box<dyn FrameSource>, SourceError> {
    Ok(Box::new(VideoSource::open(rig)?))
}
