//! The camera thread: hands over each set of frames when its time has come; the newest wins, and what the
//! tracker had no time for is counted.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use locoman_protocol::clock::monotonic_ns;
use locoman_vision::source::{FrameSet, FrameSets, FrameSource, SourceError};

use crate::latest::Latest;

/// Frames of a set lie closer together than this: half the period of 60 Hz cameras.
pub const SET_TOLERANCE_NS: u64 = 8_000_000;

/// What the camera thread shares with the tracker.
#[derive(Debug)]
pub struct Feed {
    /// The newest set.
    pub sets: Latest<FrameSet>,
    /// For each camera: frames delivered, and frames that nobody took.
    pub frames: Vec<AtomicU64>,
    /// See [`Feed::frames`].
    pub dropped: Vec<AtomicU64>,
}

impl Feed {
    /// For a rig of so many cameras.
    pub fn new(cameras: usize) -> Self {
        let zeros = || (0..cameras).map(|_| AtomicU64::new(0)).collect();
        Self { sets: Latest::default(), frames: zeros(), dropped: zeros() }
    }

    fn put(&self, set: FrameSet) {
        count(&self.frames, &set);
        if let Some(displaced) = self.sets.put(set) {
            count(&self.dropped, &displaced);
        }
    }
}

fn count(counters: &[AtomicU64], set: &FrameSet) {
    for frame in &set.frames {
        if let Some(counter) = counters.get(frame.camera) {
            counter.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// A boxed source is a source.
pub struct Boxed(pub Box<dyn FrameSource>);

impl FrameSource for Boxed {
    fn next_frame(&mut self) -> Result<Option<locoman_vision::image::Frame>, SourceError> {
        self.0.next_frame()
    }

    fn skipped(&self) -> u64 {
        self.0.skipped()
    }
}

/// Runs until the source ends or `stop` is set. Sets from the future wait for their time (a replay); sets
/// of the past go out at once (cameras).
pub fn run(source: Box<dyn FrameSource>, feed: &Arc<Feed>, stop: &AtomicBool) -> Result<(), SourceError> {
    let mut sets = FrameSets::new(Boxed(source), feed.frames.len(), SET_TOLERANCE_NS);
    let outcome = loop {
        if stop.load(Ordering::Relaxed) {
            break Ok(());
        }
        match sets.next_set() {
            Ok(Some(set)) => {
                let due_ns = set.frames.iter().map(|frame| frame.capture_ns).max().unwrap_or(0);
                while !stop.load(Ordering::Relaxed) {
                    let wait_ns = due_ns.saturating_sub(monotonic_ns());
                    if wait_ns == 0 {
                        break;
                    }
                    std::thread::sleep(Duration::from_nanos(wait_ns.min(100_000_000)));
                }
                feed.put(set);
            }
            Ok(None) => break Ok(()),
            Err(error) => break Err(error),
        }
    };
    feed.sets.close();
    outcome
}
