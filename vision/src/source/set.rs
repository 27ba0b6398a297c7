//! Frames that belong together: one a camera, exposed at about the same instant.

use std::collections::VecDeque;

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

/// Cameras that are exposed together deliver frames that lie closer together than this.
pub const SYNC_TOLERANCE_NS: u64 = 2_000_000;

/// Groups the frames of a source into sets: those of one instant of cameras that are exposed together.
///
/// A set ends when it has a frame of every camera of its group, when one of them comes a second time, or when a
/// frame is later than the set's first by more than [`SYNC_TOLERANCE_NS`]. Cameras of different groups are never
/// in one set, however near their frames are. Frames are neither lost nor held back longer.
#[derive(Debug)]
pub struct FrameSets<S> {
    source: S,
    /// The group of each camera.
    groups: Vec<usize>,
    /// One a group.
    open: Vec<FrameSet>,
    /// Ended, by rising time of their first frames.
    ended: VecDeque<FrameSet>,
}

impl<S: FrameSource> FrameSets<S> {
    /// `sync_groups`: the group of each camera, as [`crate::rig::Rig::sync_groups`] has it.
    pub fn new(source: S, sync_groups: &[usize]) -> Self {
        let groups = sync_groups.iter().max().map_or(0, |most| most + 1);
        let open = vec![FrameSet::default(); groups];
        Self { source, groups: sync_groups.to_vec(), open, ended: VecDeque::new() }
    }

    /// The next set; `None` at the end.
    pub fn next_set(&mut self) -> Result<Option<FrameSet>, SourceError> {
        loop {
            if let Some(set) = self.ended.pop_front() {
                return Ok(Some(set));
            }
            match self.source.next_frame()? {
                Some(frame) => self.sort_in(frame),
                None => {
                    self.end(|_, set| !set.frames.is_empty());
                    return Ok(self.ended.pop_front());
                }
            }
        }
    }

    /// The source.
    pub fn source(&self) -> &S {
        &self.source
    }

    fn sort_in(&mut self, frame: Frame) {
        let Some(&group) = self.groups.get(frame.camera) else { return };
        let again = |set: &FrameSet| set.frames.iter().any(|other| other.camera == frame.camera);
        self.end(|k, set| {
            let first = set.frames.first();
            first.is_some_and(|first| frame.capture_ns.abs_diff(first.capture_ns) > SYNC_TOLERANCE_NS)
                || (k == group && again(set))
        });
        let size = self.groups.iter().filter(|other| **other == group).count();
        self.open[group].frames.push(frame);
        self.end(|k, set| k == group && set.frames.len() == size);
    }

    /// Ends the open sets that a condition holds for (group and set), the earliest first.
    fn end(&mut self, mut holds: impl FnMut(usize, &FrameSet) -> bool) {
        let sets = self.open.iter_mut().enumerate();
        let mut ended: Vec<FrameSet> =
            sets.filter_map(|(k, set)| holds(k, set).then(|| std::mem::take(set))).collect();
        ended.sort_by_key(|set| set.frames.first().map(|first| first.capture_ns));
        self.ended.extend(ended);
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
        grouped(&[0, 0], frames)
    }

    /// Times in milliseconds.
    fn grouped(groups: &[usize], frames: &[(usize, u64)]) -> Vec<Vec<(usize, u64)>> {
        let frames: Vec<_> = frames.iter().map(|&(camera, ms)| (camera, ms * 1_000_000)).collect();
        let mut sut = FrameSets::new(Script(frames.into_iter()), groups);
        let mut sets = Vec::new();
        while let Some(set) = sut.next_set().expect("no errors here") {
            sets.push(set.frames.iter().map(|frame| (frame.camera, frame.capture_ns / 1_000_000)).collect());
        }
        sets
    }

    #[test]
    fn frames_of_one_instant_come_together() {
        assert_eq!(
            sets(&[(0, 100), (1, 102), (1, 200), (0, 201)]),
            [vec![(0, 100), (1, 102)], vec![(1, 200), (0, 201)]]
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
    fn cameras_that_are_not_exposed_together_are_never_in_one_set() {
        // Two pairs, the second a millisecond, then eight after the first; one frame of the first pair is missing.
        let frames =
            [(0, 100), (1, 100), (2, 101), (3, 101), (0, 133), (2, 141), (3, 141), (0, 166), (1, 166)];
        assert_eq!(
            grouped(&[0, 0, 1, 1], &frames),
            [
                vec![(0, 100), (1, 100)],
                vec![(2, 101), (3, 101)],
                vec![(0, 133)],
                vec![(2, 141), (3, 141)],
                vec![(0, 166), (1, 166)],
            ]
        );
    }

    #[test]
    fn the_instant_is_the_mean() {
        let frame = |capture_ns| Frame { camera: 0, capture_ns, pixels: Pixels::Encoded(vec![]) };
        let set = FrameSet { frames: vec![frame(u64::MAX - 4), frame(u64::MAX)] };
        assert_eq!(set.time_ns(), u64::MAX - 2);
        assert_eq!(FrameSet::default().time_ns(), 0);
    }
}
