//! Recordings in MCAP: `/camera/<id>/image` with JPEG or PNG images.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use locoman_protocol::messages::foxglove::CompressedImage;
use locoman_protocol::recording::{
    Overview, Reader, RecordingError, camera_of_image_topic, image_topic, nanoseconds,
};

use super::{FrameSource, SourceError};
use crate::config::did_you_mean;
use crate::image::{Frame, Pixels};
use crate::rig::Rig;

/// A recording. Frames come encoded, in the order in which they were recorded.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    reader: Reader,
    camera_of_topic: HashMap<String, usize>,
    skipped: u64,
}

impl Recording {
    /// Opens a recording and checks that its cameras are the rig's.
    pub fn open(path: &Path, rig: &Rig) -> Result<Self, SourceError> {
        let recorded = Overview::read(path)?.topics;
        let ids: Vec<&str> = rig.cameras.iter().map(|camera| camera.id.as_str()).collect();
        let in_file: Vec<&str> = recorded.keys().filter_map(|topic| camera_of_image_topic(topic)).collect();
        for id in &ids {
            if !in_file.contains(id) {
                let guess = did_you_mean(id, &in_file).map(|guess| format!("; did you mean `{guess}`?"));
                return Err(SourceError::MissingCamera {
                    path: path.to_owned(),
                    camera: (*id).to_owned(),
                    remedy: format!(
                        "it has images of {}: use the rig file that it was recorded with{}",
                        if in_file.is_empty() { "no camera".to_owned() } else { in_file.join(", ") },
                        guess.unwrap_or_default()
                    ),
                });
            }
        }
        if let Some(unknown) = in_file.iter().find(|camera| !ids.contains(camera)) {
            return Err(SourceError::Unreadable {
                path: path.to_owned(),
                problem: format!("its camera `{unknown}` is not in the rig file"),
                remedy: format!("the rig file has {}: add `{unknown}` to it", ids.join(", ")),
            });
        }
        let camera_of_topic = ids.iter().enumerate().map(|(k, id)| (image_topic(id), k)).collect();
        let reader = Reader::open(path)?;
        Ok(Self { path: path.to_owned(), reader, camera_of_topic, skipped: 0 })
    }
}

impl FrameSource for Recording {
    fn next_frame(&mut self) -> Result<Option<Frame>, SourceError> {
        for message in self.reader.by_ref() {
            let message = message?;
            let Some(&camera) = self.camera_of_topic.get(message.topic()) else { continue };
            match frame(camera, &message.decode::<CompressedImage>()) {
                Some(frame) => return Ok(Some(frame)),
                None => {
                    let (path, time_ns) = (self.path.display(), message.time_ns);
                    tracing::warn!(%path, topic = message.topic(), time_ns, "skipped a damaged frame");
                    self.skipped += 1;
                }
            }
        }
        Ok(None)
    }

    fn skipped(&self) -> u64 {
        self.skipped
    }
}

fn frame(camera: usize, image: &Result<CompressedImage, RecordingError>) -> Option<Frame> {
    let image = image.as_ref().ok()?;
    let capture_ns = nanoseconds(image.timestamp.as_ref()?)?;
    let pixels = Pixels::Encoded(image.data.clone());
    (!image.data.is_empty()).then_some(Frame { camera, capture_ns, pixels })
}
