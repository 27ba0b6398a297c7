//! From cameras to tags, on threads: the same for the operator's station and for a camera node.
//!
//! ```text
//! source ─► capture ─► Inbox ─► eyes (a pool) ─► Sighting ─► the station's solver, or a node's publisher
//!                      newest   │      ▲                ▲
//!                      frames   │      └── Motions      │
//!                               └► Inbox ─► scout ──────┘
//!                                  while something is lost, or not where it was expected
//! ```
//!
//! While nobody is known to be there the eyes search whole images themselves.
//!
//! The newest frame of a camera wins; one that nobody had time for is counted and gone, nothing queues. The scout
//! runs after everybody else: what is tracked is never delayed by the search for what is lost.

mod capture;
mod counters;
mod eyes;
mod inbox;
mod scouting;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use anyhow::{Context, Result};
use locoman_vision::image::{Frame, GrayImage};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use locoman_vision::source::{FrameSource, SourceError};
use locoman_vision::track::{CameraUpdate, Eye, Motions, TrackerSettings};

use crate::latest::lock;
pub use counters::{CameraCounters, Counters};
pub use inbox::Inbox;
use scouting::Lookout;

/// Sightings that wait for whoever takes them in: a second's worth, so that nobody ever waits to hand one over.
pub const SIGHTINGS: usize = 1024;

/// What happened to a frame, in the order of happening.
#[derive(Debug)]
pub enum Sighting {
    /// It is in memory and will be read, or displaced.
    Arrived {
        /// Index in the rig.
        camera: usize,
        /// When it was exposed.
        capture_ns: u64,
    },
    /// A newer one came before anybody had time for it.
    Displaced {
        /// Index in the rig.
        camera: usize,
        /// When it was exposed.
        capture_ns: u64,
    },
    /// Its tags have been read where they were expected.
    Read(Box<Reading>),
    /// Its image has been searched, whole or in a region; it had been read before.
    Searched(Box<CameraUpdate>),
}

/// A frame that has been read.
#[derive(Debug)]
pub struct Reading {
    /// What was found.
    pub update: CameraUpdate,
    /// When its image was in memory, decoded; 0 if another machine has read it.
    pub in_memory_ns: u64,
    /// The image, if somebody wants to see it.
    pub image: Option<Arc<GrayImage>>,
}

/// What the threads that look have to know, and tell.
#[derive(Debug)]
pub struct Outlook {
    motions: Mutex<Arc<Motions>>,
    lost: AtomicBool,
    /// Whether somebody wants to see the images.
    pub watched: AtomicBool,
    /// Everything ends.
    pub stop: Arc<AtomicBool>,
}

impl Outlook {
    /// Nothing is known yet.
    pub fn new(stop: Arc<AtomicBool>) -> Self {
        Self { motions: Mutex::default(), lost: true.into(), watched: false.into(), stop }
    }

    /// What is known now of the shells, and whether one is lost that only the search of whole images can find.
    pub fn know(&self, motions: Arc<Motions>, lost: bool) {
        *lock(&self.motions) = motions;
        self.lost.store(lost, Ordering::Relaxed);
    }

    /// See [`Outlook::know`].
    pub fn motions(&self) -> Arc<Motions> {
        Arc::clone(&lock(&self.motions))
    }

    /// See [`Outlook::know`].
    pub fn something_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    fn stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// From the clock of this machine to the station's; `None` while it is not known.
pub type ToStation = Arc<dyn Fn(u64) -> Option<u64> + Send + Sync>;

/// What a [`Sight`] looks with.
pub struct Equipment<'a> {
    /// All cameras, and the shells.
    pub rig: &'a Rig,
    /// See [`Equipment::rig`].
    pub shells: &'a ShellSet,
    /// Of the tracker.
    pub settings: &'a TrackerSettings,
    /// Which cameras are read here, by index.
    pub here: Vec<bool>,
    /// Their frames; those of other cameras are left aside. Capture times are on this machine's clock.
    pub source: Box<dyn FrameSource>,
    /// This machine's clock.
    pub now_ns: Arc<dyn Fn() -> u64 + Send + Sync>,
    /// From it to the station's.
    pub to_station: ToStation,
}

/// The threads that look.
#[derive(Debug)]
pub struct Sight {
    capture: JoinHandle<Result<(), SourceError>>,
    others: Vec<JoinHandle<()>>,
}

impl Sight {
    /// Starts to look; what is seen goes to `sightings`.
    pub fn start(
        equipment: Equipment<'_>,
        outlook: &Arc<Outlook>,
        counters: &Arc<Counters>,
        sightings: &SyncSender<Sighting>,
    ) -> Result<Self> {
        let Equipment { rig, shells, settings, here, source, now_ns, to_station } = equipment;
        let cameras = 0..rig.cameras.len();
        let eye = |camera| Mutex::new(Eye::new(rig, camera, shells, settings));
        let eyes: Arc<Vec<Mutex<Eye>>> = Arc::new(cameras.clone().map(eye).collect());
        let lookout = |camera| Ok(Mutex::new(Lookout::new(rig, camera, shells, settings)?));
        let lookouts: Arc<Vec<Mutex<Lookout>>> = Arc::new(cameras.map(lookout).collect::<Result<_>>()?);
        let frames = Arc::new(Inbox::<Frame>::new(here.len()));
        let doubtful = Arc::new(Inbox::new(here.len()));
        let readers = here.iter().filter(|here| **here).count().clamp(1, cores());
        let mut others = Vec::new();
        for number in 0..readers {
            let reader = eyes::Reader {
                eyes: Arc::clone(&eyes),
                lookouts: Arc::clone(&lookouts),
                frames: Arc::clone(&frames),
                doubtful: Arc::clone(&doubtful),
                outlook: Arc::clone(outlook),
                counters: Arc::clone(counters),
                sightings: sightings.clone(),
                now_ns: Arc::clone(&now_ns),
            };
            others.push(spawn(&format!("eye {number}"), move || reader.run())?);
        }
        others.push(spawn("scout", {
            let (outlook, counters) = (Arc::clone(outlook), Arc::clone(counters));
            let sightings = sightings.clone();
            move || scouting::run(&lookouts, &doubtful, &outlook, &counters, &sightings)
        })?);
        let capture = spawn("capture", {
            let (outlook, counters) = (Arc::clone(outlook), Arc::clone(counters));
            let camera = capture::Capture { here, now_ns, to_station, sightings: sightings.clone() };
            move || camera.run(source, &frames, &outlook, &counters)
        })?;
        Ok(Self { capture, others })
    }

    /// Whether the frames are at their end.
    pub fn finished(&self) -> bool {
        self.capture.is_finished()
    }

    /// Waits for the threads to end.
    pub fn join(self) -> Result<(), SourceError> {
        let captured = self.capture.join().unwrap_or(Ok(()));
        for thread in self.others {
            // One that panicked has said so.
            let _ = thread.join();
        }
        captured
    }
}

/// How many threads run at once here.
fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

/// Starts a thread with a name.
pub fn spawn<T: Send + 'static>(
    name: &str,
    run: impl FnOnce() -> T + Send + 'static,
) -> Result<JoinHandle<T>> {
    std::thread::Builder::new().name(name.to_owned()).spawn(run).context("cannot start a thread")
}
