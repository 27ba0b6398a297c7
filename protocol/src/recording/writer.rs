//! Writes recordings.

use super::RecordingError;
use super::schema::descriptor_set;
use mcap::records::{MessageHeader, Metadata};
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Uncompressed size at which a chunk is closed.
const CHUNK_BYTES: u64 = 1024 * 1024;
/// A chunk is closed and handed to the system after this much time of the recording, whatever its size:
/// that much is lost if the process is killed.
const FLUSH_NS: u64 = 1_000_000_000;

/// Writes a recording. Dropping it unfinished closes the file as well as it can.
pub struct Writer {
    path: PathBuf,
    file: mcap::Writer<BufWriter<File>>,
    channels: HashMap<String, Channel>,
    flushed_ns: Option<u64>,
}

struct Channel {
    id: u16,
    schema: String,
    sequence: u32,
}

impl std::fmt::Debug for Writer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Writer").field("path", &self.path).finish_non_exhaustive()
    }
}

impl Writer {
    /// Creates the file, over an existing one.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        let path = path.as_ref().to_owned();
        let file =
            File::create(&path).map_err(|source| RecordingError::Write { path: path.clone(), source })?;
        let file = mcap::WriteOptions::new()
            .library(concat!("locoman ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK_BYTES))
            // Chunks are written in one piece, not begun and then completed by seeking back: a killed
            // process leaves whole chunks.
            .disable_seeking(true)
            // On the caller's thread: files are the same from run to run.
            .compression_threads(0)
            .create(BufWriter::new(file))
            .map_err(RecordingError::write(&path))?;
        Ok(Self { path, file, channels: HashMap::new(), flushed_ns: None })
    }

    /// Appends a message.
    ///
    /// `time_ns` on the recording's clock; rising times are read back fastest, but nothing demands them.
    ///
    /// # Errors
    /// The disk is full, the topic carries another type, or the type is not one of this crate's.
    pub fn write<M: prost::Name>(
        &mut self,
        topic: &str,
        time_ns: u64,
        message: &M,
    ) -> Result<(), RecordingError> {
        self.add_channel::<M>(topic)?;
        let Some(channel) = self.channels.get_mut(topic) else { return Ok(()) };
        if channel.schema != M::full_name() {
            return Err(RecordingError::OtherType {
                path: self.path.clone(),
                topic: topic.to_owned(),
                expected: M::full_name(),
                found: channel.schema.clone(),
            });
        }
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        channel.sequence = channel.sequence.wrapping_add(1);
        self.file
            .write_to_known_channel(&header, &message.encode_to_vec())
            .map_err(RecordingError::write(&self.path))?;
        self.flush_if_due(time_ns)
    }

    /// Stores a file inside the recording, as the rig's configuration.
    pub fn attach(&mut self, name: &str, media_type: &str, data: &[u8]) -> Result<(), RecordingError> {
        let attachment = mcap::Attachment {
            log_time: self.flushed_ns.unwrap_or_default(),
            create_time: 0,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: data.into(),
        };
        self.file.attach(&attachment).map_err(RecordingError::write(&self.path))
    }

    /// Stores named facts about the recording, as the seed it was rendered from.
    pub fn metadata(&mut self, name: &str, facts: BTreeMap<String, String>) -> Result<(), RecordingError> {
        let metadata = Metadata { name: name.to_owned(), metadata: facts };
        self.file.write_metadata(&metadata).map_err(RecordingError::write(&self.path))
    }

    /// Makes everything so far readable even if the process is killed now.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.file.flush().map_err(RecordingError::write(&self.path))
    }

    /// Writes the summary and closes the file.
    pub fn finish(self) -> Result<(), RecordingError> {
        let Self { path, mut file, .. } = self;
        file.finish().map_err(RecordingError::write(&path))?;
        file.into_inner().flush().map_err(|source| RecordingError::Write { path, source })
    }

    fn add_channel<M: prost::Name>(&mut self, topic: &str) -> Result<(), RecordingError> {
        if self.channels.contains_key(topic) {
            return Ok(());
        }
        let schema = M::full_name();
        let descriptors = descriptor_set::<M>()?;
        let id = self
            .file
            .add_schema(&schema, "protobuf", &descriptors)
            .and_then(|schema_id| self.file.add_channel(schema_id, topic, "protobuf", &BTreeMap::new()))
            .map_err(RecordingError::write(&self.path))?;
        self.channels.insert(topic.to_owned(), Channel { id, schema, sequence: 0 });
        Ok(())
    }

    fn flush_if_due(&mut self, time_ns: u64) -> Result<(), RecordingError> {
        let since = *self.flushed_ns.get_or_insert(time_ns);
        if time_ns.saturating_sub(since) < FLUSH_NS {
            return Ok(());
        }
        self.flushed_ns = Some(time_ns);
        self.flush()
    }
}
