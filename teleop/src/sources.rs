//! Opening what `--replay`, `track` and `--cameras` name.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::Result;
use locoman_protocol::recording::Overview;
use locoman_vision::rig::Rig;
use locoman_vision::source::{FrameSource, SourceError, VideoSource, open_recording};

use crate::replay::{Pace, Replay};

/// The first frame of a replay is due this long after the start: time to connect.
const REPLAY_LEAD_NS: u64 = 300_000_000;

/// Where frames come from.
#[derive(Debug, Clone)]
pub enum Frames {
    /// A recording, over and over.
    Replay(PathBuf, Pace),
    /// The cameras that the rig file names.
    Live,
}

impl Frames {
    /// Opens them for the cameras that are read `here`; a replay begins soon after `now_ns`, or at the time that its
    /// pace names, and waits while `hold` is set.
    pub fn open(
        &self,
        rig: &Rig,
        here: &[bool],
        now_ns: u64,
        hold: &Arc<AtomicBool>,
    ) -> Result<Box<dyn FrameSource>> {
        match self {
            Self::Replay(path, pace) => {
                check(path)?;
                let start_ns = pace.start_ns.unwrap_or(now_ns + REPLAY_LEAD_NS);
                let (path, rig) = (path.clone(), rig.clone());
                let reopen = Box::new(move || open_recording(&path, &rig));
                Ok(Box::new(Replay::open(reopen, start_ns, pace.speed, Arc::clone(hold))?))
            }
            Self::Live => {
                let wanted = |camera: usize| here.get(camera) == Some(&true);
                Ok(Box::new(VideoSource::open_some(rig, wanted)?))
            }
        }
    }
}

/// Refuses a recording that is not whole before anything moves, in place of minutes later.
pub fn check(path: &Path) -> Result<()> {
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
