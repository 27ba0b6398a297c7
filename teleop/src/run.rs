//! `run`: puts the threads together, and takes them apart again.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow};
use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{Mode, RobotState, SimTruth};
use locoman_protocol::{Endpoints, Link, Subscription};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use locoman_vision::source::FrameSource;
use locoman_vision::track::{Fusion, TrackerSettings};

use crate::board::Board;
use crate::command_loop::{self, Senders};
use crate::config::Config;
use crate::console::{self, Console};
use crate::gamepad;
use crate::gather::Gather;
use crate::latency::Stage;
use crate::latest::lock;
use crate::node::{Remotes, described};
use crate::observe::Observer;
use crate::pilot::{Note, Pilot};
use crate::recorder::{Item, Recorder, Tap};
use crate::sight::{Counters, Equipment, Outlook, SIGHTINGS, Sight, spawn};
use crate::solving::{self, Solver};
use crate::sources::Frames;
use crate::stop::StopButton;

/// Where camera nodes look for a station.
const LISTEN: &str = "tcp/0.0.0.0:7449";

/// Where the operator's motion comes from.
#[derive(Debug, Clone)]
pub enum Operator {
    /// Images, of the cameras that are read here; others may be read by camera nodes.
    Tracked(Frames),
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
    /// Where camera nodes find this station; empty: the default place if the rig has remote cameras.
    pub listen: Vec<String>,
    pub connect: Vec<String>,
    pub console: String,
    pub auto_engage: Option<Mode>,
    pub record: Option<PathBuf>,
    pub seconds: Option<f64>,
}

/// What is needed to look, checked.
struct Prepared {
    rig: Rig,
    shells: ShellSet,
    /// `None`: camera nodes read all cameras.
    source: Option<Box<dyn FrameSource>>,
}

/// The threads that look, and the one that solves.
struct Eyes {
    sight: Option<Sight>,
    solver: JoinHandle<()>,
    remotes: Option<Remotes>,
}

impl Eyes {
    fn finished(&self) -> bool {
        self.sight.as_ref().is_some_and(Sight::finished) || self.solver.is_finished()
    }
}

/// Runs until `interrupted` (or the time is over, or a camera or the recorder fails).
pub fn run(options: &Options, interrupted: &mpsc::Receiver<()>) -> Result<()> {
    // Everything that can be wrong is looked at before anything starts.
    let config = Config::read(&options.configs)?;
    let board = Arc::new(Board::default());
    board.hold_replay.store(options.auto_engage.is_some(), Ordering::Relaxed);
    let sight = match &options.operator {
        Operator::Joystick => None,
        Operator::Tracked(frames) => Some(prepare(frames, options, &board)?),
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
    let endpoints =
        Endpoints { listen: listen_at(options, sight.as_ref()), connect: options.connect.clone() };
    let link = Link::open(&options.robot, &endpoints)?;
    let subscriptions = listen(&link, &board, &tap)?;
    let stop = Arc::new(StopButton::new(link.sender()?, Arc::clone(&board)));
    let (view, eyes) = match sight {
        Some(prepared) => {
            let view = (prepared.rig.clone(), prepared.shells.clone());
            (Some(view), Some(start_eyes(prepared, &link, &board, &tap, &config)?))
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
        view,
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
        drop(eyes.remotes);
        let ended = eyes.sight.map_or(Ok(()), Sight::join);
        let _ = eyes.solver.join();
        ended
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

/// Where camera nodes find this station.
fn listen_at(options: &Options, sight: Option<&Prepared>) -> Vec<String> {
    let nodes = sight.is_some_and(|prepared| here(&prepared.rig).contains(&false));
    if nodes && options.listen.is_empty() { vec![LISTEN.to_owned()] } else { options.listen.clone() }
}

/// Rig, shells and frames, checked.
fn prepare(frames: &Frames, options: &Options, board: &Board) -> Result<Prepared> {
    let rig = Rig::load(&options.rig)?;
    let shells = ShellSet::load(&options.shells)?;
    let here = here(&rig);
    let source = if here.contains(&true) {
        Some(frames.open(&rig, &here, monotonic_ns(), &board.hold_replay)?)
    } else {
        None
    };
    Ok(Prepared { rig, shells, source })
}

/// Which cameras are read here.
fn here(rig: &Rig) -> Vec<bool> {
    rig.sources.iter().map(|source| !source.remote).collect()
}

fn start_eyes(
    prepared: Prepared,
    link: &Link,
    board: &Arc<Board>,
    tap: &Tap,
    config: &Config,
) -> Result<Eyes> {
    let Prepared { rig, shells, source } = prepared;
    let settings = TrackerSettings::default();
    let here = here(&rig);
    let some_remote = here.contains(&false);
    let counters = Arc::new(Counters::new(rig.cameras.iter().map(|camera| camera.id.clone()).collect()));
    let _ = board.counters.set(Arc::clone(&counters));
    let outlook = Arc::new(Outlook::new(Arc::clone(&board.stop)));
    let (sightings, seen) = sync_channel(SIGHTINGS);
    let remotes = some_remote
        .then(|| Remotes::listen(link, &rig, &shells, &counters, sightings.clone()))
        .transpose()?;
    let solver = Solver {
        gather: Gather::new(&rig.sync_groups, config.tracking.straggler_ms * 1_000_000),
        fusion: Fusion::new(rig.clone(), shells.clone(), settings.clone()),
        outlook: Arc::clone(&outlook),
        counters: Arc::clone(&counters),
        board: Arc::clone(board),
        tap: tap.clone(),
        senders: solving::Senders {
            tracking: link.sender()?,
            motions: some_remote.then(|| link.sender()).transpose()?,
        },
        observer: Observer::new(config.tracking.predicted_max_ms),
    };
    let solver = spawn("solver", move || solver.run(&seen))?;
    let equipment = |source| Equipment {
        rig: &rig,
        shells: &shells,
        settings: &settings,
        here,
        source,
        now_ns: Arc::new(monotonic_ns),
        to_station: Arc::new(Some),
    };
    let start = |source| Sight::start(equipment(source), &outlook, &counters, &sightings);
    let sight = source.map(start).transpose()?;
    Ok(Eyes { sight, solver, remotes })
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
        if eyes.is_some_and(Eyes::finished) {
            return Ok(());
        }
    }
}

/// What the session was like, in a few lines.
fn summarize(board: &Board) {
    for camera in board.counters.get().iter().flat_map(|counters| counters.stats(|_| 0)) {
        let (id, dropped, frames) = (&camera.camera, camera.dropped, camera.frames);
        let clock = camera.clock.map(|clock| format!(", {}", described(&clock))).unwrap_or_default();
        tracing::info!(
            "camera {id}: {dropped} of {frames} frames dropped, {} searched whole{clock}",
            camera.searched_whole
        );
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
