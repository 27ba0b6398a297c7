//! A recording as if it happened now: paced by its own stamps, captured "now", over and over.
//!
//! Capture times are moved to this machine's clock, so that everything behind (latency, staleness, the
//! robot's watchdogs) works as with cameras. At the end the recording begins again, one frame period later.
//!
//! A recorded operator can be asked to wait, as a person would until the robot is ready: while it is held,
//! the recording stands at its first instant; let go, it plays from there. So an engagement by the autopilot
//! always begins at the pose that the recording begins with.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use locoman_vision::image::Frame;
use locoman_vision::source::{FrameSource, SourceError};

/// Frames of the first instant lie closer together than this: half the period of 60 Hz cameras.
const INSTANT_NS: u64 = 8_000_000;

/// How fast a recording is played, and from when.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// 1: as it was recorded; 0.5: in slow motion.
    pub speed: f64,
    /// When its first frame is due, on the monotonic clock; `None`: soon. So several machines play one recording
    /// together.
    pub start_ns: Option<u64>,
}

impl Default for Pace {
    fn default() -> Self {
        Self { speed: 1.0, start_ns: None }
    }
}

/// Opens the recording anew for each turn.
pub type Reopen = Box<dyn FnMut() -> Result<Box<dyn FrameSource>, SourceError> + Send>;

/// Between instants of a recording that does not tell its frame period.
const DEFAULT_PERIOD_NS: u64 = 33_333_333;

/// A source that never ends.
pub struct Replay {
    reopen: Reopen,
    source: Box<dyn FrameSource>,
    hold: Arc<AtomicBool>,
    /// The first instant of the recording, with its own capture times.
    opening: Vec<Frame>,
    /// What is still to be delivered of it.
    waiting: VecDeque<Frame>,
    /// Where the recording's first instant lies on this machine's clock.
    base_ns: u64,
    /// The latest capture time delivered, on this machine's clock.
    emitted_ns: Option<u64>,
    period_ns: u64,
    speed: f64,
    /// Whether the source stands at its begin.
    rewound: bool,
    skipped: u64,
}

impl Replay {
    /// Opens the recording; its first frame will be captured at `start_ns`, and it plays `speed` times as fast as it
    /// was recorded. While `hold` is set it stands at its first instant.
    pub fn open(
        mut reopen: Reopen,
        start_ns: u64,
        speed: f64,
        hold: Arc<AtomicBool>,
    ) -> Result<Self, SourceError> {
        let mut source = reopen()?;
        let mut opening: Vec<Frame> = Vec::new();
        let mut period_ns = DEFAULT_PERIOD_NS;
        while let Some(frame) = source.next_frame()? {
            let first_ns = opening.first().map_or(frame.capture_ns, |first| first.capture_ns);
            if frame.capture_ns > first_ns + INSTANT_NS {
                period_ns = (frame.capture_ns - first_ns).min(1_000_000_000);
                break;
            }
            opening.push(frame);
        }
        let source = reopen()?;
        Ok(Self {
            reopen,
            source,
            hold,
            opening,
            waiting: VecDeque::new(),
            base_ns: start_ns,
            emitted_ns: None,
            period_ns: (period_ns as f64 / speed) as u64,
            speed,
            rewound: true,
            skipped: 0,
        })
    }

    /// The next turn begins one period after what was delivered last.
    fn begin(&mut self) {
        if let Some(emitted_ns) = self.emitted_ns {
            self.base_ns = emitted_ns + self.period_ns;
        }
    }

    fn rewind(&mut self) -> Result<(), SourceError> {
        self.skipped += self.source.skipped();
        self.source = (self.reopen)()?;
        self.rewound = true;
        Ok(())
    }

    fn emit(&mut self, mut frame: Frame) -> Frame {
        let first_ns = self.opening.first().map_or(0, |first| first.capture_ns);
        let since_first_ns = frame.capture_ns.saturating_sub(first_ns);
        frame.capture_ns = self.base_ns + (since_first_ns as f64 / self.speed).round() as u64;
        self.emitted_ns = self.emitted_ns.max(Some(frame.capture_ns));
        frame
    }
}

impl FrameSource for Replay {
    fn next_frame(&mut self) -> Result<Option<Frame>, SourceError> {
        if self.opening.is_empty() {
            return Ok(None);
        }
        loop {
            if let Some(frame) = self.waiting.pop_front() {
                return Ok(Some(self.emit(frame)));
            }
            if self.hold.load(Ordering::Relaxed) {
                if !self.rewound {
                    self.rewind()?;
                }
                self.begin();
                self.waiting = self.opening.clone().into();
                continue;
            }
            if self.rewound {
                self.begin();
                self.rewound = false;
            }
            match self.source.next_frame()? {
                Some(frame) => return Ok(Some(self.emit(frame))),
                None => self.rewind()?,
            }
        }
    }

    fn skipped(&self) -> u64 {
        self.skipped + self.source.skipped()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use locoman_vision::image::Pixels;

    const MS: u64 = 1_000_000;

    struct Script(std::slice::Iter<'static, (usize, u64)>);

    impl FrameSource for Script {
        fn next_frame(&mut self) -> Result<Option<Frame>, SourceError> {
            let frame = |&(camera, capture_ns)| Frame { camera, capture_ns, pixels: Pixels::Encoded(vec![]) };
            Ok(self.0.next().map(frame))
        }

        fn skipped(&self) -> u64 {
            1
        }
    }

    fn replay(frames: &'static [(usize, u64)], speed: f64, hold: &Arc<AtomicBool>) -> Replay {
        let reopen: Reopen = Box::new(|| Ok(Box::new(Script(frames.iter()))));
        Replay::open(reopen, 1000 * MS, speed, Arc::clone(hold)).unwrap()
    }

    fn next(sut: &mut Replay) -> (usize, u64) {
        let frame = sut.next_frame().unwrap().unwrap();
        (frame.camera, frame.capture_ns / MS)
    }

    const TWO_INSTANTS: &[(usize, u64)] = &[(0, 50 * MS), (1, 51 * MS), (0, 80 * MS), (1, 81 * MS)];

    #[test]
    fn a_recording_loops_without_a_gap_in_time() {
        let mut sut = replay(TWO_INSTANTS, 1.0, &Arc::default());
        let times: Vec<u64> = (0..9).map(|_| next(&mut sut).1).collect();
        assert_eq!(times, [1000, 1001, 1030, 1031, 1061, 1062, 1091, 1092, 1122]);
    }

    #[test]
    fn slow_motion_stretches_the_times() {
        let mut sut = replay(TWO_INSTANTS, 0.5, &Arc::default());
        let times: Vec<u64> = (0..5).map(|_| next(&mut sut).1).collect();
        assert_eq!(times, [1000, 1002, 1060, 1062, 1122]);
    }

    #[test]
    fn held_it_stands_at_its_first_instant_and_then_plays_from_there() {
        let hold = Arc::new(AtomicBool::new(true));
        let mut sut = replay(TWO_INSTANTS, 1.0, &hold);
        let held: Vec<_> = (0..5).map(|_| next(&mut sut)).collect();
        assert_eq!(held, [(0, 1000), (1, 1001), (0, 1031), (1, 1032), (0, 1062)]);
        hold.store(false, Ordering::Relaxed);
        let played: Vec<_> = (0..5).map(|_| next(&mut sut)).collect();
        assert_eq!(played, [(1, 1063), (0, 1093), (1, 1094), (0, 1123), (1, 1124)]);
        hold.store(true, Ordering::Relaxed);
        assert_eq!((next(&mut sut), next(&mut sut)), ((0, 1154), (1, 1155)), "back at its begin");
    }

    #[test]
    fn an_empty_recording_ends() {
        assert_eq!(replay(&[], 1.0, &Arc::default()).next_frame().unwrap(), None);
    }
}
