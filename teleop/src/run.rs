//! `run`: puts the threads together, and takes them apart again.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow};
use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{Mode, RobotState, SimTruth};
use locoman_protocol::{Endpoints, Link, Subscription};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use locoman_vision::source::{FrameSource, SourceError};
use locoman_vision::track::{Tracker, TrackerSettings};

use crate::board::Board;
use crate::command_loop::{self, Senders};
use crate::config::Config;
use crate::console::{self, Console};
use crate::feed::{self, Feed};
use crate::gamepad;
use crate::latency::Stage;
use crate::latest::lock;
use crate::pilot::{Note, Pilot};
use crate::recorder::{Item, Recorder, Tap};
use crate::replay::Replay;
use crate::sources;
use crate::stop::StopButton;
use crate::tracking;

/// The first frame of a replay is due this long after the start: time to connect.
const REPLAY_LEAD_NS: u64 = 300_000_000;

/// Where the operator's motion comes from.
#[derive(Debug, Clone)]
pub enum Operator {
    /// A recording, over and over.
    Replay(PathBuf),
    /// The cameras of the rig.
    Cameras,
    /// Nobody is tracked: joystick and console only.
    Joystick,
}

/// Everything that `run` is told.
#[derive(Debug, Clone)]
#[expect(missing_docs, reason = "each is the option of that name")]
pub struct Options {
    pub configs: PathBuf,
    pub operator: Operator,
    pub rig: PathBuf,
    pub shells: PathBuf,
    pub robot: String,
    pub endpoints: Endpoints,
    pub console: String,
    pub auto_engage: Option<Mode>,
    pub record: Option<PathBuf>,
    pub seconds: Option<f64>,
}

/// A thread that tracks, and the one that feeds it.
struct Eyes {
    feed: JoinHandle<Result<(), SourceError>>,
    tracker: JoinHandle<()>,
}

/// Runs until `interrupted` (or the time is over, or a camera or the recorder fails).
pub fn run(options: &Options, interrupted: &mpsc::Receiver<()>) -> Result<()> {
    // Everything that can be wrong is looked at before anything starts.
    let config = Config::read(&options.configs)?;
    let board = Arc::new(Board::default());
    board.hold_replay.store(options.auto_engage.is_some(), Ordering::Relaxed);
    let sight = match &options.operator {
        Operator::Joystick => None,
        operator => Some(open_eyes(operator, options, &board)?),
    };
    let listener = TcpListener::bind(&options.console).map_err(|error| {
        anyhow!(
            "console address {}: {error}; end the program that uses it (`ss -ltnp` lists them) or give \
             another with `--console HOST:PORT`",
            options.console
        )
    })?;
    let (recorder, tap) = match &options.record {
        Some(path) => {
            let (recorder, tap) = Recorder::start(path, &attachments(options)?)?;
            (Some(recorder), tap)
        }
        None => (None, Tap::default()),
    };
    let link = Link::open(&options.robot, &options.endpoints)?;
    let subscriptions = listen(&link, &board, &tap)?;
    let stop = Arc::new(StopButton::new(link.sender()?, Arc::clone(&board)));
    let (rig, eyes) = match sight {
        Some((tracker, source)) => {
            let rig = tracker.rig().clone();
            (Some(rig), Some(start_eyes(tracker, source, &link, &board, &tap, &config)?))
        }
        None => (None, None),
    };
    gamepad::start(Arc::clone(&board), Arc::clone(&stop));
    let senders = Senders { command: link.sender()?, event: link.sender()? };
    let commands = spawn("commands", {
        let (config, board, tap) = (config.clone(), Arc::clone(&board), tap.clone());
        let pilot = Pilot::new(config.clone(), options.auto_engage);
        move || command_loop::run(pilot, &config, &board, senders, &tap)
    })?;
    let console = Console {
        board: Arc::clone(&board),
        stop,
        rig,
        config: config.console,
        silent_ms: config.command.robot_silent_ms,
        urdf: options.configs.join("robot/locoman.urdf"),
        source: link.source(),
    };
    let server = console::start(listener, console)?;
    board.happened(Note { name: "console", detail: format!("http://{}", options.console) });

    let outcome = wait(options, interrupted, eyes.as_ref());
    board.end();
    drop(server);
    let ended = eyes.map_or(Ok(()), |eyes| {
        let fed = eyes.feed.join().unwrap_or(Ok(()));
        let _ = eyes.tracker.join();
        fed
    });
    let _ = commands.join();
    drop(subscriptions);
    let dropped = tap.dropped();
    drop(tap);
    link.close();
    if dropped > 0 {
        tracing::warn!("the recorder dropped {dropped} messages");
    }
    summarize(&board);
    let recorded = recorder.map_or(Ok(()), Recorder::finish);
    outcome?;
    ended?;
    Ok(recorded?)
}

/// The tracker and the frames, checked.
fn open_eyes(
    operator: &Operator,
    options: &Options,
    board: &Board,
) -> Result<(Tracker, Box<dyn FrameSource>)> {
    let rig = Rig::load(&options.rig)?;
    let shells = ShellSet::load(&options.shells)?;
    let source: Box<dyn FrameSource> = match operator {
        Operator::Replay(path) => {
            sources::check(path)?;
            let (path, rig) = (path.clone(), rig.clone());
            let reopen = Box::new(move || sources::recording(&path, &rig));
            Box::new(Replay::open(reopen, monotonic_ns() + REPLAY_LEAD_NS, Arc::clone(&board.hold_replay))?)
        }
        Operator::Cameras | Operator::Joystick => sources::cameras(&rig)?,
    };
    Ok((Tracker::new(rig, shells, TrackerSettings::default())?, source))
}

fn start_eyes(
    tracker: Tracker,
    source: Box<dyn FrameSource>,
    link: &Link,
    board: &Arc<Board>,
    tap: &Tap,
    config: &Config,
) -> Result<Eyes> {
    let frames = Arc::new(Feed::new(tracker.rig().cameras.len()));
    let feed = spawn("cameras", {
        let (frames, board) = (Arc::clone(&frames), Arc::clone(board));
        move || feed::run(source, &frames, &board.stop)
    })?;
    let tracker = spawn("tracker", {
        let (board, tap) = (Arc::clone(board), tap.clone());
        let (sender, predicted_max_ms) = (link.sender()?, config.tracking.predicted_max_ms);
        move || tracking::run(tracker, &frames, &board, sender, &tap, predicted_max_ms)
    })?;
    Ok(Eyes { feed, tracker })
}

/// Receives what robot and simulator say.
fn listen(link: &Link, board: &Arc<Board>, tap: &Tap) -> Result<[Subscription; 2]> {
    let source = link.source();
    let (to, record) = (Arc::clone(board), tap.clone());
    let mut last_command = 0;
    let states = link.subscribe::<RobotState>(move |state| {
        let m = &state.message;
        // Only the first state that acts on a command of ours tells its latency.
        if m.command_source == source && m.command_sequence > last_command && m.engagement != 0 {
            last_command = m.command_sequence;
            let mut latency = lock(&to.latency);
            latency.add(Stage::Apply, m.command_applied_ns.saturating_sub(m.command_received_ns));
            latency.add(Stage::Total, m.command_applied_ns.saturating_sub(m.command_capture_ns));
            let sent_ns = lock(&to.sent).iter().find(|(n, _)| *n == m.command_sequence).map(|(_, ns)| *ns);
            if let Some(sent_ns) = sent_ns {
                latency.add(Stage::Link, m.command_received_ns.saturating_sub(sent_ns));
            }
        }
        let state = Arc::new(state);
        record.offer(Item::State(Arc::clone(&state)));
        *lock(&to.robot) = Some(state);
    })?;
    let (to, record) = (Arc::clone(board), tap.clone());
    let truths = link.subscribe::<SimTruth>(move |truth| {
        let truth = Arc::new(truth);
        record.offer(Item::Truth(Arc::clone(&truth)));
        *lock(&to.truth) = Some(truth);
    })?;
    Ok([states, truths])
}

/// Until time, interruption, or the end of the frames.
fn wait(options: &Options, interrupted: &mpsc::Receiver<()>, eyes: Option<&Eyes>) -> Result<()> {
    let deadline = options.seconds.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds));
    loop {
        if interrupted.recv_timeout(Duration::from_millis(100)).is_ok() {
            return Ok(());
        }
        if deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            return Ok(());
        }
        if eyes.is_some_and(|eyes| eyes.feed.is_finished() || eyes.tracker.is_finished()) {
            return Ok(());
        }
    }
}

/// What the session was like, in a few lines.
fn summarize(board: &Board) {
    for camera in lock(&board.tracking).iter().flat_map(|tracking| &tracking.cameras) {
        tracing::info!("camera {}: {} of {} frames dropped", camera.camera, camera.dropped, camera.frames);
    }
    let latency = lock(&board.latency);
    for stage in Stage::ALL {
        if let Some((p50, p99)) = latency.percentiles_ns(stage) {
            let (p50, p99) = (p50 as f64 * 1e-6, p99 as f64 * 1e-6);
            tracing::info!("{}: p50 {p50:.2} ms, p99 {p99:.2} ms over the last seconds", stage.name());
        }
    }
}

/// The configuration that a session recording carries.
fn attachments(options: &Options) -> Result<Vec<(String, String)>> {
    let settings = options.configs.join("teleop.toml");
    let mut files: Vec<(&str, &Path)> = vec![("teleop.toml", &settings)];
    if !matches!(options.operator, Operator::Joystick) {
        files.extend([("rig.toml", options.rig.as_path()), ("shells.toml", options.shells.as_path())]);
    }
    let read = |(name, path): (&str, &Path)| {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        Ok((name.to_owned(), text))
    };
    files.into_iter().map(read).collect()
}

fn spawn<T: Send + 'static>(name: &str, run: impl FnOnce() -> T + Send + 'static) -> Result<JoinHandle<T>> {
    std::thread::Builder::new().name(name.to_owned()).spawn(run).context("cannot start a thread")
}
