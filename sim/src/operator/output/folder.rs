//! A folder of images.

use std::fs;
use std::path::Path;

use anyhow::Context;

use super::{Instant, Output, TruthFile, Unfinished};

/// A folder in the EuRoC layout, `CAMERA/data/T_NS.png`, with `truth.csv`.
#[derive(Debug)]
pub struct Folder {
    truth: TruthFile,
    unfinished: Unfinished,
}

impl Folder {
    /// Begins a folder, which must not hold anything yet.
    pub fn create<'a>(path: &Path, cameras: impl Iterator<Item = &'a str>) -> anyhow::Result<Self> {
        let occupied = fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_some());
        anyhow::ensure!(!occupied, "{} is not empty: remove it or name another folder", path.display());
        let unfinished = Unfinished::new(path)?;
        let _ = fs::remove_dir_all(&unfinished.temporary);
        for camera in cameras {
            let folder = unfinished.temporary.join(camera).join("data");
            fs::create_dir_all(&folder)
                .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        }
        let truth = TruthFile::create(&unfinished.temporary.join("truth.csv"))?;
        Ok(Self { truth, unfinished })
    }
}

impl Output for Folder {
    fn add(&mut self, instant: &Instant<'_>) -> anyhow::Result<()> {
        for image in &instant.images {
            let name = format!("{}.png", instant.capture_ns);
            let path = self.unfinished.temporary.join(image.camera).join("data").join(name);
            let png = image.png.as_ref().context("a folder needs PNG images")?;
            fs::write(&path, png).with_context(|| format!("cannot write {}", path.display()))?;
        }
        self.truth.add(instant)
    }

    fn finish(self: Box<Self>) -> anyhow::Result<()> {
        let Self { truth, unfinished } = *self;
        Box::new(truth).finish()?;
        unfinished.keep()
    }
}
