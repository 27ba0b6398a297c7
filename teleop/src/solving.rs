//! The solver's thread: readings of local and remote cameras to poses, to the board, to the link, to the recorder.
//!
//! What the scout finds of a lost shell begins its motion at the time of the scout's frame; the eyes then read it
//! where it must be now. It never touches a shell that is followed: the frame is older than those that follow it.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use locoman_protocol::Sender;
use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{self, Header};
use locoman_vision::track::{Fusion, TrackUpdate};

use crate::board::Board;
use crate::gather::{Gather, SILENT_NS};
use crate::latency::Stage;
use crate::latest::lock;
use crate::node::wire;
use crate::observe::{Observer, Tracked};
use crate::pilot::Note;
use crate::recorder::{Item, Tap};
use crate::report::report;
use crate::shown;
use crate::sight::{Counters, Outlook, Reading, Sighting};

/// Reports over which the rate is measured.
const RATE_WINDOW: usize = 40;
/// Between two looks at what does not come with a frame.
const NAP: Duration = Duration::from_millis(50);

/// Sends what is known.
#[derive(Debug)]
pub struct Senders {
    /// To console and recorder.
    pub tracking: Sender<messages::Tracking>,
    /// To camera nodes; `None` without any.
    pub motions: Option<Sender<messages::Motions>>,
}

/// Turns sightings into poses.
#[derive(Debug)]
pub struct Solver {
    /// Solves.
    pub fusion: Fusion,
    /// Puts together what is solved together.
    pub gather: Gather,
    /// Where the eyes look it up.
    pub outlook: Arc<Outlook>,
    /// Of the cameras.
    pub counters: Arc<Counters>,
    /// Where everybody looks it up.
    pub board: Arc<Board>,
    /// The recorder.
    pub tap: Tap,
    /// To others.
    pub senders: Senders,
    /// What may move the robot.
    pub observer: Observer,
}

impl Solver {
    /// Solves until nobody sees any more, or everything ends.
    pub fn run(mut self, sightings: &Receiver<Sighting>) {
        let mut watch = Watch::new(&self.counters);
        let mut published_ns = 0;
        while !self.board.stopping() {
            match sightings.recv_timeout(self.patience()) {
                Ok(Sighting::Arrived { camera, capture_ns }) => {
                    self.gather.arrived(camera, capture_ns, monotonic_ns());
                }
                Ok(Sighting::Displaced { camera, capture_ns }) => self.gather.displaced(camera, capture_ns),
                Ok(Sighting::Read(reading)) => self.gather.read(*reading, monotonic_ns()),
                Ok(Sighting::Searched(found)) => {
                    if self.fusion.found(*found) {
                        self.tell(monotonic_ns());
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            let now_ns = monotonic_ns();
            self.gather.wait_over(now_ns);
            while let Some(readings) = self.gather.pop() {
                self.solve(readings, &mut published_ns, &mut watch);
            }
            watch.look(&self.counters, &self.board, now_ns);
        }
    }

    fn patience(&self) -> Duration {
        let now_ns = monotonic_ns();
        let wait = self.gather.deadline_ns().map(|at| Duration::from_nanos(at.saturating_sub(now_ns)));
        // What has not come by its deadline and is being read here may take a little longer.
        wait.map_or(NAP, |wait| wait.clamp(Duration::from_millis(1), NAP))
    }

    fn solve(&mut self, readings: Vec<Reading>, published_ns: &mut u64, watch: &mut Watch) {
        let in_memory_ns = readings.iter().map(|reading| reading.in_memory_ns).max().unwrap_or(0);
        let (mut updates, mut images) = (Vec::with_capacity(readings.len()), Vec::new());
        for Reading { update, image, .. } in readings {
            images.extend(image.map(|image| (update.camera, image)));
            updates.push(update);
        }
        let update = self.fusion.update(updates);
        self.tell(update.time_ns);
        watch.moved(&update, &self.counters, &self.board);
        // A straggler has improved what is known; its own instant is history.
        if update.time_ns > *published_ns {
            *published_ns = update.time_ns;
            self.publish(&update, in_memory_ns);
        }
        if self.board.viewers.load(Ordering::Relaxed) > 0 {
            shown::put(&self.board, self.fusion.shells(), update, images);
        }
        self.outlook.watched.store(self.board.viewers.load(Ordering::Relaxed) > 0, Ordering::Relaxed);
    }

    /// Tells the eyes, here and elsewhere, where the shells are.
    fn tell(&mut self, time_ns: u64) {
        let motions = Arc::new(self.fusion.motions());
        self.outlook.know(Arc::clone(&motions), self.fusion.lost_at(time_ns));
        if let Some(sender) = &mut self.senders.motions {
            let message = wire::motions_message(&motions, self.fusion.shells());
            if let Err(error) = sender.send(time_ns, message) {
                tracing::debug!("motions not published: {error}");
            }
        }
    }

    fn publish(&mut self, update: &TrackUpdate, in_memory_ns: u64) {
        let mut report = report(self.fusion.shells(), update);
        report.cameras =
            self.counters.stats(|camera| update.camera(camera).map_or(0, |seen| seen.tags.len()));
        report.header = Some(Header { capture_ns: update.time_ns, ..Header::default() });
        let usable = self.observer.observe(&report);
        let motions = self.outlook.motions();
        let now_ns = monotonic_ns();
        report.age_ns = now_ns.saturating_sub(update.time_ns);
        report.image_to_pose_ns = if in_memory_ns == 0 { 0 } else { now_ns.saturating_sub(in_memory_ns) };
        *lock(&self.board.seen) = Some(Tracked::new(usable, &motions, self.fusion.shells()));
        {
            let mut latency = lock(&self.board.latency);
            latency.add(Stage::Decode, update.decode_ns);
            latency.add(Stage::Detect, update.detect_ns);
            latency.add(Stage::Solve, update.solve_ns);
            latency.add(Stage::Solved, report.age_ns);
            if in_memory_ns != 0 {
                latency.add(Stage::InMemory, report.image_to_pose_ns);
            }
        }
        let report = match self.senders.tracking.send(update.time_ns, report.clone()) {
            Ok(sent) => sent,
            Err(error) => {
                tracing::debug!("tracking not published: {error}");
                report
            }
        };
        let report = Arc::new(report);
        self.tap.offer(Item::Tracking(Arc::clone(&report)));
        *lock(&self.board.tracking) = Some(report);
        let mut times = lock(&self.board.tracked_ns);
        if times.len() == RATE_WINDOW {
            times.pop_front();
        }
        times.push_back(now_ns);
    }
}

/// Says when a camera falls silent or is found to have moved, and when it is back.
#[derive(Debug)]
struct Watch {
    silent: Vec<bool>,
    moved: Vec<bool>,
}

impl Watch {
    fn new(counters: &Counters) -> Self {
        let none = vec![false; counters.cameras.len()];
        Self { silent: none.clone(), moved: none }
    }

    fn moved(&mut self, update: &TrackUpdate, counters: &Counters, board: &Board) {
        for seen in &update.cameras {
            let Some(was_moved) = self.moved.get_mut(seen.camera) else { continue };
            if seen.moved_px.is_some() == *was_moved {
                continue;
            }
            *was_moved = seen.moved_px.is_some();
            let id = counters.ids().get(seen.camera).map_or("", String::as_str);
            let detail = match seen.moved_px {
                Some(moved_px) => format!("{id} {}", shown::moved(moved_px)),
                None => format!("{id} is where the rig file says again"),
            };
            board.happened(Note { name: "camera", detail });
        }
    }

    fn look(&mut self, counters: &Counters, board: &Board, now_ns: u64) {
        let cameras = counters.ids().iter().zip(&counters.cameras);
        for ((id, camera), was_silent) in cameras.zip(&mut self.silent) {
            let heard_ns = camera.heard_ns.load(Ordering::Relaxed);
            let silent = heard_ns != 0 && now_ns.saturating_sub(heard_ns) > SILENT_NS;
            if silent != *was_silent {
                *was_silent = silent;
                let what = if silent { "is silent; the others go on" } else { "is back" };
                board.happened(Note { name: "camera", detail: format!("{id} {what}") });
            }
        }
    }
}
