//! The station's side of camera nodes: takes their detections in, answers what its clock says.

use std::collections::HashMap;
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex};

use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{ClockPing, ClockPong, Detections};
use locoman_protocol::{Arrival, Link, LinkError, Received, SequenceGuard, Subscription};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use locoman_vision::track::TagOwners;

use super::wire;
use crate::latest::lock;
use crate::sight::{Counters, Reading, Sighting};

/// A frame that claims to be older, or from further in the future, has a wrong clock.
const PLAUSIBLE_NS: u64 = 2_000_000_000;

/// Keeps the station listening to its nodes.
#[derive(Debug)]
pub struct Remotes {
    _subscriptions: [Subscription; 2],
}

impl Remotes {
    /// Listens; what the nodes saw goes to `sightings`.
    pub fn listen(
        link: &Link,
        rig: &Rig,
        shells: &ShellSet,
        counters: &Arc<Counters>,
        sightings: SyncSender<Sighting>,
    ) -> Result<Self, LinkError> {
        let pongs = Mutex::new(link.sender::<ClockPong>()?);
        let pings = link.subscribe::<ClockPing>(move |ping| {
            let answer = ClockPong {
                to: ping.message.header.as_ref().map_or(0, |header| header.source),
                asked_ns: ping.message.asked_ns,
                received_ns: ping.received_ns,
                ..ClockPong::default()
            };
            if let Err(error) = lock(&pongs).send(0, answer) {
                tracing::debug!("clock not answered: {error}");
            }
        })?;
        let mut intake = Intake {
            owners: TagOwners::new(shells),
            rig: rig.clone(),
            counters: Arc::clone(counters),
            sightings,
            guards: HashMap::new(),
            complaint: String::new(),
        };
        let detections = link.subscribe::<Detections>(move |received| intake.take(&received))?;
        Ok(Self { _subscriptions: [pings, detections] })
    }
}

/// Checks what nodes say.
struct Intake {
    rig: Rig,
    owners: TagOwners,
    counters: Arc<Counters>,
    sightings: SyncSender<Sighting>,
    /// One a camera: what comes twice or late is left out.
    guards: HashMap<String, SequenceGuard>,
    /// Said last; not said again.
    complaint: String,
}

impl Intake {
    fn take(&mut self, received: &Received<Detections>) {
        let message = &received.message;
        let update = match wire::camera_update(&self.rig, &self.owners, message) {
            Ok(update) => update,
            Err(error) => return self.complain(error.to_string()),
        };
        let header = message.header.unwrap_or_default();
        let guard = self.guards.entry(message.camera.clone()).or_default();
        if matches!(guard.check(&header), Arrival::Stale { .. }) {
            return;
        }
        if update.capture_ns.abs_diff(monotonic_ns()) > PLAUSIBLE_NS {
            let late_s = (received.received_ns as f64 - update.capture_ns as f64) * 1e-9;
            let camera = &message.camera;
            return self.complain(format!(
                "camera `{camera}`: its frame is {late_s:.1} s old by the station's clock"
            ));
        }
        self.counters.set(update.camera, |counters| &counters.frames, message.frames);
        self.counters.set(update.camera, |counters| &counters.dropped, message.dropped);
        self.counters.set(update.camera, |counters| &counters.heard_ns, received.received_ns);
        self.counters.set(update.camera, |c| &c.read_ns, message.decode_ns.saturating_add(message.detect_ns));
        if let Some(counters) = self.counters.cameras.get(update.camera) {
            counters.set_problem(update.problem.as_deref());
            if let Some(clock) = message.clock {
                counters.set_clock(clock);
            }
        }
        if update.searched_whole {
            self.counters.count(update.camera, |counters| &counters.searched_whole);
        }
        let sighting = if message.again {
            Sighting::Searched(Box::new(update))
        } else {
            Sighting::Read(Box::new(Reading { update, in_memory_ns: 0, image: None }))
        };
        // The receiver goes last. A full queue means that the solver has stood still for a second.
        let _ = self.sightings.try_send(sighting);
    }

    fn complain(&mut self, complaint: String) {
        if complaint != self.complaint {
            tracing::warn!("{complaint}");
            self.complaint = complaint;
        }
    }
}
