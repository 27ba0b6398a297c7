//! The messages, generated from `proto/*.proto` (whose comments are the documentation below).

#![expect(missing_docs, reason = "generated; a field whose name says all has no comment in the schema")]

include!(concat!(env!("OUT_DIR"), "/locoman.rs"));

/// The part of Foxglove's well-known schemas that recordings use, field for field as published.
pub mod foxglove {
    include!(concat!(env!("OUT_DIR"), "/foxglove.rs"));
}

/// Every schema of this crate as a serialized `google.protobuf.FileDescriptorSet`.
pub(crate) const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/descriptors.bin"));
