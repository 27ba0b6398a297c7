//! Frames that belong together: one a camera, exposed at about the same instant.

use super::{FrameSource, SourceError};
use crate::image::Frame;

/// The frames of one instant, at most one of each camera.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FrameSet {
    /// In the order in which they came.
    pub frames: Vec<Frame>,
}

impl FrameSet {
    /// The instant of the set: the mean of its capture times; 0 if it is empty.
    pub fn time_ns(&self) -> u64 {
        mean_ns(self.frames.iter().map(|frame| frame.capture_ns))
    }
}

/// The mean of times, without overflow; 0 of none.
pub fn mean_ns(times: impl Iterator<Item = u64>) -> u64 {
    let (sum, count) = times.fold((0_u128, 0_u128), |(sum, count), t| (sum + u128::from(t), count + 1));
    sum.checked_div(count).map_or(0, |mean| u64::try_from(mean).unwrap_or(u64::MAX))
}

/// Groups the frames of a source into sets.
///
/// A set ends when it has a frame of every camera, when a camera comes a second time, or when a frame is
/// later than the set's first by more than the tolerance. Frames are neither lost nor held back longer.
#[derive(Debug)]
pub struct FrameSets<S> {
    source: S,
    cameras: usize,
    tolerance_ns: u64,
    pending: Option<Frame>,
}

impl<S: FrameSource> FrameSets<S> {
    /// `tolerance_ns`: half the frame period is a good choice.
    pub fn new(source: S, cameras: usize, tolerance_ns: u64) -> Self {
        Self { source, cameras, tolerance_ns, pending: None }
    }

    /// The next set; `None` at the end.
    pub fn next_set(&mut self) -> Result<Option<FrameSet>, SourceError> {
        let mut set = FrameSet::default();
        set.frames.extend(self.pending.take());
        while set.frames.len() < self.cameras {
            let Some(frame) = self.source.next_frame()? else { break };
            if self.belongs(&set, &frame) {
                set.frames.push(frame);
            } else {
                self.pending = Some(frame);
                break;
            }
        }
        Ok((!set.frames.is_empty()).then_some(set))
    }

    /// The source.
    pub fn source(&self) -> &S {
        &self.source
    }

    fn belongs(&self, set: &FrameSet, frame: &Frame) -> bool {
        let Some(first) = set.frames.first() else { return true };
        let near = frame.capture_ns.abs_diff(first.capture_ns) <= self.tolerance_ns;
        near && set.frames.iter().all(|other| other.camera != frame.camera)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Pixels;

    struct Script(std::vec::IntoIter<(usize, u64)>);

    impl FrameSource for Script {
        fn next_frame(&mut self) -> Result<Option<Frame>, SourceError> {
            let frame =
                |(camera, capture_ns)| Frame { camera, capture_ns, pixels: Pixels::Encoded(Vec::new()) };
            Ok(self.0.next().map(frame))
        }

        fn skipped(&self) -> u64 {
            0
        }
    }

    fn sets(frames: &[(usize, u64)]) -> Vec<Vec<(usize, u64)>> {
        let script = Script(Vec::from(frames).into_iter());
        let mut sut = FrameSets::new(script, 2, 10);
        let mut sets = Vec::new();
        while let Some(set) = sut.next_set().expect("no errors here") {
            sets.push(set.frames.iter().map(|frame| (frame.camera, frame.capture_ns)).collect());
        }
        sets
    }

    #[test]
    fn frames_of_one_instant_come_together() {
        assert_eq!(
            sets(&[(0, 100), (1, 103), (1, 200), (0, 204)]),
            [vec![(0, 100), (1, 103)], vec![(1, 200), (0, 204)]]
        );
    }

    #[test]
    fn a_missing_frame_does_not_shift_the_sets() {
        assert_eq!(
            sets(&[(0, 100), (0, 200), (1, 200), (1, 300)]),
            [vec![(0, 100)], vec![(0, 200), (1, 200)], vec![(1, 300)]]
        );
    }

    #[test]
    fn a_camera_that_comes_twice_begins_a_new_set() {
        assert_eq!(sets(&[(0, 100), (0, 101)]), [vec![(0, 100)], vec![(0, 101)]]);
    }

    #[test]
    fn the_instant_is_the_mean() {
        let frame = |capture_ns| Frame { camera: 0, capture_ns, pixels: Pixels::Encoded(vec![]) };
        let set = FrameSet { frames: vec![frame(u64::MAX - 4), frame(u64::MAX)] };
        assert_eq!(set.time_ns(), u64::MAX - 2);
        assert_eq!(FrameSet::default().time_ns(), 0);
    }
}
