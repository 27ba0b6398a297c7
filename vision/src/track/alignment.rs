//! Whether each camera still is where the rig file says.
//!
//! A camera that was bumped sees every shell beside where the cameras together have it. The solver leaves its tags
//! aside as outliers, so poses stay right as long as others see the shell; but the rig has to be calibrated again,
//! and somebody has to be told which camera it is.

use super::update::CameraUpdate;

/// Tags farther than this from where the poses have them speak of a camera that has moved, pixels: ten times what a good
/// calibration leaves, a tenth of a degree.
const APART_PX: f64 = 1.5;
/// A tag that is farther away says no more than that.
const FARTHEST_PX: f64 = 50.0;
/// How long a camera is remembered, s: a hand that hides most of a shell, or a swapped tag, is gone by then.
const MEMORY_S: f64 = 1.0;
/// Two frames that are further apart tell no more than one, s.
const LONGEST_S: f64 = 0.1;
/// Share of the remembered time after which a camera is said to have moved, and to be back.
const MOVED: f64 = 0.7;
const BACK: f64 = 0.3;

/// What is remembered of one camera.
#[derive(Debug, Clone, Copy, Default)]
struct Memory {
    last_ns: u64,
    /// Share of the time in which most of its tags were apart.
    apart: f64,
    /// How far, decaying alike, px.
    off_px: f64,
    moved: bool,
}

/// Remembers how far apart each camera and the poses were.
#[derive(Debug)]
pub(super) struct Alignment {
    cameras: Vec<Memory>,
    /// Memory for the distances in one frame.
    offs_px: Vec<f64>,
}

impl Alignment {
    pub(super) fn new(cameras: usize) -> Self {
        Self { cameras: vec![Memory::default(); cameras], offs_px: Vec::new() }
    }

    /// Takes in a frame whose tags have been reprojected; how far its tags are apart if its camera has moved.
    ///
    /// A camera has moved only if another one has not: where all are apart, shells or poses are wrong.
    pub(super) fn judge(&mut self, update: &CameraUpdate) -> Option<f64> {
        let off_px = self.median_off_px(update);
        let others = || self.cameras.iter().enumerate().filter(|(camera, _)| *camera != update.camera);
        let one_agrees = others().any(|(_, other)| other.last_ns != 0 && other.apart < BACK);
        let memory = self.cameras.get_mut(update.camera)?;
        if let Some(off_px) = off_px {
            memory.add(update.capture_ns, off_px);
        }
        memory.moved = memory.apart > if memory.moved { BACK } else { MOVED } && one_agrees;
        memory.moved.then_some(memory.off_px)
    }

    /// Of the tags of shells that have a pose; `None` without any.
    fn median_off_px(&mut self, update: &CameraUpdate) -> Option<f64> {
        self.offs_px.clear();
        for seen in &update.tags {
            let Some(there) = &seen.reprojected_px else { continue };
            let corners = seen.detection.corners_px.iter().zip(there);
            let sum_px: f64 = corners.map(|(seen, there)| nalgebra::distance(seen, there)).sum();
            self.offs_px.push(sum_px / 4.0);
        }
        let middle = self.offs_px.len() / 2;
        (!self.offs_px.is_empty()).then(|| *self.offs_px.select_nth_unstable_by(middle, f64::total_cmp).1)
    }
}

impl Memory {
    fn add(&mut self, capture_ns: u64, off_px: f64) {
        let elapsed_s = capture_ns.saturating_sub(self.last_ns) as f64 * 1e-9;
        let share = elapsed_s.min(LONGEST_S) / MEMORY_S;
        let apart = if off_px > APART_PX { 1.0 } else { 0.0 };
        self.apart += share * (apart - self.apart);
        self.off_px += share * (off_px.min(FARTHEST_PX) - self.off_px);
        self.last_ns = self.last_ns.max(capture_ns);
    }
}
