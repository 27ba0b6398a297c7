//! One suite for every back end that needs no hardware.

use std::path::PathBuf;

use locoman_protocol::recording::{Writer, image, image_topic};
use opencv::core::{Mat, Size, Vector};
use opencv::imgcodecs;
use opencv::videoio::{VideoWriter, VideoWriterTrait, VideoWriterTraitConst};

use super::*;
use crate::rig::{CameraSource, Half};
use crate::testing;

const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;
const FRAMES: u64 = 4;
const PERIOD_NS: u64 = 100_000_000;
/// Two cameras, left and right half of the video.
const IDS: [&str; 2] = ["left", "right"];

fn rig() -> Rig {
    let mut cameras = testing::rig().cameras;
    cameras.truncate(2);
    for (camera, id) in cameras.iter_mut().zip(IDS) {
        camera.id = id.to_owned();
        (camera.width, camera.height) = (WIDTH, HEIGHT);
    }
    Rig::new(cameras)
}

/// What camera `camera` sees in frame `index`: one grey, so that any codec keeps it.
fn gray(index: u64, camera: usize) -> u8 {
    50 + 20 * index as u8 + 100 * camera as u8
}

fn mat(gray: u8) -> Mat {
    Mat::new_rows_cols_with_default(
        HEIGHT as i32,
        WIDTH as i32,
        opencv::core::CV_8UC1,
        f64::from(gray).into(),
    )
    .expect("mat")
}

fn encoded(gray: u8) -> Vec<u8> {
    let mut bytes = Vector::<u8>::new();
    imgcodecs::imencode(".jpg", &mat(gray), &mut bytes, &Vector::new()).expect("encode");
    bytes.iter().collect()
}

/// A fresh folder for one test.
fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("locoman-vision-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("folder");
    path
}

/// Every source delivers what was put in: all frames, by rising time, then in the rig's order.
fn conforms(mut sut: impl FrameSource) {
    /// Lossy codecs.
    const TOLERANCE: i32 = 12;
    let mut first_ns = None;
    for index in 0..FRAMES {
        for camera in 0..IDS.len() {
            let frame = sut.next_frame().expect("readable").expect("not yet at the end");
            assert_eq!(frame.camera, camera, "frame {index}");
            let first_ns = *first_ns.get_or_insert(frame.capture_ns);
            let expected_ns = index * PERIOD_NS;
            assert!((frame.capture_ns - first_ns).abs_diff(expected_ns) < 1_000_000, "frame {index}");
            let image = frame.pixels.to_gray().expect("an image");
            assert_eq!((image.width(), image.height()), (WIDTH, HEIGHT));
            let middle = i32::from(image.row(HEIGHT / 2)[WIDTH as usize / 2]);
            let difference = middle - i32::from(gray(index, camera));
            assert!(difference.abs() < TOLERANCE, "frame {index} of {camera}: {difference}");
        }
    }
    assert_eq!(sut.next_frame().expect("readable"), None);
    assert_eq!(sut.next_frame().expect("readable"), None, "the end stays the end");
    assert_eq!(sut.skipped(), 0);
}

fn write_folder(path: &Path) {
    for (camera, id) in IDS.iter().enumerate() {
        let data = path.join(id).join("data");
        std::fs::create_dir_all(&data).expect("folder");
        for index in 0..FRAMES {
            let file = data.join(format!("{}.jpg", 10_u64.pow(9) + index * PERIOD_NS));
            std::fs::write(file, encoded(gray(index, camera))).expect("file");
        }
    }
}

fn write_recording(path: &Path) {
    let mut writer = Writer::create(path).expect("writer");
    for index in 0..FRAMES {
        let time_ns = 10_u64.pow(9) + index * PERIOD_NS;
        for (camera, id) in IDS.iter().enumerate() {
            let message = image(id, time_ns, "jpeg", encoded(gray(index, camera)));
            writer.write(&image_topic(id), time_ns, &message).expect("write");
        }
    }
    writer.finish().expect("finish");
}

#[test]
fn a_folder_of_images_conforms() {
    let path = folder("asl");
    write_folder(&path);
    conforms(ImageFolder::open(&path, &rig()).expect("open"));
    conforms(open_recording(&path, &rig()).expect("open"));
}

#[test]
fn a_recording_conforms() {
    let path = folder("mcap").join("recording.mcap");
    write_recording(&path);
    conforms(Recording::open(&path, &rig()).expect("open"));
    conforms(open_recording(&path, &rig()).expect("open"));
}

#[test]
fn a_side_by_side_video_conforms() {
    let path = folder("video").join("zed.avi");
    let fourcc = VideoWriter::fourcc('M', 'J', 'P', 'G').expect("fourcc");
    let rate = 1e9 / PERIOD_NS as f64;
    let size = Size::new(2 * WIDTH as i32, HEIGHT as i32);
    let mut writer = VideoWriter::new(&path, fourcc, rate, size, false).expect("writer");
    assert!(writer.is_opened().expect("writer"));
    for index in 0..FRAMES {
        let mut both = Mat::default();
        let halves: Vector<Mat> = (0..2).map(|camera| mat(gray(index, camera))).collect();
        opencv::core::hconcat(&halves, &mut both).expect("join");
        writer.write(&both).expect("write");
    }
    writer.release().expect("release");
    let mut rig = rig();
    for (source, half) in rig.sources.iter_mut().zip([Half::Left, Half::Right]) {
        *source = CameraSource { file: Some(path.clone()), half: Some(half), ..CameraSource::default() };
    }
    conforms(VideoSource::open(&rig).expect("open"));
}

#[test]
fn a_missing_camera_is_named_with_the_remedy() {
    let path = folder("missing");
    write_folder(&path);
    let file = path.join("recording.mcap");
    write_recording(&file);
    let mut rig = rig();
    rig.cameras[1].id = "rihgt".to_owned();
    let message = |outcome: Result<Box<dyn FrameSource>, SourceError>| match outcome {
        Ok(_) => panic!("opened"),
        Err(error) => error.to_string(),
    };
    let complaint = message(open_recording(&path, &rig));
    assert!(complaint.contains("`rihgt`") && complaint.contains("left"), "{complaint}");
    let complaint = message(open_recording(&file, &rig));
    assert!(complaint.contains("did you mean `right`?"), "{complaint}");
    rig.cameras.truncate(1);
    rig.sources.truncate(1);
    let complaint = message(open_recording(&file, &rig));
    assert!(complaint.contains("`right` is not in the rig file"), "{complaint}");
    let complaint = message(open_recording(&path.join("nothing.mcap"), &rig));
    assert!(complaint.contains("nothing.mcap"), "{complaint}");
}

#[test]
fn a_rig_without_live_sources_is_refused() {
    let error = VideoSource::open(&rig()).err().expect("no source").to_string();
    assert!(error.contains("`left`") && error.contains("/dev/video0"), "{error}");
    let mut rig = rig();
    rig.sources[0].device = Some("/dev/no-such-video".into());
    let error = VideoSource::open(&rig).err().expect("no device").to_string();
    assert!(error.contains("/dev/no-such-video"), "{error}");
}

#[test]
fn empty_files_and_odd_names_are_skipped_and_counted() {
    let path = folder("odd");
    write_folder(&path);
    std::fs::write(path.join("left/data/5.png"), b"").expect("file");
    std::fs::write(path.join("left/data/first.png"), b"x").expect("file");
    std::fs::write(path.join("left/data/readme.txt"), b"x").expect("file");
    let mut sut = ImageFolder::open(&path, &rig()).expect("open");
    let mut count = 0;
    while sut.next_frame().expect("readable").is_some() {
        count += 1;
    }
    assert_eq!((count, sut.skipped()), (FRAMES * 2, 2));
}
