//! What a rendering leaves behind: a recording, a folder of images, a truth file.
//!
//! Each is written under a temporary name beside its own, and renamed when it is whole.

mod folder;
mod recording;
mod truth;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;

use super::motion::{Body, Posture};

pub use folder::Folder;
pub use recording::Recording;
pub use truth::TruthFile;

/// The pictures of all cameras that take one at an instant, encoded as the outputs need them.
#[derive(Debug)]
pub struct Instant<'a> {
    /// Middle of the exposure of the middle row.
    pub capture_ns: u64,
    /// Counts from 0.
    pub number: u64,
    /// Where the shells were.
    pub posture: Posture,
    /// The shells that are in the scene.
    pub bodies: &'a [Body],
    /// One for each of these cameras.
    pub images: Vec<Image<'a>>,
}

/// One encoded picture; formats that nobody asked for are absent.
#[derive(Debug)]
pub struct Image<'a> {
    /// Its camera's id.
    pub camera: &'a str,
    /// For recordings.
    pub jpeg: Option<Vec<u8>>,
    /// For folders.
    pub png: Option<Vec<u8>>,
}

/// Takes instants in the order of time.
pub trait Output {
    /// Adds one.
    fn add(&mut self, instant: &Instant<'_>) -> anyhow::Result<()>;
    /// Completes the output and gives it its name.
    fn finish(self: Box<Self>) -> anyhow::Result<()>;
}

/// A file or folder under a temporary name, removed unless it is kept.
#[derive(Debug)]
struct Unfinished {
    temporary: PathBuf,
    path: PathBuf,
    kept: bool,
}

impl Unfinished {
    fn new(path: &Path) -> anyhow::Result<Self> {
        let name = path.file_name().with_context(|| format!("{} names no file", path.display()))?;
        let temporary = path.with_file_name(format!(".{}.part", name.to_string_lossy()));
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)
                .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        }
        Ok(Self { temporary, path: path.to_owned(), kept: false })
    }

    fn keep(mut self) -> anyhow::Result<()> {
        fs::rename(&self.temporary, &self.path)
            .with_context(|| format!("cannot rename the finished output to {}", self.path.display()))?;
        self.kept = true;
        Ok(())
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if !self.kept {
            // Nothing to tell anyone if this fails: the next run overwrites it.
            let _ = fs::remove_file(&self.temporary).or_else(|_| fs::remove_dir_all(&self.temporary));
        }
    }
}
