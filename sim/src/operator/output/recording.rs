//! An MCAP recording: images and truth, with the files that it was made from attached.

use std::path::Path;

use anyhow::Context;
use locoman_protocol::messages::foxglove::CameraCalibration;
use locoman_protocol::messages::{Header, Pose, ShellPose, Tracking, Verdict};
use locoman_protocol::recording::{self, Writer};
use locoman_vision::camera::{Camera, Distortion};

use crate::operator::FIRST_CAPTURE_NS;

use super::{Instant, Output, Unfinished};

/// An MCAP recording.
#[derive(Debug)]
pub struct Recording {
    writer: Writer,
    unfinished: Unfinished,
}

impl Recording {
    /// Begins a recording; `attachments` are the names and texts of the files that it was made from.
    pub fn create<'a>(
        path: &Path,
        attachments: &[(&str, &str)],
        cameras: impl Iterator<Item = &'a Camera>,
    ) -> anyhow::Result<Self> {
        let unfinished = Unfinished::new(path)?;
        let mut writer = Writer::create(&unfinished.temporary)?;
        for (name, text) in attachments {
            writer.attach(name, "application/toml", text.as_bytes())?;
        }
        for camera in cameras {
            let topic = recording::calibration_topic(&camera.id);
            writer.write(&topic, FIRST_CAPTURE_NS, &calibration(camera))?;
        }
        Ok(Self { writer, unfinished })
    }
}

impl Output for Recording {
    fn add(&mut self, instant: &Instant<'_>) -> anyhow::Result<()> {
        let time_ns = instant.capture_ns;
        self.writer.write("/truth/shells", time_ns, &truth(instant))?;
        for image in &instant.images {
            let data = image.jpeg.clone().context("a recording needs JPEG images")?;
            let message = recording::image(image.camera, time_ns, "jpeg", data);
            self.writer.write(&recording::image_topic(image.camera), time_ns, &message)?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> anyhow::Result<()> {
        let Self { writer, unfinished } = *self;
        writer.finish()?;
        unfinished.keep()
    }
}

/// Intrinsics in the order of Foxglove's schema, which is OpenCV's.
fn calibration(camera: &Camera) -> CameraCalibration {
    let ((fx, fy), (cx, cy)) =
        ((camera.focal_px.x, camera.focal_px.y), (camera.center_px.x, camera.center_px.y));
    let (distortion_model, d) = match &camera.distortion {
        Distortion::Pinhole => ("plumb_bob", vec![0.0; 5]),
        Distortion::RadTan(k) if k[5..] == [0.0; 3] => ("plumb_bob", k[..5].to_vec()),
        Distortion::RadTan(k) => ("rational_polynomial", k.to_vec()),
        Distortion::Fisheye(k) => ("kannala_brandt", k.to_vec()),
    };
    CameraCalibration {
        timestamp: Some(recording::timestamp(FIRST_CAPTURE_NS)),
        frame_id: camera.id.clone(),
        width: camera.width,
        height: camera.height,
        distortion_model: distortion_model.to_owned(),
        d,
        k: vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: vec![fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }
}

/// The truth as the tracker's own message: all shells tracked, without error.
fn truth(instant: &Instant<'_>) -> Tracking {
    let shells = instant.bodies.iter().map(|&body| ShellPose {
        shell: body.name().to_owned(),
        verdict: Verdict::Tracked.into(),
        pose: Some(Pose::from(instant.posture.of(body))),
        ..ShellPose::default()
    });
    Tracking {
        header: Some(Header {
            sequence: instant.number,
            capture_ns: instant.capture_ns,
            ..Header::default()
        }),
        shells: shells.collect(),
        ..Tracking::default()
    }
}
