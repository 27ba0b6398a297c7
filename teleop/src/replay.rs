//! A recording as if it happened now: paced by its own stamps, captured "now", over and over.
//!
//! Capture times are moved to this machine's clock, so that everything behind (latency, staleness, the
//! robot's watchdogs) works as with cameras. At the end the recording begins again, one frame period later.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use locoman_vision::image::Frame;
use locoman_vision::source::{FrameSource, SourceError};

/// Opens the recording anew for each turn.
pub type Reopen = Box<dyn FnMut() -> Result<Box<dyn FrameSource>, SourceError> + Send>;

/// Between turns of a recording that does not tell its frame period.
const DEFAULT_PERIOD_NS: u64 = 33_333_333;

/// A wish that a replay begin anew.
#[derive(Debug, Default)]
pub struct Rewind(AtomicU64);

impl Rewind {
    /// The first frame is to be captured at this time (not 0).
    pub fn at(&self, start_ns: u64) {
        self.0.store(start_ns, Ordering::Relaxed);
    }

    fn take(&self) -> Option<u64> {
        let start_ns = self.0.swap(0, Ordering::Relaxed);
        (start_ns != 0).then_some(start_ns)
    }
}

/// A source that never ends; its capture times count from `start_ns`.
pub struct Replay {
    reopen: Reopen,
    source: Box<dyn FrameSource>,
    start_ns: u64,
    /// First capture time of the recording, once known.
    first_ns: Option<u64>,
    last_ns: u64,
    period_ns: u64,
    skipped: u64,
    turns: u64,
    rewind: Arc<Rewind>,
}

impl Replay {
    /// Opens the recording; its first frame will be captured at `start_ns`.
    pub fn open(mut reopen: Reopen, start_ns: u64, rewind: Arc<Rewind>) -> Result<Self, SourceError> {
        let source = reopen()?;
        Ok(Self {
            reopen,
            source,
            start_ns,
            first_ns: None,
            last_ns: 0,
            period_ns: DEFAULT_PERIOD_NS,
            skipped: 0,
            turns: 0,
            rewind,
        })
    }

    /// How often it has begun again.
    pub fn turns(&self) -> u64 {
        self.turns
    }

    /// The recording's first frame, captured at `start_ns`.
    fn begin(&mut self, start_ns: u64) -> Result<Option<Frame>, SourceError> {
        self.start_ns = start_ns;
        self.last_ns = self.first_ns.unwrap_or(0);
        self.turns += 1;
        self.skipped += self.source.skipped();
        self.source = (self.reopen)()?;
        let frame = self.source.next_frame()?;
        Ok(frame.map(|frame| self.moved(frame)))
    }

    fn moved(&mut self, mut frame: Frame) -> Frame {
        let first = *self.first_ns.get_or_insert(frame.capture_ns);
        if frame.capture_ns > self.last_ns && self.last_ns >= first {
            // Cameras of one instant differ by little; the step between instants is the period.
            let step = frame.capture_ns - self.last_ns;
            if step > 2_000_000 {
                self.period_ns = step.min(1_000_000_000);
            }
        }
        self.last_ns = self.last_ns.max(frame.capture_ns);
        frame.capture_ns = self.start_ns + frame.capture_ns.saturating_sub(first);
        frame
    }
}

impl FrameSource for Replay {
    fn next_frame(&mut self) -> Result<Option<Frame>, SourceError> {
        if let Some(start_ns) = self.rewind.take() {
            return self.begin(start_ns);
        }
        if let Some(frame) = self.source.next_frame()? {
            return Ok(Some(self.moved(frame)));
        }
        let Some(first) = self.first_ns else { return Ok(None) };
        self.begin(self.start_ns + self.last_ns.saturating_sub(first) + self.period_ns)
    }

    fn skipped(&self) -> u64 {
        self.skipped + self.source.skipped()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use locoman_vision::image::Pixels;

    struct Script(std::vec::IntoIter<(usize, u64)>);

    impl FrameSource for Script {
        fn next_frame(&mut self) -> Result<Option<Frame>, SourceError> {
            let frame = |(camera, capture_ns)| Frame { camera, capture_ns, pixels: Pixels::Encoded(vec![]) };
            Ok(self.0.next().map(frame))
        }

        fn skipped(&self) -> u64 {
            1
        }
    }

    fn replay(frames: &'static [(usize, u64)]) -> Replay {
        let reopen = Box::new(|| Ok(Box::new(Script(frames.to_vec().into_iter())) as Box<dyn FrameSource>));
        Replay::open(reopen, 1_000_000_000, Arc::default()).unwrap()
    }

    #[test]
    fn a_recording_begins_anew_on_request() {
        const MS: u64 = 1_000_000;
        let mut sut = replay(&[(0, 50 * MS), (0, 80 * MS), (0, 110 * MS)]);
        let mut next_ms = |sut: &mut Replay| sut.next_frame().unwrap().unwrap().capture_ns / MS;
        assert_eq!((next_ms(&mut sut), next_ms(&mut sut)), (1000, 1030));
        sut.rewind.at(1100 * MS);
        assert_eq!((next_ms(&mut sut), next_ms(&mut sut), next_ms(&mut sut)), (1100, 1130, 1160));
    }

    #[test]
    fn a_recording_loops_without_a_gap_in_time() {
        const MS: u64 = 1_000_000;
        let mut sut = replay(&[(0, 50 * MS), (1, 51 * MS), (0, 80 * MS), (1, 81 * MS)]);
        let mut times = Vec::new();
        for _ in 0..9 {
            times.push(sut.next_frame().unwrap().unwrap().capture_ns / MS);
        }
        assert_eq!(times, [1000, 1001, 1030, 1031, 1060, 1061, 1090, 1091, 1120]);
        assert_eq!((sut.turns(), sut.skipped()), (2, 3));
    }

    #[test]
    fn an_empty_recording_ends() {
        assert_eq!(replay(&[]).next_frame().unwrap(), None);
    }
}
