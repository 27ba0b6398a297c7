//! The capture thread: hands over each frame when its time has come.

use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::Duration;

use locoman_vision::image::Frame;
use locoman_vision::source::{FrameSource, SourceError};

use super::{Counters, Inbox, Outlook, Sighting, ToStation};

/// Between two looks at whether everything ends.
const NAP: Duration = Duration::from_millis(100);

/// Hands frames over.
pub(super) struct Capture {
    pub here: Vec<bool>,
    pub now_ns: Arc<dyn Fn() -> u64 + Send + Sync>,
    pub to_station: ToStation,
    pub sightings: SyncSender<Sighting>,
}

impl Capture {
    /// Runs until the source ends or everything does. Frames from the future wait for their time (a replay); those
    /// of the past go out at once (cameras).
    pub fn run(
        self,
        mut source: Box<dyn FrameSource>,
        frames: &Inbox<Frame>,
        outlook: &Outlook,
        counters: &Counters,
    ) -> Result<(), SourceError> {
        let outcome = loop {
            if outlook.stopping() {
                break Ok(());
            }
            match source.next_frame() {
                Ok(Some(frame)) if self.here.get(frame.camera) == Some(&true) => {
                    self.wait_for(frame.capture_ns, outlook);
                    if !outlook.stopping() {
                        self.hand_over(frame, frames, counters);
                    }
                }
                Ok(Some(_)) => {}
                Ok(None) => break Ok(()),
                Err(error) => break Err(error),
            }
        };
        frames.close();
        outcome
    }

    fn wait_for(&self, due_ns: u64, outlook: &Outlook) {
        while !outlook.stopping() {
            let wait = Duration::from_nanos(due_ns.saturating_sub((self.now_ns)()));
            if wait.is_zero() {
                return;
            }
            std::thread::sleep(wait.min(NAP));
        }
    }

    fn hand_over(&self, mut frame: Frame, frames: &Inbox<Frame>, counters: &Counters) {
        let camera = frame.camera;
        counters.count(camera, |counters| &counters.frames);
        counters.set(camera, |counters| &counters.heard_ns, (self.now_ns)());
        // Nobody could tell when this frame was: it is of no use.
        let Some(capture_ns) = (self.to_station)(frame.capture_ns) else {
            counters.count(camera, |counters| &counters.dropped);
            return;
        };
        frame.capture_ns = capture_ns;
        // The receiver goes last; if it is gone, so is the use of it.
        let _ = self.sightings.send(Sighting::Arrived { camera, capture_ns });
        if let Some(displaced) = frames.put(camera, frame) {
            counters.count(camera, |counters| &counters.dropped);
            let _ = self.sightings.send(Sighting::Displaced { camera, capture_ns: displaced.capture_ns });
        }
    }
}
