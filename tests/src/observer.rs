//! Listens to everything that robot and simulator publish.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use locoman_protocol::link::{Endpoints, Link, Subscription};
use locoman_protocol::messages::{RobotState, SimTruth};

/// The latest messages, and when they came.
#[derive(Default, Clone)]
pub struct Seen {
    /// The robot's state.
    pub state: Option<RobotState>,
    /// When it came.
    pub state_at: Option<Instant>,
    /// The simulator's truth.
    pub truth: Option<SimTruth>,
    /// When it came.
    pub truth_at: Option<Instant>,
    /// The truth has said "fallen" at any time.
    pub fallen: bool,
}

impl Seen {
    /// How long the robot has been silent.
    pub fn state_age(&self) -> Duration {
        self.state_at.map_or(Duration::MAX, |at| at.elapsed())
    }
}

/// A third peer on the link.
pub struct Observer {
    seen: Arc<Mutex<Seen>>,
    _subscriptions: (Subscription, Subscription),
    _link: Link,
}

impl Observer {
    /// Connects to robot and simulator; either may start later.
    pub fn connect(endpoints: &[String]) -> Result<Self> {
        let link = Link::open("locoman", &Endpoints::connect(endpoints))?;
        let seen = Arc::new(Mutex::new(Seen::default()));
        let (for_state, for_truth) = (Arc::clone(&seen), Arc::clone(&seen));
        let state = link.subscribe::<RobotState>(move |received| {
            let mut seen = for_state.lock().unwrap_or_else(PoisonError::into_inner);
            seen.state = Some(received.message);
            seen.state_at = Some(Instant::now());
        })?;
        let truth = link.subscribe::<SimTruth>(move |received| {
            let mut seen = for_truth.lock().unwrap_or_else(PoisonError::into_inner);
            seen.fallen |= received.message.fallen;
            seen.truth = Some(received.message);
            seen.truth_at = Some(Instant::now());
        })?;
        Ok(Self { seen, _subscriptions: (state, truth), _link: link })
    }

    /// What has been seen up to now.
    pub fn seen(&self) -> Seen {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Waits until something holds, and says how long it took; `what` names it in the error.
    pub fn wait_until(
        &self,
        what: &str,
        timeout: Duration,
        mut holds: impl FnMut(&Seen) -> bool,
    ) -> Result<Duration> {
        let start = Instant::now();
        loop {
            let seen = self.seen();
            if holds(&seen) {
                return Ok(start.elapsed());
            }
            if start.elapsed() > timeout {
                let state = seen.state.as_ref();
                bail!(
                    "waited {timeout:?} in vain for: {what}. Robot: mode {:?}, phase {:?}, severity {:?}, \
                     engagement {:?}, reasons {:?}, silent for {:?}; fallen: {}",
                    state.map(RobotState::mode),
                    state.map(|state| &state.phase),
                    state.map(RobotState::severity),
                    state.map(|state| state.engagement),
                    state.map(|state| &state.reasons),
                    seen.state_age(),
                    seen.fallen,
                );
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}
