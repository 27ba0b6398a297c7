//! What is in a recording, without reading its messages.

use super::RecordingError;
use super::fields::{ChannelRecord, Fields};
use super::frames::Frames;
use super::reader::Reader;
use mcap::records::op;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// A file inside a recording, as the rig's configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attachment {
    /// Its name, as `rig.toml`.
    pub name: String,
    /// Its type, as `application/toml`.
    pub media_type: String,
    /// Its content.
    pub data: Vec<u8>,
}

/// What is in a recording.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Overview {
    /// Messages on each topic.
    pub topics: BTreeMap<String, u64>,
    /// Time of the first message (0 if there is none).
    pub start_ns: u64,
    /// Time of the last message.
    pub end_ns: u64,
    /// Files inside it.
    pub attachments: Vec<Attachment>,
    /// Whether the recorder finished it. If not, everything here was counted by reading it to the damage.
    pub complete: bool,
}

impl Overview {
    /// Reads the summary; of a file without one, everything up to the damage.
    ///
    /// # Errors
    /// The file cannot be opened, is no MCAP file, or cannot be read.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let mut overview = Self::default();
        match overview.summarize(path) {
            Ok(true) => overview.complete = true,
            Ok(false) | Err(RecordingError::Damaged { .. }) => overview.count(path)?,
            Err(error) => return Err(error),
        }
        Ok(overview)
    }

    /// The content of an attachment.
    pub fn attachment(&self, name: &str) -> Option<&Attachment> {
        self.attachments.iter().find(|attachment| attachment.name == name)
    }

    /// Passes over the chunks; `false` if there are no statistics at the end.
    fn summarize(&mut self, path: &Path) -> Result<bool, RecordingError> {
        let mut frames = Frames::open(path)?;
        let mut topics = HashMap::new();
        let mut found = false;
        let mut in_summary = false;
        while let Some(frame) = frames.next_frame()? {
            match frame.opcode {
                op::DATA_END => in_summary = true,
                op::CHANNEL if in_summary => {
                    if let Some(channel) = ChannelRecord::parse(Fields(frames.content(frame)?)) {
                        topics.insert(channel.id, channel.topic.to_owned());
                    }
                }
                op::STATISTICS => {
                    found = self.statistics(Fields(frames.content(frame)?), &topics).is_some();
                }
                op::ATTACHMENT => match attachment(Fields(frames.content(frame)?)) {
                    Some(attachment) => self.attachments.push(attachment),
                    None => return Err(frames.damaged("an attachment is damaged")),
                },
                _ => frames.skip(frame)?,
            }
        }
        Ok(found)
    }

    fn statistics(&mut self, mut fields: Fields<'_>, topics: &HashMap<u16, String>) -> Option<()> {
        /// Number of messages, schemas, channels, attachments, metadata, chunks.
        const COUNTS_BYTES: u64 = 8 + 2 + 4 + 4 + 4 + 4;
        fields.bytes(COUNTS_BYTES)?;
        self.start_ns = fields.u64()?;
        self.end_ns = fields.u64()?;
        let length = fields.u32()?;
        let mut counts = Fields(fields.bytes(length.into())?);
        while !counts.0.is_empty() {
            let (channel, count) = (counts.u16()?, counts.u64()?);
            let topic = topics.get(&channel)?;
            *self.topics.entry(topic.clone()).or_default() += count;
        }
        Some(())
    }

    fn count(&mut self, path: &Path) -> Result<(), RecordingError> {
        self.topics.clear();
        (self.start_ns, self.end_ns) = (u64::MAX, 0);
        for message in Reader::open(path)? {
            match message {
                Ok(message) => {
                    self.start_ns = self.start_ns.min(message.time_ns);
                    self.end_ns = self.end_ns.max(message.time_ns);
                    *self.topics.entry(message.channel.topic.clone()).or_default() += 1;
                }
                Err(RecordingError::Damaged { .. }) => break,
                Err(error) => return Err(error),
            }
        }
        self.start_ns = self.start_ns.min(self.end_ns);
        Ok(())
    }
}

/// Log time, creation time, name, type, content, checksum over all before it.
fn attachment(mut fields: Fields<'_>) -> Option<Attachment> {
    let whole = fields.0;
    let (_log_time, _create_time) = (fields.u64()?, fields.u64()?);
    let (name, media_type) = (fields.str()?.to_owned(), fields.str()?.to_owned());
    let length = fields.u64()?;
    let data = fields.bytes(length)?.to_vec();
    let covered = whole.get(..whole.len() - fields.0.len())?;
    let crc = fields.u32()?;
    (crc == 0 || crc == crc32fast::hash(covered)).then_some(Attachment { name, media_type, data })
}
