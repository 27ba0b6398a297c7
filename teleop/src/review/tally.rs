//! Counts and residuals of a recording, gathered update by update.

use std::collections::BTreeMap;

use locoman_vision::track::{CameraUpdate, SeenTag, ShellUpdate, TrackUpdate, Verdict};
use nalgebra::{Isometry3, Vector3};

/// Corners kept of each camera for the plots; of more, one in three stays, again and again.
const KEPT: usize = 4000;
/// A step beyond the motion by more than this, and by more than [`JUMP_SIGMAS`], is a jump.
const JUMP_M: f64 = 0.002;
/// Standard deviations of both positions together.
const JUMP_SIGMAS: f64 = 5.0;
/// Longer gaps between two measured poses tell nothing of jumps.
const JUMP_GAP_S: f64 = 0.1;

/// A corner that a pose rests on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Where it was seen.
    pub at_px: [f64; 2],
    /// Seen minus reprojected.
    pub residual_px: [f64; 2],
}

/// Some of many: evenly, whatever their number.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample<T> {
    /// What is kept.
    pub kept: Vec<T>,
    every: u64,
    offered: u64,
}

impl<T> Default for Sample<T> {
    fn default() -> Self {
        Self { kept: Vec::new(), every: 1, offered: 0 }
    }
}

impl<T> Sample<T> {
    fn offer(&mut self, value: T) {
        if self.offered.is_multiple_of(self.every) {
            self.kept.push(value);
        }
        self.offered += 1;
        if self.kept.len() > KEPT {
            // Not by two: a tag's corners come in fours, and would always be the same one.
            let mut index = 0_u64;
            self.kept.retain(|_| {
                index += 1;
                index % 3 == 1
            });
            self.every *= 3;
        }
    }
}

/// Residuals added up.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Residuals {
    /// Corners.
    pub corners: u64,
    sum_px: [f64; 2],
    square_px2: f64,
}

impl Residuals {
    fn add(&mut self, residual: [f64; 2]) {
        self.corners += 1;
        for (sum, value) in self.sum_px.iter_mut().zip(residual) {
            *sum += value;
            self.square_px2 += value * value;
        }
    }

    /// Along each axis; 0 without corners.
    pub fn rms_px(&self) -> f64 {
        (self.square_px2 / (2 * self.corners.max(1)) as f64).sqrt()
    }

    /// What does not average out: an error of calibration or of a tag's place.
    pub fn mean_px(&self) -> [f64; 2] {
        self.sum_px.map(|sum| sum / self.corners.max(1) as f64)
    }
}

/// What one camera contributed.
#[derive(Debug, Clone, Default)]
pub struct CameraTally {
    /// Frames that could be used.
    pub frames: u64,
    /// Frames that could not.
    pub unusable: u64,
    /// Frames that were searched whole.
    pub searched_whole: u64,
    /// Frames before which it was found to have moved.
    pub moved: u64,
    /// Tags that were found.
    pub seen: u64,
    /// Of those, tags that a pose rests on.
    pub used: u64,
    /// Of all used corners.
    pub residuals: Residuals,
    /// Some of them.
    pub corners: Sample<Corner>,
    /// How long reading a frame took, ns.
    pub detect_ns: Sample<u64>,
}

/// What one tag contributed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TagTally {
    /// Index of its shell.
    pub shell: usize,
    /// Times that it was found.
    pub seen: u64,
    /// Of those, times that a pose rests on it.
    pub used: u64,
    /// Of its used corners.
    pub residuals: Residuals,
}

/// A pose that is not where the motion leads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// When.
    pub time_ns: u64,
    /// How far from there.
    pub off_m: f64,
}

/// How one shell fared.
#[derive(Debug, Clone, Default)]
pub struct ShellTally {
    /// Instants by verdict: tracked, predicted, lost.
    pub verdicts: [u64; 3],
    /// Poses that jumped.
    pub jumps: Vec<Jump>,
    /// The longest time without a measured pose, after the first one.
    pub longest_gap_ns: u64,
    /// Time and residual of some of its poses, px.
    pub rms: Sample<(u64, f64)>,
    last: Option<Last>,
}

#[derive(Debug, Clone, Copy)]
struct Last {
    time_ns: u64,
    world_from_shell: Isometry3<f64>,
    velocity_m_s: Vector3<f64>,
    variance_m2: f64,
}

/// Everything.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// First and last instant.
    pub span_ns: Option<(u64, u64)>,
    /// Instants that were solved.
    pub instants: u64,
    /// In the order of the rig.
    pub cameras: Vec<CameraTally>,
    /// In the order of the shells.
    pub shells: Vec<ShellTally>,
    /// By id.
    pub tags: BTreeMap<u32, TagTally>,
}

impl Tally {
    /// Of so many cameras and shells.
    pub fn new(cameras: usize, shells: usize) -> Self {
        Self {
            cameras: vec![CameraTally::default(); cameras],
            shells: vec![ShellTally::default(); shells],
            ..Self::default()
        }
    }

    /// Takes in the next instant.
    pub fn add(&mut self, update: &TrackUpdate) {
        self.instants += 1;
        let first_ns = self.span_ns.map_or(update.time_ns, |(first_ns, _)| first_ns);
        self.span_ns = Some((first_ns, update.time_ns));
        for seen in &update.cameras {
            self.add_camera(seen);
        }
        for (tally, shell) in self.shells.iter_mut().zip(&update.shells) {
            tally.add(update.time_ns, shell);
        }
    }

    fn add_camera(&mut self, seen: &CameraUpdate) {
        let Some(camera) = self.cameras.get_mut(seen.camera) else { return };
        if seen.problem.is_some() {
            camera.unusable += 1;
            return;
        }
        camera.frames += 1;
        camera.searched_whole += u64::from(seen.searched_whole);
        camera.moved += u64::from(seen.moved_px.is_some());
        camera.detect_ns.offer(seen.detect_ns);
        for tag in &seen.tags {
            let tally = self.tags.entry(tag.detection.id).or_default();
            tally.shell = tag.shell;
            (tally.seen, camera.seen) = (tally.seen + 1, camera.seen + 1);
            if !tag.is_used() {
                continue;
            }
            (tally.used, camera.used) = (tally.used + 1, camera.used + 1);
            for corner in corners(tag) {
                tally.residuals.add(corner.residual_px);
                camera.residuals.add(corner.residual_px);
                camera.corners.offer(corner);
            }
        }
    }
}

impl ShellTally {
    fn add(&mut self, time_ns: u64, seen: &ShellUpdate) {
        let (Verdict::Tracked, Some(world_from_shell)) = (seen.verdict, seen.world_from_shell) else {
            self.verdicts[if seen.verdict == Verdict::Lost { 2 } else { 1 }] += 1;
            return;
        };
        self.verdicts[0] += 1;
        self.rms.offer((time_ns, seen.rms_px));
        let variance_m2 = seen.covariance.diagonal().fixed_rows::<3>(0).max();
        if let Some(last) = self.last {
            let gap_ns = time_ns.saturating_sub(last.time_ns);
            self.longest_gap_ns = self.longest_gap_ns.max(gap_ns);
            let gap_s = gap_ns as f64 * 1e-9;
            // The mean of both velocities: a constant acceleration is no jump.
            let moved = (last.velocity_m_s + seen.velocity_m_s) * (gap_s / 2.0);
            let off = world_from_shell.translation.vector - last.world_from_shell.translation.vector - moved;
            let doubt_m = (last.variance_m2 + variance_m2).sqrt();
            if gap_s < JUMP_GAP_S && off.norm() > JUMP_M.max(JUMP_SIGMAS * doubt_m) {
                self.jumps.push(Jump { time_ns, off_m: off.norm() });
            }
        }
        self.last = Some(Last { time_ns, world_from_shell, velocity_m_s: seen.velocity_m_s, variance_m2 });
    }
}

fn corners(tag: &SeenTag) -> Vec<Corner> {
    let there = tag.reprojected_px.iter().flatten();
    let corner = |(seen, there): (&nalgebra::Point2<f64>, &nalgebra::Point2<f64>)| Corner {
        at_px: (*seen).into(),
        residual_px: (seen - there).into(),
    };
    tag.detection.corners_px.iter().zip(there).map(corner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix6;

    fn tracked(x_m: f64, speed_m_s: f64) -> ShellUpdate {
        ShellUpdate {
            verdict: Verdict::Tracked,
            world_from_shell: Some(Isometry3::translation(x_m, 0.0, 0.0)),
            covariance: Matrix6::identity() * 1e-8,
            velocity_m_s: Vector3::new(speed_m_s, 0.0, 0.0),
            ..ShellUpdate::lost()
        }
    }

    #[test]
    fn motion_is_no_jump_and_a_step_beyond_it_is_one() {
        let mut sut = ShellTally::default();
        sut.add(0, &tracked(0.0, 1.0));
        sut.add(20_000_000, &tracked(0.02, 1.0));
        assert_eq!(sut.jumps, []);
        sut.add(40_000_000, &tracked(0.05, 1.0));
        assert_eq!(sut.jumps.len(), 1);
        assert!((sut.jumps[0].off_m - 0.01).abs() < 1e-9);
        sut.add(60_000_000, &ShellUpdate::lost());
        sut.add(500_000_000, &tracked(0.3, 1.0));
        assert_eq!((sut.jumps.len(), sut.longest_gap_ns, sut.verdicts), (1, 460_000_000, [4, 0, 1]));
    }

    #[test]
    fn a_sample_is_even_and_bounded() {
        let mut sut = Sample::default();
        (0..100_000_u64).for_each(|value| sut.offer(value));
        assert!(sut.kept.len() <= KEPT && sut.kept.len() > KEPT / 4);
        let step = sut.kept[1] - sut.kept[0];
        assert!(sut.kept.windows(2).all(|pair| pair[1] - pair[0] == step));
    }

    #[test]
    fn residuals_tell_noise_from_bias() {
        let mut sut = Residuals::default();
        for residual in [[0.3, 0.1], [0.1, -0.1]] {
            sut.add(residual);
        }
        assert!((sut.mean_px()[0] - 0.2).abs() < 1e-12 && sut.mean_px()[1].abs() < 1e-12);
        assert!((sut.rms_px() - (0.12_f64 / 4.0).sqrt()).abs() < 1e-12);
    }
}
