//! A node's knowledge of the station's clock: asks five times a second, and believes what the answers bound.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use locoman_protocol::messages::{ClockOffset, ClockPing, ClockPong};
use locoman_protocol::offset::{Exchange, OffsetEstimator};
use locoman_protocol::{Link, LinkError, Sender, Subscription};

use crate::latest::lock;

/// Between two questions.
const PERIOD: Duration = Duration::from_millis(200);
/// Between two lines in the log.
const TOLD_NS: u64 = 10_000_000_000;

/// Reads this machine's clock.
#[derive(Debug, Clone, Copy, Default)]
pub struct OwnClock {
    /// Added to the monotonic clock: for tests, which have one machine only.
    pub shift_ns: i64,
}

impl OwnClock {
    /// Now.
    pub fn now_ns(self) -> u64 {
        self.moved(locoman_protocol::clock::monotonic_ns())
    }

    /// A time of the monotonic clock as this clock has it.
    pub fn moved(self, monotonic_ns: u64) -> u64 {
        monotonic_ns.saturating_add_signed(self.shift_ns)
    }
}

/// What is known of the station's clock.
#[derive(Debug)]
pub struct StationClock {
    own: OwnClock,
    state: Arc<Mutex<State>>,
    _pongs: Subscription,
}

#[derive(Debug, Default)]
struct State {
    estimator: OffsetEstimator,
    /// Who answered last: a new station has a new clock.
    station: u64,
}

impl StationClock {
    /// Listens for answers.
    pub fn listen(link: &Link, own: OwnClock) -> Result<Self, LinkError> {
        let (state, source) = (Arc::new(Mutex::new(State::default())), link.source());
        let heard = Arc::clone(&state);
        let pongs = link.subscribe::<ClockPong>(move |pong| {
            let (message, returned_ns) = (&pong.message, own.moved(pong.received_ns));
            let Some(header) = message.header.filter(|_| message.to == source) else { return };
            let mut state = lock(&heard);
            if state.station != header.source {
                *state = State { station: header.source, ..State::default() };
            }
            state.estimator.add(&Exchange {
                asked_ns: message.asked_ns,
                received_ns: message.received_ns,
                answered_ns: header.send_ns,
                returned_ns,
            });
        })?;
        Ok(Self { own, state, _pongs: pongs })
    }

    /// How the station's clock stands to ours now; `None` before it has answered.
    pub fn offset(&self) -> Option<ClockOffset> {
        lock(&self.state).estimator.at(self.own.now_ns())
    }

    /// A time of our clock on the station's.
    pub fn to_station(&self, own_ns: u64) -> Option<u64> {
        Some(own_ns.saturating_add_signed(self.offset()?.offset_ns))
    }

    /// Asks until `stopping`.
    pub fn ask(&self, pings: &mut Sender<ClockPing>, stopping: impl Fn() -> bool) {
        let mut told_ns = 0;
        while !stopping() {
            let ping = ClockPing { asked_ns: self.own.now_ns(), ..ClockPing::default() };
            if let Err(error) = pings.send(0, ping) {
                tracing::debug!("the station's clock was not asked: {error}");
            }
            std::thread::sleep(PERIOD);
            let now_ns = self.own.now_ns();
            if let Some(offset) = self.offset().filter(|_| now_ns.saturating_sub(told_ns) > TOLD_NS) {
                told_ns = now_ns;
                tracing::info!("station's clock: {}", described(&offset));
            }
        }
    }
}

/// An offset for people.
pub fn described(offset: &ClockOffset) -> String {
    let (offset_ms, error_ms) = (offset.offset_ns as f64 * 1e-6, offset.error_ns as f64 * 1e-6);
    format!("offset {offset_ms:+.3} ms ± {error_ms:.3} ms, drift {:+.1} ppm", offset.drift_ppm)
}
