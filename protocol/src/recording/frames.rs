//! The file as a row of records: opcode, length, content.
//!
//! Reads forward with one buffer of the size of the largest record. A length is believed only as far as the
//! file reaches, so a damaged one can neither allocate nor seek beyond it.

use super::RecordingError;
use mcap::records::op;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;
use std::sync::Arc;

/// Opcode and length.
const FRAME_BYTES: u64 = 1 + 8;
const BUFFER_BYTES: usize = 256 * 1024;

/// Where the reading stands.
#[derive(Debug)]
pub(super) struct Frames {
    pub(super) path: Arc<Path>,
    file: BufReader<File>,
    length: u64,
    offset: u64,
    /// Begin of the record read last, for errors.
    record_offset: u64,
    /// Over everything before the end of the data section; `None` once something was skipped.
    crc: Option<crc32fast::Hasher>,
    content: Vec<u8>,
    /// Counted by the reader of messages, reported in errors.
    pub(super) messages: u64,
}

/// A record's opcode and the length of its content.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) opcode: u8,
    pub(super) length: u64,
}

impl Frames {
    /// Opens a file that begins as an MCAP file does.
    pub(super) fn open(path: &Path) -> Result<Self, RecordingError> {
        let cannot_open = |source| RecordingError::Open { path: path.to_owned(), source };
        let file = File::open(path).map_err(cannot_open)?;
        let length = file.metadata().map_err(cannot_open)?.len();
        let mut frames = Self {
            path: path.into(),
            file: BufReader::with_capacity(BUFFER_BYTES, file),
            length,
            offset: 0,
            record_offset: 0,
            crc: Some(crc32fast::Hasher::new()),
            content: Vec::new(),
            messages: 0,
        };
        let foreign = || RecordingError::Foreign { path: path.to_owned() };
        let magic = mcap::MAGIC.len() as u64;
        if length < magic || frames.read(magic)? != mcap::MAGIC {
            return Err(foreign());
        }
        Ok(frames)
    }

    /// The next record's frame; `None` after a whole file's end.
    pub(super) fn next_frame(&mut self) -> Result<Option<Frame>, RecordingError> {
        self.record_offset = self.offset;
        if self.remaining() < FRAME_BYTES {
            return Err(self.damaged("it ends without a footer, as when the recorder was killed"));
        }
        let data_crc = self.crc.clone();
        let head = self.read(FRAME_BYTES)?;
        let opcode = head.first().copied().unwrap_or_default();
        let length = head.get(1..).and_then(|rest| rest.try_into().ok()).map_or(0, u64::from_le_bytes);
        if length > self.remaining() {
            return Err(self.damaged("it ends in the middle of a record"));
        }
        match opcode {
            op::FOOTER => {
                self.read(length)?;
                let magic = self.remaining().min(mcap::MAGIC.len() as u64);
                if self.read(magic)? != mcap::MAGIC {
                    return Err(self.damaged("the closing mark is missing"));
                }
                Ok(None)
            }
            op::DATA_END => {
                let stored = self.read(length)?.first_chunk().copied().map_or(0, u32::from_le_bytes);
                // 0: the writer did not compute one.
                if stored != 0 && data_crc.is_some_and(|crc| crc.finalize() != stored) {
                    return Err(self.damaged("the checksum of the data section does not match"));
                }
                Ok(Some(Frame { opcode, length: 0 }))
            }
            _ => Ok(Some(Frame { opcode, length })),
        }
    }

    /// The content of the frame just read.
    pub(super) fn content(&mut self, frame: Frame) -> Result<&[u8], RecordingError> {
        self.read(frame.length)
    }

    /// Passes over the content of the frame just read, without checking it.
    pub(super) fn skip(&mut self, frame: Frame) -> Result<(), RecordingError> {
        let distance = i64::try_from(frame.length).map_err(|_| self.damaged("a record is too long"))?;
        self.file.seek_relative(distance).map_err(|source| self.unreadable(source))?;
        self.offset += frame.length;
        self.crc = None;
        Ok(())
    }

    /// An error at the record read last.
    pub(super) fn damaged(&self, problem: impl Into<String>) -> RecordingError {
        RecordingError::Damaged {
            path: self.path.to_path_buf(),
            offset: self.record_offset,
            messages: self.messages,
            problem: problem.into(),
        }
    }

    fn remaining(&self) -> u64 {
        self.length.saturating_sub(self.offset)
    }

    fn read(&mut self, length: u64) -> Result<&[u8], RecordingError> {
        self.content.clear();
        let read = (&mut self.file).take(length).read_to_end(&mut self.content);
        match read {
            Ok(count) if count as u64 == length => {}
            // The file shrank while it was read.
            Ok(_) => return Err(self.damaged("it ends in the middle of a record")),
            Err(source) => return Err(self.unreadable(source)),
        }
        self.offset += length;
        if let Some(crc) = &mut self.crc {
            crc.update(&self.content);
        }
        Ok(&self.content)
    }

    fn unreadable(&self, source: io::Error) -> RecordingError {
        RecordingError::Read { path: self.path.to_path_buf(), offset: self.offset, source }
    }
}
