//! `record`: the live cameras of a rig into a recording, as JPEG with their capture times.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use locoman_protocol::recording::{self, Writer};
use locoman_vision::image::Pixels;
use locoman_vision::rig::Rig;

use crate::sources;

/// Good enough that tags lose nothing measurable, a tenth of the bytes of PNG.
const JPEG_QUALITY: i32 = 92;

/// Records until `seconds` have passed, the cameras end, or `stop` is set; gives back the frames written.
pub fn run(rig: &Rig, rig_text: &str, output: &Path, seconds: Option<f64>, stop: &AtomicBool) -> Result<u64> {
    let mut source = sources::cameras(rig)?;
    let mut writer = Writer::create(output)?;
    writer.attach("rig.toml", "application/toml", rig_text.as_bytes())?;
    let deadline = seconds.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds));
    let mut frames = 0;
    while !stop.load(Ordering::Relaxed) && deadline.is_none_or(|deadline| Instant::now() < deadline) {
        let Some(frame) = source.next_frame()? else { break };
        let camera = &rig.cameras.get(frame.camera).context("a frame of a camera that the rig has not")?.id;
        let jpeg = match frame.pixels {
            Pixels::Encoded(bytes) => bytes,
            Pixels::Gray(image) => image.to_jpeg(JPEG_QUALITY)?,
        };
        let image = recording::image(camera, frame.capture_ns, "jpeg", jpeg);
        writer.write(&recording::image_topic(camera), frame.capture_ns, &image)?;
        frames += 1;
    }
    writer.finish()?;
    ensure!(frames > 0, "the cameras of the rig gave no image; see `locoman-teleop doctor`");
    Ok(frames)
}
