//! Which frames are taken in: each once, none too late, none from a clock that jumped.
//!
//! Time here is what the newest good frame said. A frame that is a little older is late and still good. One
//! that is hours away comes from a clock that jumped: it is left aside; but if nothing else arrives, the new
//! time is believed, and everything begins anew.

use super::update::CameraUpdate;

/// How late a frame may be.
pub(super) const LATEST_NS: u64 = 50_000_000;
/// Further from the newest frame than this a clock must have jumped, or everything stood still.
const JUMP_NS: u64 = 2_000_000_000;
/// Frames in a row of the same new time after which it is believed.
const BELIEVED: u32 = 3;

/// Frames that were not taken in.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Dropped {
    /// The same camera and capture time again.
    pub duplicates: u64,
    /// Later than 50 ms.
    pub late: u64,
    /// From a clock that jumped.
    pub clock_jumps: u64,
}

/// What is to be done with a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Admitted {
    /// Take it in.
    Yes,
    /// Forget what was known, then take it in: time is another.
    Anew,
    /// Leave it.
    No,
}

/// Judges frames by their times.
#[derive(Debug, Default)]
pub(super) struct Admission {
    newest_ns: Option<u64>,
    /// Last capture time of each camera.
    last_ns: Vec<Option<u64>>,
    /// Last time that is far from the newest, and how many agreed with it one after the other.
    suspect: Option<(u64, u32)>,
    dropped: Dropped,
}

impl Admission {
    /// For so many cameras.
    pub fn new(cameras: usize) -> Self {
        Self { last_ns: vec![None; cameras], ..Self::default() }
    }

    /// What was not taken in so far.
    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    /// Judges a frame.
    pub fn judge(&mut self, frame: &CameraUpdate) -> Admitted {
        let CameraUpdate { camera, capture_ns, .. } = *frame;
        // No camera of the rig: there is nothing to do with it.
        let Some(last_ns) = self.last_ns.get_mut(camera) else { return Admitted::No };
        if *last_ns == Some(capture_ns) {
            self.dropped.duplicates += 1;
            return Admitted::No;
        }
        *last_ns = Some(capture_ns);
        let Some(newest_ns) = self.newest_ns else {
            self.newest_ns = Some(capture_ns);
            return Admitted::Yes;
        };
        if capture_ns.abs_diff(newest_ns) > JUMP_NS {
            return self.suspect(capture_ns);
        }
        self.suspect = None;
        if capture_ns.saturating_add(LATEST_NS) < newest_ns {
            self.dropped.late += 1;
            return Admitted::No;
        }
        self.newest_ns = Some(capture_ns.max(newest_ns));
        Admitted::Yes
    }

    fn suspect(&mut self, capture_ns: u64) -> Admitted {
        let agreed = match self.suspect {
            Some((last_ns, agreed)) if capture_ns.abs_diff(last_ns) <= JUMP_NS => agreed + 1,
            _ => 1,
        };
        self.suspect = Some((capture_ns, agreed));
        if agreed < BELIEVED {
            self.dropped.clock_jumps += 1;
            return Admitted::No;
        }
        self.suspect = None;
        self.newest_ns = Some(capture_ns);
        Admitted::Anew
    }
}

#[cfg(test)]
mod tests;
