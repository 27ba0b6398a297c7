//! An MCAP recording: images and truth, with the files that it was made from attached.

use std::path::Path;

use anyhow::Context;
use locoman_protocol::messages::{Header, Pose, ShellPose, Tracking, Verdict};
use locoman_protocol::recording::{self, Writer};

use super::{Instant, Output, Unfinished};

/// An MCAP recording.
#[derive(Debug)]
pub struct Recording {
    writer: Writer,
    unfinished: Unfinished,
}

impl Recording {
    /// Begins a recording; `attachments` are the names and texts of the files that it was made from.
    pub fn create(path: &Path, attachments: &[(&str, &str)]) -> anyhow::Result<Self> {
        let unfinished = Unfinished::new(path)?;
        let mut writer = Writer::create(&unfinished.temporary)?;
        for (name, text) in attachments {
            writer.attach(name, "application/toml", text.as_bytes())?;
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
