//! Where frames come from: recordings, folders of images, videos, devices; all behind one trait.

mod folder;
mod recording;
mod set;
mod video;

use std::path::{Path, PathBuf};

use locoman_protocol::recording::RecordingError;

use crate::image::Frame;
use crate::rig::Rig;
pub use folder::ImageFolder;
pub use recording::Recording;
pub use set::{FrameSet, FrameSets, SYNC_TOLERANCE_NS, mean_ns};
pub use video::VideoSource;

/// Delivers the frames of all cameras of a rig, by rising capture time.
pub trait FrameSource: Send {
    /// The next frame; `None` at the end.
    fn next_frame(&mut self) -> Result<Option<Frame>, SourceError>;

    /// Frames that were there but could not be read, so far.
    fn skipped(&self) -> u64;
}

impl<S: FrameSource + ?Sized> FrameSource for Box<S> {
    fn next_frame(&mut self) -> Result<Option<Frame>, SourceError> {
        (**self).next_frame()
    }

    fn skipped(&self) -> u64 {
        (**self).skipped()
    }
}

/// Opens a recording: an MCAP file, or a folder of images.
pub fn open_recording(path: &Path, rig: &Rig) -> Result<Box<dyn FrameSource>, SourceError> {
    if path.is_dir() {
        return Ok(Box::new(ImageFolder::open(path, rig)?));
    }
    Ok(Box::new(Recording::open(path, rig)?))
}

/// A source that cannot deliver.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The source lacks a camera of the rig.
    #[error("{}: no images of camera `{camera}`\n  hint: {remedy}", path.display())]
    MissingCamera {
        /// File or folder.
        path: PathBuf,
        /// Id in the rig file.
        camera: String,
        /// What to do.
        remedy: String,
    },
    /// The source cannot be opened or read.
    #[error("{}: {problem}\n  hint: {remedy}", path.display())]
    Unreadable {
        /// File, folder or device.
        path: PathBuf,
        /// What is wrong.
        problem: String,
        /// What to do.
        remedy: String,
    },
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

#[cfg(test)]
mod tests;
