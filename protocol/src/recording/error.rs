//! What can be wrong with a recording, and what to do about it.

use std::io;
use std::path::{Path, PathBuf};

/// Why a recording could not be written or read. Each names the file.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// Not there, not a file, or not permitted.
    #[error("cannot open the recording `{}`: {source}", .path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Not created, or the disk is full.
    #[error("cannot write the recording `{}`: {source}; is the folder there and is there space?", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The disk failed.
    #[error("cannot read the recording `{}` at byte {offset}: {source}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Where.
        offset: u64,
        /// What the system says.
        source: io::Error,
    },
    /// Another kind of file.
    #[error(
        "`{}` is not an MCAP recording; give a file that `locoman-teleop record` or `locoman-sim operator` \
         wrote, or a folder of images", .path.display()
    )]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// Cut short or changed. What was read before stands.
    #[error(
        "the recording `{}` is damaged at byte {offset}: {problem}; the {messages} messages before it are \
         good: use those (`mcap recover` makes a whole file of them) or record again", .path.display()
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where the damaged record begins.
        offset: u64,
        /// Messages read before it.
        messages: u64,
        /// What is wrong.
        problem: String,
    },
    /// A topic that carries another message than asked for, or two types written to one topic.
    #[error("`{topic}` of the recording `{}` carries `{found}`, not `{expected}`", .path.display())]
    OtherType {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// The message type that was wanted.
        expected: String,
        /// The message type (or encoding) that is there.
        found: String,
    },
    /// Bytes that are not the message that the schema says.
    #[error(
        "the message at {time_ns} ns on `{topic}` of the recording `{}` is damaged: {source}; record again",
        .path.display()
    )]
    Decode {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// When it was logged.
        time_ns: u64,
        /// What protobuf says.
        source: prost::DecodeError,
    },
    /// A message that is not of this crate's schemas.
    #[error("`{name}` has no schema here: recordings hold the messages of `protocol/proto` alone")]
    NoSchema {
        /// Its full name.
        name: String,
    },
}

impl RecordingError {
    pub(super) fn write(path: &Path) -> impl Fn(mcap::McapError) -> Self {
        move |error| Self::Write {
            path: path.to_owned(),
            source: match error {
                mcap::McapError::Io(source) => source,
                other => io::Error::other(other),
            },
        }
    }
}
