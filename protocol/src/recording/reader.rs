//! Reads the messages of a recording, in the order of the file.

use super::RecordingError;
use super::fields::{self, ChannelRecord, ChunkRecord, Fields, MessageRecord};
use super::frames::{Frame, Frames};
use mcap::records::op;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// More than any chunk that our writer makes: 1 MiB and one image.
const MAX_CHUNK_BYTES: u64 = 256 * 1024 * 1024;

/// What a topic carries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channel {
    /// The file.
    pub path: Arc<Path>,
    /// The topic.
    pub topic: String,
    /// The full name of the message type, as `locoman.Tracking`.
    pub schema: String,
    /// How messages are encoded: "protobuf" in our files.
    pub encoding: String,
}

/// One message of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// Its topic and type.
    pub channel: Arc<Channel>,
    /// When it was logged, on the recording's clock.
    pub time_ns: u64,
    /// As encoded.
    pub data: Vec<u8>,
}

impl Recorded {
    /// Its topic.
    pub fn topic(&self) -> &str {
        &self.channel.topic
    }

    /// Whether it is a message of this type.
    pub fn is<M: prost::Name>(&self) -> bool {
        self.channel.encoding == "protobuf" && self.channel.schema == M::full_name()
    }

    /// The message.
    ///
    /// # Errors
    /// It is of another type, or its bytes are damaged.
    pub fn decode<M: prost::Name + Default>(&self) -> Result<M, RecordingError> {
        let Channel { path, topic, schema, encoding } = self.channel.as_ref();
        if !self.is::<M>() {
            let found =
                if encoding == "protobuf" { schema.clone() } else { format!("{schema} as {encoding}") };
            return Err(RecordingError::OtherType {
                path: path.to_path_buf(),
                topic: topic.clone(),
                expected: M::full_name(),
                found,
            });
        }
        M::decode(self.data.as_slice()).map_err(|source| RecordingError::Decode {
            path: path.to_path_buf(),
            topic: topic.clone(),
            time_ns: self.time_ns,
            source,
        })
    }
}

/// An iterator over a recording's messages.
///
/// Holds one chunk (about 1 MiB) in memory; a chunk's checksum is verified before its first message is
/// given. After an error it ends: messages given before are good.
#[derive(Debug)]
pub struct Reader {
    frames: Frames,
    schemas: HashMap<u16, String>,
    channels: HashMap<u16, Arc<Channel>>,
    chunk: Vec<u8>,
    /// Bytes of the chunk already given.
    taken: usize,
    ended: bool,
}

impl Reader {
    /// Opens a recording.
    ///
    /// # Errors
    /// It cannot be opened, or is no MCAP file. Damage further on shows while reading.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        Ok(Self {
            frames: Frames::open(path.as_ref())?,
            schemas: HashMap::new(),
            channels: HashMap::new(),
            chunk: Vec::new(),
            taken: 0,
            ended: false,
        })
    }

    fn next_message(&mut self) -> Result<Option<Recorded>, RecordingError> {
        loop {
            while self.taken < self.chunk.len() {
                // Taken out for the loan, put back below.
                let chunk = std::mem::take(&mut self.chunk);
                let mut rest = Fields(chunk.get(self.taken..).unwrap_or_default());
                let outcome = match rest.record() {
                    Some((opcode, content)) => self.record(opcode, content),
                    None => Err("a chunk ends in the middle of a record"),
                };
                self.taken = chunk.len() - rest.0.len();
                self.chunk = chunk;
                if let Some(message) = outcome.map_err(|problem| self.frames.damaged(problem))? {
                    return Ok(Some(message));
                }
            }
            let Some(frame) = self.frames.next_frame()? else { return Ok(None) };
            match frame.opcode {
                op::CHUNK => self.open_chunk(frame)?,
                op::SCHEMA | op::CHANNEL | op::MESSAGE => {
                    let content = self.frames.content(frame)?.to_vec();
                    let outcome = self.record(frame.opcode, Fields(&content));
                    if let Some(message) = outcome.map_err(|problem| self.frames.damaged(problem))? {
                        return Ok(Some(message));
                    }
                }
                // Read, not skipped: the checksum of the data section covers it.
                _ => {
                    self.frames.content(frame)?;
                }
            }
        }
    }

    fn open_chunk(&mut self, frame: Frame) -> Result<(), RecordingError> {
        let opened = ChunkRecord::parse(Fields(self.frames.content(frame)?))
            .ok_or_else(|| "a chunk's header is damaged".to_owned())
            .and_then(|chunk| decompress(&chunk));
        self.chunk = opened.map_err(|problem| self.frames.damaged(problem))?;
        self.taken = 0;
        Ok(())
    }

    /// Takes up a record of the data section; gives the message if it is one.
    fn record(&mut self, opcode: u8, content: Fields<'_>) -> Result<Option<Recorded>, &'static str> {
        match opcode {
            op::SCHEMA => {
                let (id, name) = fields::schema(content).ok_or("a schema is damaged")?;
                self.schemas.insert(id, name.to_owned());
                Ok(None)
            }
            op::CHANNEL => {
                let channel = ChannelRecord::parse(content).ok_or("a channel is damaged")?;
                let schema = self.schemas.get(&channel.schema).cloned().unwrap_or_default();
                let described = Channel {
                    path: Arc::clone(&self.frames.path),
                    topic: channel.topic.to_owned(),
                    schema,
                    encoding: channel.encoding.to_owned(),
                };
                self.channels.insert(channel.id, Arc::new(described));
                Ok(None)
            }
            op::MESSAGE => {
                let message = MessageRecord::parse(content).ok_or("a message's header is damaged")?;
                let channel = self.channels.get(&message.channel).ok_or("a message is on no channel")?;
                self.frames.messages += 1;
                Ok(Some(Recorded {
                    channel: Arc::clone(channel),
                    time_ns: message.log_time,
                    data: message.data.to_vec(),
                }))
            }
            _ => Ok(None),
        }
    }
}

impl Iterator for Reader {
    type Item = Result<Recorded, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let next = self.next_message().transpose();
        self.ended = !matches!(next, Some(Ok(_)));
        next
    }
}

/// The records of a chunk, once their checksum is right.
fn decompress(chunk: &ChunkRecord<'_>) -> Result<Vec<u8>, String> {
    if chunk.uncompressed_size > MAX_CHUNK_BYTES {
        return Err(format!("a chunk claims {} bytes, more than {MAX_CHUNK_BYTES}", chunk.uncompressed_size));
    }
    let records = match chunk.compression {
        "" => chunk.data.to_vec(),
        "zstd" => {
            let size = usize::try_from(chunk.uncompressed_size).map_err(|error| error.to_string())?;
            zstd::bulk::decompress(chunk.data, size)
                .map_err(|error| format!("a chunk is damaged: {error}"))?
        }
        other => {
            return Err(format!(
                "its compression is `{other}`; convert it with `mcap compress --compression zstd`"
            ));
        }
    };
    if records.len() as u64 != chunk.uncompressed_size {
        return Err(format!("a chunk has {} bytes, not {}", records.len(), chunk.uncompressed_size));
    }
    // 0: the writer did not compute one.
    if chunk.uncompressed_crc != 0 && chunk.uncompressed_crc != crc32fast::hash(&records) {
        return Err("a chunk's checksum does not match".to_owned());
    }
    Ok(records)
}
