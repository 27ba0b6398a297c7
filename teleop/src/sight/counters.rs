//! What is counted of each camera while it is looked through: for reports, console and node.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use locoman_protocol::messages::{CameraStats, ClockOffset};

use crate::latest::lock;

/// Counts of one camera; all rise only.
#[derive(Debug, Default)]
pub struct CameraCounters {
    /// Frames that came.
    pub frames: AtomicU64,
    /// Frames that nobody had time for.
    pub dropped: AtomicU64,
    /// Whole images that were searched.
    pub searched_whole: AtomicU64,
    /// When the last frame came, on this machine's clock; 0: none yet.
    pub heard_ns: AtomicU64,
    /// How long its last image took to read, decoding included.
    pub read_ns: AtomicU64,
    remote: Mutex<Option<ClockOffset>>,
    problem: Mutex<String>,
}

impl CameraCounters {
    /// Another machine reads this camera, with a clock that stands so.
    pub fn set_clock(&self, clock: ClockOffset) {
        *lock(&self.remote) = Some(clock);
    }

    /// The clock of the machine that reads this camera, if it is another one.
    pub fn clock(&self) -> Option<ClockOffset> {
        *lock(&self.remote)
    }

    /// Why its last image could not be used, or that it could; `true` if that is news.
    pub fn set_problem(&self, problem: Option<&str>) -> bool {
        let problem = problem.unwrap_or_default();
        let mut known = lock(&self.problem);
        let news = *known != problem;
        if news {
            problem.clone_into(&mut known);
        }
        news && !problem.is_empty()
    }

    /// Why its last image could not be used; empty if it could.
    pub fn problem(&self) -> String {
        lock(&self.problem).clone()
    }
}

/// Counts of all cameras of a rig.
#[derive(Debug)]
pub struct Counters {
    /// In the order of the rig.
    pub cameras: Vec<CameraCounters>,
    ids: Vec<String>,
}

impl Counters {
    /// For cameras with these ids.
    pub fn new(ids: Vec<String>) -> Self {
        Self { cameras: ids.iter().map(|_| CameraCounters::default()).collect(), ids }
    }

    /// Ids of the cameras, in the order of the rig.
    pub fn ids(&self) -> &[String] {
        &self.ids
    }

    /// A count of one camera goes up.
    pub fn count(&self, camera: usize, which: impl Fn(&CameraCounters) -> &AtomicU64) {
        if let Some(counters) = self.cameras.get(camera) {
            which(counters).fetch_add(1, Ordering::Relaxed);
        }
    }

    /// A figure of one camera changes.
    pub fn set(&self, camera: usize, which: impl Fn(&CameraCounters) -> &AtomicU64, value: u64) {
        if let Some(counters) = self.cameras.get(camera) {
            which(counters).store(value, Ordering::Relaxed);
        }
    }

    /// As a message; `tags` gives the number of tags seen now.
    pub fn stats(&self, tags: impl Fn(usize) -> usize) -> Vec<CameraStats> {
        let cameras = self.ids.iter().zip(&self.cameras).enumerate();
        let stats = |(index, (id, counters)): (usize, (&String, &CameraCounters))| CameraStats {
            camera: id.clone(),
            frames: counters.frames.load(Ordering::Relaxed),
            dropped: counters.dropped.load(Ordering::Relaxed),
            tags: u32::try_from(tags(index)).unwrap_or(u32::MAX),
            searched_whole: counters.searched_whole.load(Ordering::Relaxed),
            clock: counters.clock(),
        };
        cameras.map(stats).collect()
    }
}
