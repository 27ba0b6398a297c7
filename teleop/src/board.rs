//! What the threads of the station tell each other: the newest of everything, each behind its own lock that
//! is held for a copy only.

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use locoman_protocol::Received;
use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{Mode, OperatorCommand, RobotState, SimTruth, Tracking};

use crate::latency::Latency;
use crate::latest::lock;
use crate::observe::Tracked;
use crate::pilot::Note;
use crate::shown::Shown;
use crate::sight::Counters;
use crate::stick::Hand;

/// Events kept for the console.
const EVENTS: usize = 30;

/// What the pilot does, for the console.
#[derive(Debug, Clone, Default)]
pub struct PilotStatus {
    /// The command sent last.
    pub command: OperatorCommand,
    /// Why nothing moves.
    pub waiting_for: &'static str,
    /// Whether the autopilot acts; `None` without one.
    pub auto: Option<bool>,
}

/// Something that happened, and when.
#[derive(Debug, Clone)]
pub struct Happened {
    /// On the monotonic clock.
    pub at_ns: u64,
    /// What.
    pub note: Note,
}

/// The newest of everything.
#[derive(Debug, Default)]
pub struct Board {
    /// The robot's last state.
    pub robot: Mutex<Option<Arc<Received<RobotState>>>>,
    /// The simulator's last truth, if there is a simulator.
    pub truth: Mutex<Option<Arc<Received<SimTruth>>>>,
    /// What may move the robot.
    pub seen: Mutex<Option<Tracked>>,
    /// The tracker's last report.
    pub tracking: Mutex<Option<Arc<Tracking>>>,
    /// When the last tracking reports were made, for the rate.
    pub tracked_ns: Mutex<VecDeque<u64>>,
    /// What each camera saw last, for the console; only kept while a browser looks.
    pub shown: Mutex<BTreeMap<usize, Arc<Shown>>>,
    /// Counts of each camera, once there are cameras.
    pub counters: OnceLock<Arc<Counters>>,
    /// Browsers connected.
    pub viewers: AtomicUsize,
    /// The gamepad at this computer.
    pub joystick: Mutex<Hand>,
    /// The state of each browser, and when it came.
    pub browsers: Mutex<HashMap<u64, (Hand, u64)>>,
    /// A mode that a person asks for.
    pub mode: Mutex<Option<Mode>>,
    /// A person switches the autopilot.
    pub auto: Mutex<Option<bool>>,
    /// What the pilot does.
    pub pilot: Mutex<PilotStatus>,
    /// Sequence and time of the commands sent last.
    pub sent: Mutex<VecDeque<(u64, u64)>>,
    /// Latency by stage.
    pub latency: Mutex<Latency>,
    /// The last events.
    pub events: Mutex<VecDeque<Happened>>,
    /// The recorded operator waits: the autopilot has not engaged yet.
    pub hold_replay: Arc<AtomicBool>,
    /// Everything ends.
    pub stop: Arc<AtomicBool>,
}

impl Board {
    /// Whether everything ends.
    pub fn stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Ends everything.
    pub fn end(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// The hand of the browser that holds a dead-man, or of any browser that moves nothing.
    ///
    /// A browser that has been silent for longer than `silent_ns` has let go.
    pub fn browser(&self, now_ns: u64, silent_ns: u64) -> Hand {
        let browsers = lock(&self.browsers);
        let mut fresh = browsers.values().filter(|(_, at)| now_ns.saturating_sub(*at) <= silent_ns);
        fresh.find(|(hand, _)| hand.held).map(|(hand, _)| *hand).unwrap_or_default()
    }

    /// Notes an event for the console.
    pub fn happened(&self, note: Note) {
        tracing::info!(event = note.name, "{}", note.detail);
        let mut events = lock(&self.events);
        if events.len() == EVENTS {
            events.pop_front();
        }
        events.push_back(Happened { at_ns: monotonic_ns(), note });
    }

    /// Poses a second over the last second or so; 0 when the tracker stands still.
    pub fn tracking_rate_hz(&self, now_ns: u64) -> f64 {
        let times = lock(&self.tracked_ns);
        match (times.front(), times.back()) {
            (Some(&first), Some(&last)) if last > first && now_ns.saturating_sub(last) < 1_000_000_000 => {
                (times.len() - 1) as f64 / ((last - first) as f64 * 1e-9)
            }
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_browser_that_falls_silent_has_released_its_dead_man() {
        const MS: u64 = 1_000_000;
        let sut = Board::default();
        lock(&sut.browsers).insert(1, (Hand { held: true, ..Hand::default() }, 1000 * MS));
        lock(&sut.browsers).insert(2, (Hand::default(), 1100 * MS));
        assert!(sut.browser(1150 * MS, 150 * MS).held);
        assert!(!sut.browser(1151 * MS, 150 * MS).held);
    }
}
