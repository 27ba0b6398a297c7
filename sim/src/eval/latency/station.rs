//! The station's threads on a strip of images, and what a listener hears of them.

use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anyhow::Context;
use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{Tracking, Verdict};
use locoman_protocol::{Endpoints, Link};
use locoman_teleop::board::Board;
use locoman_teleop::config::Config;
use locoman_teleop::gather::Gather;
use locoman_teleop::observe::Observer;
use locoman_teleop::recorder::Tap;
use locoman_teleop::sight::{Counters, Equipment, Outlook, SIGHTINGS, Sight, spawn};
use locoman_teleop::solving::{Senders, Solver};
use locoman_vision::track::{Fusion, TrackerSettings};

use super::strip::Strip;

/// Seconds at the begin that do not count: everything is lost then, and found.
pub const WARM_UP_S: f64 = 2.0;
/// Nobody else is to hear these poses.
const ROBOT: &str = "latency_evaluation";

/// What was heard after the warm-up.
#[derive(Debug, Default)]
pub struct Session {
    /// From the last image of an instant in memory to its poses published.
    pub image_to_pose_ms: Vec<f64>,
    /// From its exposure.
    pub age_ms: Vec<f64>,
    /// Images that came, and those that nobody had time for.
    pub frames: u64,
    /// See [`Session::frames`].
    pub dropped: u64,
    /// Images that were searched whole.
    pub searched_whole: u64,
    /// Share of the poses that were called measured.
    pub tracked_share: f64,
    /// Processor time of this process, of all that there was.
    pub cpu_share: f64,
}

/// What the listener notes.
#[derive(Debug, Default)]
struct Heard {
    image_to_pose_ms: Vec<f64>,
    age_ms: Vec<f64>,
    shells: usize,
    tracked: usize,
}

/// Counts at one time.
#[derive(Debug, Clone, Copy, Default)]
struct Reckoning {
    frames: u64,
    dropped: u64,
    searched_whole: u64,
    cpu_s: f64,
    at_ns: u64,
}

/// Plays a strip for some seconds in real time.
pub fn play(configs: &Path, strip: Strip, seconds: f64) -> anyhow::Result<Session> {
    let config = Config::read(configs)?;
    let (rig, shells) = (strip.rig.clone(), strip.shells.clone());
    let settings = TrackerSettings::default();
    let board = Arc::new(Board::default());
    let ids = rig.cameras.iter().map(|camera| camera.id.clone()).collect();
    let counters = Arc::new(Counters::new(ids));
    let outlook = Arc::new(Outlook::new(Arc::clone(&board.stop)));
    let link = Link::open(ROBOT, &Endpoints::default())?;

    let heard = Arc::new(Mutex::new(Heard::default()));
    let count_from_ns = monotonic_ns() + (WARM_UP_S * 1e9) as u64;
    let notes = Arc::clone(&heard);
    let subscription = link.subscribe::<Tracking>(move |tracking| {
        if tracking.received_ns >= count_from_ns {
            notes.lock().unwrap_or_else(PoisonError::into_inner).note(&tracking.message);
        }
    })?;

    let (sightings, seen) = sync_channel(SIGHTINGS);
    let solver = Solver {
        gather: Gather::new(&rig.sync_groups, config.tracking.straggler_ms * 1_000_000),
        fusion: Fusion::new(rig.clone(), shells.clone(), settings.clone()),
        outlook: Arc::clone(&outlook),
        counters: Arc::clone(&counters),
        board: Arc::clone(&board),
        tap: Tap::default(),
        senders: Senders { tracking: link.sender()?, motions: None },
        observer: Observer::new(config.tracking.predicted_max_ms),
    };
    let solving = spawn("solver", move || solver.run(&seen))?;
    let equipment = Equipment {
        rig: &rig,
        shells: &shells,
        settings: &settings,
        here: vec![true; rig.cameras.len()],
        source: Box::new(strip.show(seconds)),
        now_ns: Arc::new(monotonic_ns),
        to_station: Arc::new(Some),
    };
    let sight = Sight::start(equipment, &outlook, &counters, &sightings)?;
    drop(sightings);

    std::thread::sleep(Duration::from_nanos(count_from_ns.saturating_sub(monotonic_ns())));
    let begin = Reckoning::now(&counters)?;
    while !sight.finished() {
        std::thread::sleep(Duration::from_millis(50));
    }
    let end = Reckoning::now(&counters)?;
    sight.join()?;
    board.end();
    let _ = solving.join();
    drop(subscription);
    link.close();

    let heard = std::mem::take(&mut *heard.lock().unwrap_or_else(PoisonError::into_inner));
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get) as f64;
    let wall_s = (end.at_ns - begin.at_ns) as f64 * 1e-9;
    Ok(Session {
        tracked_share: heard.tracked as f64 / heard.shells as f64,
        image_to_pose_ms: heard.image_to_pose_ms,
        age_ms: heard.age_ms,
        frames: end.frames - begin.frames,
        dropped: end.dropped - begin.dropped,
        searched_whole: end.searched_whole - begin.searched_whole,
        cpu_share: (end.cpu_s - begin.cpu_s) / (wall_s * cores),
    })
}

impl Heard {
    fn note(&mut self, tracking: &Tracking) {
        self.image_to_pose_ms.push(tracking.image_to_pose_ns as f64 * 1e-6);
        self.age_ms.push(tracking.age_ns as f64 * 1e-6);
        self.shells += tracking.shells.len();
        self.tracked += tracking.shells.iter().filter(|shell| shell.verdict() == Verdict::Tracked).count();
    }
}

impl Reckoning {
    fn now(counters: &Counters) -> anyhow::Result<Self> {
        let mut reckoning = Self { cpu_s: cpu_s()?, at_ns: monotonic_ns(), ..Self::default() };
        for camera in &counters.cameras {
            reckoning.frames += camera.frames.load(Ordering::Relaxed);
            reckoning.dropped += camera.dropped.load(Ordering::Relaxed);
            reckoning.searched_whole += camera.searched_whole.load(Ordering::Relaxed);
        }
        Ok(reckoning)
    }
}

/// Processor time of this process so far, as the kernel counts it: in ticks of 10 ms.
fn cpu_s() -> anyhow::Result<f64> {
    const TICK_S: f64 = 0.01;
    /// After the name, which may hold spaces: the twelfth and thirteenth number.
    const USER: usize = 11;
    let stat = std::fs::read_to_string("/proc/self/stat").context("cannot read /proc/self/stat")?;
    let numbers = stat.rsplit_once(')').map_or("", |(_, after)| after);
    let ticks = numbers.split_whitespace().skip(USER).take(2).map(str::parse::<f64>);
    Ok(TICK_S * ticks.sum::<Result<f64, _>>().context("/proc/self/stat has no processor times")?)
}
