//! The schema that a recording carries for a message: the file that defines it and what that imports.

use super::RecordingError;
use crate::messages::DESCRIPTORS;
use prost::Message;
use prost_types::{FileDescriptorProto, FileDescriptorSet};

/// A serialized `FileDescriptorSet`, dependencies first, as <https://mcap.dev/spec/registry#protobuf-1> asks.
pub(super) fn descriptor_set<M: prost::Name>() -> Result<Vec<u8>, RecordingError> {
    let no_schema = || RecordingError::NoSchema { name: M::full_name() };
    let all = FileDescriptorSet::decode(DESCRIPTORS).map_err(|_| no_schema())?;
    let defines = |file: &&FileDescriptorProto| {
        file.package() == M::PACKAGE && file.message_type.iter().any(|message| message.name() == M::NAME)
    };
    let file = all.file.iter().find(defines).ok_or_else(no_schema)?;
    let mut chosen = FileDescriptorSet::default();
    add(file, &all, &mut chosen);
    Ok(chosen.encode_to_vec())
}

/// Imports form no circles: the schemas' compiler refuses them.
fn add(file: &FileDescriptorProto, all: &FileDescriptorSet, chosen: &mut FileDescriptorSet) {
    for import in &file.dependency {
        if let Some(imported) = all.file.iter().find(|other| other.name() == import) {
            add(imported, all, chosen);
        }
    }
    if !chosen.file.iter().any(|other| other.name() == file.name()) {
        chosen.file.push(file.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::foxglove::CompressedImage;
    use crate::messages::{Tracking, stop};

    #[test]
    fn a_schema_brings_its_imports_before_itself() {
        let set = descriptor_set::<CompressedImage>().unwrap();
        let set = FileDescriptorSet::decode(set.as_slice()).unwrap();
        let files: Vec<_> = set.file.iter().map(FileDescriptorProto::name).collect();
        assert_eq!(files, ["google/protobuf/timestamp.proto", "foxglove.proto"]);
    }

    #[test]
    fn our_messages_need_no_imports() {
        let set = descriptor_set::<Tracking>().unwrap();
        let set = FileDescriptorSet::decode(set.as_slice()).unwrap();
        assert_eq!(set.file.len(), 1);
        assert_eq!(set.file[0].package(), "locoman");
        // The schema's enums came along.
        assert_eq!(stop::Level::Damp.as_str_name(), "LEVEL_DAMP");
    }

    /// Field numbers as published in foxglove/foxglove-sdk, `schemas/proto/foxglove/*.proto`.
    #[test]
    fn foxglove_fields_have_the_published_numbers() {
        let published: [(&str, &[(&str, i32)]); 6] = [
            ("CompressedImage", &[("timestamp", 1), ("frame_id", 4), ("data", 2), ("format", 3)]),
            (
                "CameraCalibration",
                &[
                    ("timestamp", 1),
                    ("frame_id", 9),
                    ("width", 2),
                    ("height", 3),
                    ("distortion_model", 4),
                    ("D", 5),
                    ("K", 6),
                    ("R", 7),
                    ("P", 8),
                ],
            ),
            ("Vector3", &[("x", 1), ("y", 2), ("z", 3)]),
            ("Quaternion", &[("x", 1), ("y", 2), ("z", 3), ("w", 4)]),
            (
                "FrameTransform",
                &[
                    ("timestamp", 1),
                    ("parent_frame_id", 2),
                    ("child_frame_id", 3),
                    ("translation", 4),
                    ("rotation", 5),
                ],
            ),
            ("FrameTransforms", &[("transforms", 1)]),
        ];
        let all = FileDescriptorSet::decode(DESCRIPTORS).unwrap();
        let file = all.file.iter().find(|file| file.package() == "foxglove").unwrap();
        assert_eq!(file.message_type.len(), published.len());
        for (name, fields) in published {
            let message = file.message_type.iter().find(|message| message.name() == name).unwrap();
            let ours: Vec<_> = message.field.iter().map(|field| (field.name(), field.number())).collect();
            assert_eq!(ours, fields, "{name}");
        }
    }
}
