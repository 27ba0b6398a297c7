//! Recordings in the EuRoC/ASL layout: `CAMERA/data/T_NS.png` (or .jpg), one folder for each camera id.

use std::path::{Path, PathBuf};

use super::{FrameSource, SourceError};
use crate::image::{Frame, Pixels};
use crate::rig::Rig;

/// A folder of images. Frames come encoded, by rising capture time, then in the rig's order of cameras.
#[derive(Debug)]
pub struct ImageFolder {
    /// Capture time, camera and file of what is still to come, the last first.
    rest: Vec<(u64, usize, PathBuf)>,
    skipped: u64,
}

impl ImageFolder {
    /// Lists the images of all cameras of a rig.
    pub fn open(path: &Path, rig: &Rig) -> Result<Self, SourceError> {
        let mut files = Vec::new();
        let mut skipped = 0;
        for (camera, described) in rig.cameras.iter().enumerate() {
            let folder = path.join(&described.id).join("data");
            let entries = std::fs::read_dir(&folder).map_err(|error| SourceError::MissingCamera {
                path: path.to_owned(),
                camera: described.id.clone(),
                remedy: format!("expected images in {} ({error}); found {}", folder.display(), listing(path)),
            })?;
            for entry in entries.flatten() {
                let file = entry.path();
                let is_image = file
                    .extension()
                    .and_then(|extension| extension.to_str())
                    .is_some_and(|extension| matches!(extension, "png" | "jpg" | "jpeg"));
                let time = file.file_stem().and_then(|stem| stem.to_str()?.parse().ok());
                match (is_image, time) {
                    (true, Some(time)) => files.push((time, camera, file)),
                    (true, None) => {
                        tracing::warn!(file = %file.display(), "skipped: its name is no time in nanoseconds");
                        skipped += 1;
                    }
                    (false, _) => {}
                }
            }
        }
        files.sort();
        files.reverse();
        Ok(Self { rest: files, skipped })
    }
}

impl FrameSource for ImageFolder {
    fn next_frame(&mut self) -> Result<Option<Frame>, SourceError> {
        while let Some((capture_ns, camera, file)) = self.rest.pop() {
            match std::fs::read(&file) {
                Ok(bytes) if !bytes.is_empty() => {
                    let pixels = Pixels::Encoded(bytes);
                    return Ok(Some(Frame { camera, capture_ns, pixels }));
                }
                Ok(_) => tracing::warn!(file = %file.display(), "skipped: it is empty"),
                Err(error) => tracing::warn!(file = %file.display(), %error, "skipped: cannot be read"),
            }
            self.skipped += 1;
        }
        Ok(None)
    }

    fn skipped(&self) -> u64 {
        self.skipped
    }
}

/// The names in a folder, for an error message.
fn listing(path: &Path) -> String {
    let Ok(entries) = std::fs::read_dir(path) else { return "no such folder".to_owned() };
    let mut names: Vec<String> =
        entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}
