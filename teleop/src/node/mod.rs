//! Cameras that another machine reads.
//!
//! ```text
//!  camera node (`locoman-teleop detect`)                         station (`locoman-teleop run`)
//!  cameras ─► eyes, scout ─► publisher ═══ detections/<camera> ═══► remote ─► solver
//!                 ▲                                                              │
//!                 └──────────────────═════════ motions ═════════════◄────────────┘
//!                 clock ═══════ clock_ping, clock_pong, 5 Hz ═══════ remote
//! ```
//!
//! A node works as the station's own threads do: it reads tags where the motions say that they are, and searches
//! whole images while it knows of a shell nothing, or when the station is silent. Capture times leave a node on
//! the station's clock; before that is known, frames are dropped.

mod clock;
mod remote;
pub mod wire;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use locoman_protocol::messages::{self, Detections};
use locoman_protocol::{Endpoints, Link, Sender};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use locoman_vision::track::{CameraUpdate, Motions, TrackerSettings};

use crate::latest::lock;
use crate::sight::{Counters, Equipment, Outlook, SIGHTINGS, Sight, Sighting, spawn};
use crate::sources::Frames;
pub use clock::{OwnClock, StationClock, described};
pub use remote::Remotes;

/// Between two looks at what does not come with a frame.
const NAP: Duration = Duration::from_millis(50);

/// Everything that `detect` is told.
#[derive(Debug, Clone)]
#[expect(missing_docs, reason = "each is the option of that name")]
pub struct Options {
    pub rig: PathBuf,
    pub shells: PathBuf,
    /// Ids; empty: all that the rig file calls remote.
    pub cameras: Vec<String>,
    pub frames: Frames,
    pub robot: String,
    pub endpoints: Endpoints,
    pub own_clock: OwnClock,
    pub seconds: Option<f64>,
}

/// Runs until `stop` is set, the time is over or the frames are at their end.
pub fn run(options: &Options, stop: &Arc<AtomicBool>) -> Result<()> {
    let rig = Rig::load(&options.rig)?;
    let shells = ShellSet::load(&options.shells)?;
    let here = chosen(&rig, &options.cameras)?;
    let own = options.own_clock;
    let source = options.frames.open(&rig, &here, own.now_ns(), &Arc::default())?;
    let link = Link::open(&options.robot, &options.endpoints)?;
    let clock = Arc::new(StationClock::listen(&link, own)?);
    let outlook = Arc::new(Outlook::new(Arc::clone(stop)));
    let counters = Arc::new(Counters::new(rig.cameras.iter().map(|camera| camera.id.clone()).collect()));
    let heard = Arc::new(Mutex::new(0_u64));
    let motions = link.subscribe::<messages::Motions>({
        let (outlook, shells, heard) = (Arc::clone(&outlook), shells.clone(), Arc::clone(&heard));
        move |received| {
            *lock(&heard) = received.received_ns;
            let motions = wire::motions(&received.message, &shells);
            let lost = shells_to_search(&motions, &shells);
            outlook.know(Arc::new(motions), lost);
        }
    })?;
    let asking = spawn("clock", {
        let (clock, stop, mut pings) = (Arc::clone(&clock), Arc::clone(stop), link.sender()?);
        move || clock.ask(&mut pings, || stop.load(Ordering::Relaxed))
    })?;
    let senders = senders(&link, &rig, &here)?;
    let (sightings, seen) = sync_channel(SIGHTINGS);
    let equipment = Equipment {
        rig: &rig,
        shells: &shells,
        settings: &TrackerSettings::default(),
        here,
        source,
        now_ns: Arc::new(move || own.now_ns()),
        to_station: Arc::new({
            let clock = Arc::clone(&clock);
            move |own_ns| clock.to_station(own_ns)
        }),
    };
    let sight = Sight::start(equipment, &outlook, &counters, &sightings)?;
    drop(sightings);
    let mut publisher = Publisher { rig, counters, clock, senders };
    let deadline = options.seconds.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds));
    while !stop.load(Ordering::Relaxed)
        && deadline.is_none_or(|deadline| Instant::now() < deadline)
        && publisher.pass_on(&seen)
    {
        let silent_ns = locoman_protocol::clock::monotonic_ns().saturating_sub(*lock(&heard));
        if silent_ns > TrackerSettings::default().horizon_ns {
            outlook.know(Arc::new(Motions::default()), true);
        }
    }
    stop.store(true, Ordering::Relaxed);
    drop(seen);
    let ended = sight.join();
    let _ = asking.join();
    publisher.summarize();
    drop((motions, publisher));
    link.close();
    Ok(ended?)
}

/// Whether a shell is lost that only the search of whole images can find: thumbs are found by their palms.
fn shells_to_search(motions: &Motions, shells: &ShellSet) -> bool {
    motions
        .latest()
        .iter()
        .enumerate()
        .any(|(index, motion)| motion.is_none() && shells.palm_of(index).is_none())
}

/// Which cameras are read here.
fn chosen(rig: &Rig, ids: &[String]) -> Result<Vec<bool>> {
    let known = || rig.cameras.iter().map(|camera| camera.id.as_str()).collect::<Vec<_>>().join(", ");
    for id in ids {
        if rig.camera_index(id).is_none() {
            bail!("--cameras {id}: the rig file has {}", known());
        }
    }
    let wanted: Vec<bool> = rig
        .cameras
        .iter()
        .zip(&rig.sources)
        .map(|(camera, source)| if ids.is_empty() { source.remote } else { ids.contains(&camera.id) })
        .collect();
    if !wanted.contains(&true) {
        bail!("no camera to read: give --cameras ID,ID (the rig file has {})", known());
    }
    Ok(wanted)
}

fn senders(link: &Link, rig: &Rig, here: &[bool]) -> Result<Vec<Option<Sender<Detections>>>> {
    let cameras = rig.cameras.iter().zip(here);
    let sender = |(camera, here): (&locoman_vision::camera::Camera, &bool)| {
        here.then(|| link.sender_named(&camera.id)).transpose()
    };
    cameras.map(sender).collect::<Result<_, _>>().context("cannot publish detections")
}

/// Passes on what is seen.
struct Publisher {
    rig: Rig,
    counters: Arc<Counters>,
    clock: Arc<StationClock>,
    /// One a camera that is read here.
    senders: Vec<Option<Sender<Detections>>>,
}

impl Publisher {
    /// Waits for the next sighting, shortly, and passes it on; `false` at the end.
    fn pass_on(&mut self, seen: &Receiver<Sighting>) -> bool {
        match seen.recv_timeout(NAP) {
            Ok(Sighting::Read(reading)) => self.publish(&reading.update, false),
            Ok(Sighting::Searched(found)) if !found.tags.is_empty() => self.publish(&found, true),
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return false,
        }
        true
    }

    fn publish(&mut self, update: &CameraUpdate, again: bool) {
        let Some(Some(sender)) = self.senders.get_mut(update.camera) else { return };
        let Some(counters) = self.counters.cameras.get(update.camera) else { return };
        let message = Detections {
            frames: counters.frames.load(Ordering::Relaxed),
            dropped: counters.dropped.load(Ordering::Relaxed),
            clock: self.clock.offset(),
            again,
            ..wire::detections(&self.rig, update)
        };
        if let Err(error) = sender.send(update.capture_ns, message) {
            tracing::debug!("detections not published: {error}");
        }
    }

    fn summarize(&self) {
        let cameras = self.counters.ids().iter().zip(&self.counters.cameras).zip(&self.senders);
        for ((id, counters), _) in cameras.filter(|(_, sender)| sender.is_some()) {
            let count = |which: &std::sync::atomic::AtomicU64| which.load(Ordering::Relaxed);
            let (frames, dropped) = (count(&counters.frames), count(&counters.dropped));
            let whole = count(&counters.searched_whole);
            tracing::info!("camera {id}: {dropped} of {frames} frames dropped, {whole} searched whole");
        }
        match self.clock.offset() {
            Some(offset) => tracing::info!("station's clock: {}", described(&offset)),
            None => tracing::warn!("no station has answered; give its address with --connect tcp/HOST:PORT"),
        }
    }
}
