//! Recordings: what is written is read back, here and by the reference reader, and damage never does worse
//! than an error.

#![expect(clippy::unwrap_used, reason = "helpers of tests: a panic is the report")]

use locoman_protocol::messages::foxglove::CompressedImage;
use locoman_protocol::messages::{Event, Tracking};
use locoman_protocol::recording::{Overview, Reader, Recorded, RecordingError, Writer, image, image_topic};
use proptest::prelude::*;
use std::fs;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// A file of one test, removed with it.
struct TestFile(PathBuf);

impl TestFile {
    fn new() -> Self {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        Self(std::env::temp_dir().join(format!("locoman-recording-{}-{count}.mcap", std::process::id())))
    }

    fn with(bytes: &[u8]) -> Self {
        let file = Self::new();
        fs::write(&file.0, bytes).unwrap();
        file
    }
}

impl Deref for TestFile {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.0
    }
}

impl Drop for TestFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

const IMAGES: u64 = 60;
const IMAGE_BYTES: usize = 60_000;
const FRAME_NS: u64 = 33_333_333;

/// Not compressible, as JPEG is not.
fn noise(seed: u64) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state.to_le_bytes()[0]
    };
    (0..IMAGE_BYTES).map(|_| next()).collect()
}

fn write_session(writer: &mut Writer) {
    writer.attach("rig.toml", "application/toml", b"[[camera]]\n").unwrap();
    for index in 0..IMAGES {
        let time_ns = 5_000_000_000 + index * FRAME_NS;
        let picture = image("left", time_ns, "jpeg", noise(index));
        writer.write(&image_topic("left"), time_ns, &picture).unwrap();
        let truth = Tracking { age_ns: index, ..Tracking::default() };
        writer.write("/truth/shells", time_ns, &truth).unwrap();
    }
}

fn session() -> TestFile {
    let file = TestFile::new();
    let mut writer = Writer::create(&*file).unwrap();
    write_session(&mut writer);
    writer.finish().unwrap();
    file
}

fn read(path: &Path) -> (Vec<Recorded>, Option<RecordingError>) {
    let mut messages = Vec::new();
    for message in Reader::open(path).unwrap() {
        match message {
            Ok(message) => messages.push(message),
            Err(error) => return (messages, Some(error)),
        }
    }
    (messages, None)
}

#[test]
fn what_is_written_is_read_back_in_order() {
    let file = session();
    let (messages, error) = read(&file);
    assert!(error.is_none(), "{error:?}");
    assert_eq!(messages.len() as u64, 2 * IMAGES);
    for (index, pair) in (0..).zip(messages.chunks(2)) {
        let picture: CompressedImage = pair[0].decode().unwrap();
        assert_eq!(pair[0].topic(), "/camera/left/image");
        assert_eq!(picture.data, noise(index));
        let truth: Tracking = pair[1].decode().unwrap();
        assert_eq!((truth.age_ns, pair[1].time_ns), (index, 5_000_000_000 + index * FRAME_NS));
    }
}

#[test]
fn the_overview_counts_without_reading() {
    let overview = Overview::read(&*session()).unwrap();
    assert!(overview.complete);
    assert_eq!(overview.topics["/camera/left/image"], IMAGES);
    assert_eq!(overview.topics["/truth/shells"], IMAGES);
    assert_eq!(overview.start_ns, 5_000_000_000);
    assert_eq!(overview.end_ns, 5_000_000_000 + (IMAGES - 1) * FRAME_NS);
    assert_eq!(overview.attachment("rig.toml").unwrap().data, b"[[camera]]\n");
}

#[test]
fn the_reference_reader_agrees() {
    let bytes = fs::read(&*session()).unwrap();
    let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().collect::<Result<_, _>>().unwrap();
    assert_eq!(messages.len() as u64, 2 * IMAGES);
    let schema = messages[0].channel.schema.as_ref().unwrap();
    assert_eq!((schema.name.as_str(), schema.encoding.as_str()), ("foxglove.CompressedImage", "protobuf"));
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert!(summary.chunk_indexes.iter().all(|chunk| chunk.uncompressed_size < 1_200_000));
    assert!(summary.chunk_indexes.len() > 2);
}

#[test]
fn the_same_session_makes_the_same_file() {
    assert!(fs::read(&*session()).unwrap() == fs::read(&*session()).unwrap());
}

#[test]
fn a_killed_recorder_loses_a_second_at_most() {
    let file = TestFile::new();
    let mut writer = Writer::create(&*file).unwrap();
    write_session(&mut writer);
    // Killed: neither finished nor dropped.
    std::mem::forget(writer);
    let (messages, error) = read(&file);
    assert!(matches!(error, Some(RecordingError::Damaged { .. })), "{error:?}");
    let last_ns = messages.last().unwrap().time_ns;
    assert!(last_ns + 1_000_000_000 >= 5_000_000_000 + (IMAGES - 1) * FRAME_NS - FRAME_NS);
    let overview = Overview::read(&*file).unwrap();
    assert!(!overview.complete);
    assert_eq!(overview.topics.values().sum::<u64>(), messages.len() as u64);
    assert!(overview.attachment("rig.toml").is_some());
}

#[test]
fn a_message_of_another_type_is_an_error_that_names_both() {
    let file = session();
    let (messages, _) = read(&file);
    let error = messages[1].decode::<Event>().unwrap_err().to_string();
    for part in ["/truth/shells", "locoman.Tracking", "locoman.Event", ".mcap"] {
        assert!(error.contains(part), "{error}");
    }
    let mut writer = Writer::create(&*TestFile::new()).unwrap();
    writer.write("/event", 0, &Event::default()).unwrap();
    let error = writer.write("/event", 0, &Tracking::default()).unwrap_err();
    assert!(matches!(error, RecordingError::OtherType { .. }));
}

#[test]
fn files_that_are_no_recordings_are_told_apart() {
    for bytes in [&b""[..], b"\x89MCAP0", b"not a recording at all", b"\x89PNG\r\n\x1a\n..."] {
        let error = Reader::open(&*TestFile::with(bytes)).unwrap_err();
        assert!(matches!(error, RecordingError::Foreign { .. }), "{error}");
    }
    let error = Reader::open("/nowhere/there.mcap").unwrap_err();
    assert!(error.to_string().contains("/nowhere/there.mcap"), "{error}");
    let error = Writer::create("/nowhere/there.mcap").unwrap_err();
    assert!(error.to_string().contains("/nowhere/there.mcap"), "{error}");
}

#[test]
fn the_header_alone_is_damaged_and_empty() {
    let (messages, error) = read(&TestFile::with(mcap::MAGIC));
    assert!(messages.is_empty());
    assert!(matches!(error, Some(RecordingError::Damaged { offset: 8, messages: 0, .. })), "{error:?}");
}

/// Every message read is one that was written, in order.
fn assert_prefix(messages: &[Recorded], whole: &[Recorded]) -> Result<(), TestCaseError> {
    prop_assert!(messages.len() <= whole.len());
    for (read, written) in messages.iter().zip(whole) {
        prop_assert!(read.time_ns == written.time_ns && read.data == written.data);
    }
    Ok(())
}

fn small_session() -> Vec<u8> {
    let file = TestFile::new();
    let mut writer = Writer::create(&*file).unwrap();
    writer.attach("rig.toml", "application/toml", b"[[camera]]\n").unwrap();
    writer.metadata("facts", [("seed".to_owned(), "1".to_owned())].into()).unwrap();
    for index in 0..12 {
        let event = Event { name: format!("event {index}"), ..Event::default() };
        writer.write("/event", index * 400_000_000, &event).unwrap();
    }
    writer.finish().unwrap();
    fs::read(&*file).unwrap()
}

/// Where the record that ends the data section begins.
fn data_section_end(bytes: &[u8]) -> usize {
    let mut offset = mcap::MAGIC.len();
    while bytes[offset] != mcap::records::op::DATA_END {
        offset += 9 + u64::from_le_bytes(bytes[offset + 1..offset + 9].try_into().unwrap()) as usize;
    }
    offset
}

#[test]
fn a_reader_that_failed_has_ended() {
    let bytes = small_session();
    let mut reader = Reader::open(&*TestFile::with(&bytes[..bytes.len() / 2])).unwrap();
    assert!(reader.by_ref().any(|message| message.is_err()));
    assert!(reader.next().is_none());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn a_file_cut_anywhere_gives_what_came_before(cut in any::<prop::sample::Index>()) {
        let bytes = small_session();
        let (whole, _) = read(&TestFile::with(&bytes));
        let cut = cut.index(bytes.len());
        let file = TestFile::with(&bytes[..cut]);
        match Reader::open(&*file) {
            Ok(_) => {
                let (messages, error) = read(&file);
                prop_assert!(error.is_some(), "cut at {cut} of {}", bytes.len());
                assert_prefix(&messages, &whole)?;
            }
            Err(error) => prop_assert!(cut < mcap::MAGIC.len(), "{error}"),
        }
        let _ = Overview::read(&*file);
    }

    #[test]
    fn changed_bytes_are_noticed_and_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let original = small_session();
        let (whole, _) = read(&TestFile::with(&original));
        // The magic stays: without it the file is another's.
        let data_bytes = data_section_end(&original) - mcap::MAGIC.len();
        let mut bytes = original.clone();
        for (place, value) in changes {
            bytes[mcap::MAGIC.len() + place.index(data_bytes)] = value;
        }
        let file = TestFile::with(&bytes);
        let (messages, error) = read(&file);
        prop_assert_eq!(error.is_some(), bytes != original);
        prop_assert!(messages.len() <= whole.len());
        for message in &messages {
            let _ = message.decode::<Event>();
        }
        let _ = Overview::read(&*file);
    }

    #[test]
    fn a_changed_summary_never_panics(place in any::<prop::sample::Index>(), value: u8) {
        let mut bytes = small_session();
        let begin = data_section_end(&bytes);
        let place = begin + place.index(bytes.len() - begin);
        bytes[place] = value;
        let file = TestFile::with(&bytes);
        let _ = read(&file);
        let _ = Overview::read(&*file);
    }

    #[test]
    fn anything_after_the_magic_is_read_or_refused(
        bytes in prop::collection::vec(any::<u8>(), 0..400),
        // Opcodes and small lengths, so that some of it makes sense.
        records in prop::collection::vec((0u8..18, 0u8..40, prop::collection::vec(any::<u8>(), 0..40)), 0..12),
    ) {
        let mut file = mcap::MAGIC.to_vec();
        for (opcode, length, content) in records {
            file.push(opcode);
            file.extend(u64::from(length).to_le_bytes());
            file.extend(content);
        }
        file.extend(bytes);
        let file = TestFile::with(&file);
        for message in Reader::open(&*file).unwrap().flatten() {
            let _ = message.decode::<Event>();
        }
        let _ = Overview::read(&*file);
    }
}
