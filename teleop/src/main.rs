//! `locoman-teleop`: the operator's station.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};

use anyhow::{Context, Result, bail};
use clap::{Args, Parser, Subcommand, ValueEnum};
use locoman_protocol::Endpoints;
use locoman_protocol::messages::Mode;
use locoman_teleop::replay::Pace;
use locoman_teleop::review::{self, Tally};
use locoman_teleop::run::{Operator, Options};
use locoman_teleop::sources::Frames;
use locoman_teleop::{doctor, node, play, poses, record, run, sources};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use locoman_vision::track::{Tracker, TrackerSettings};
use tracing_subscriber::EnvFilter;

/// The operator's station: tracks the operator, or reads joystick and keyboard, and commands the robot.
#[derive(Debug, Parser)]
#[command(version)]
struct Cli {
    /// Folder of the configuration
    #[arg(long, global = true, default_value = "configs", value_name = "DIR")]
    configs: PathBuf,
    /// What to log: error, warn, info, debug, trace, or a filter such as `locoman_teleop=debug`
    #[arg(long, global = true, default_value = "info", value_name = "LEVEL")]
    log: String,
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Drives the robot, live or from a recording, and serves the console
    Run(RunArgs),
    /// Plays a trajectory on the robot, and says how well it was followed
    Play(PlayArgs),
    /// Tracks a recording offline into a table of poses; deterministic
    Track(TrackArgs),
    /// Records the cameras of the rig
    Record(RecordArgs),
    /// Reads cameras for a station on another machine: a camera node
    Detect(DetectArgs),
    /// Looks at everything that `run` needs, and says what to do about what is missing
    Doctor(DoctorArgs),
}

/// Rig and shells.
#[derive(Debug, Args)]
struct Files {
    /// Rig file [default: CONFIGS/rigs/two_zed_pairs.toml]
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Shells file [default: CONFIGS/shells/standard.toml]
    #[arg(long, value_name = "FILE")]
    shells: Option<PathBuf>,
}

impl Files {
    fn rig(&self, configs: &Path) -> PathBuf {
        self.rig.clone().unwrap_or_else(|| configs.join("rigs/two_zed_pairs.toml"))
    }

    fn shells(&self, configs: &Path) -> PathBuf {
        self.shells.clone().unwrap_or_else(|| configs.join("shells/standard.toml"))
    }
}

/// Who the robot is and where.
#[derive(Debug, Args)]
struct Peer {
    /// Name of the robot
    #[arg(long, default_value = "locoman", value_name = "NAME")]
    robot: String,
    /// Where robot and simulator listen
    #[arg(long, value_name = "tcp/HOST:PORT",
        default_values = ["tcp/127.0.0.1:7447", "tcp/127.0.0.1:7448"])]
    connect: Vec<String>,
    /// Address of the console
    #[arg(long, default_value = "127.0.0.1:8080", value_name = "HOST:PORT")]
    console: String,
}

#[derive(Debug, Args)]
#[group(id = "operator", required = true, multiple = false)]
struct OperatorArgs {
    /// Replay a recording, over and over: an MCAP file or a folder of images
    #[arg(long, value_name = "REC")]
    replay: Option<PathBuf>,
    /// Track the operator with the cameras of this rig file
    #[arg(long, value_name = "RIG")]
    cameras: Option<PathBuf>,
    /// Track nobody: joystick and console only
    #[arg(long)]
    joystick: bool,
}

/// How a recording is played.
#[derive(Debug, Args)]
struct PaceArgs {
    /// With --replay: play this many times as fast as it was recorded
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// The recording's first frame is due at this time of the monotonic clock: several programs play together
    #[arg(long, value_name = "NS", hide = true)]
    replay_at: Option<u64>,
}

impl PaceArgs {
    fn pace(&self) -> Pace {
        Pace { speed: self.speed, start_ns: self.replay_at }
    }
}

fn speed(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(speed) if (0.01..=10.0).contains(&speed) => Ok(speed),
        _ => Err("write a number from 0.01 to 10".to_owned()),
    }
}

#[derive(Debug, Args)]
struct RunArgs {
    #[command(flatten)]
    operator: OperatorArgs,
    #[command(flatten)]
    pace: PaceArgs,
    #[command(flatten)]
    files: Files,
    #[command(flatten)]
    peer: Peer,
    /// Where camera nodes find this station [default: tcp/0.0.0.0:7449 if the rig file has remote cameras]
    #[arg(long, value_name = "tcp/HOST:PORT")]
    listen: Vec<String>,
    /// With --replay: bring the robot into this mode and engage without a person; the recorded operator
    /// waits at the recording's begin until then
    #[arg(long, value_name = "MODE", conflicts_with_all = ["cameras", "joystick"])]
    auto_engage: Option<AutoMode>,
    /// Record the session
    #[arg(long, value_name = "FILE.mcap")]
    record: Option<PathBuf>,
    /// End after this time
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum AutoMode {
    RightGripper,
    LeftGripper,
    RightFoot,
    LeftFoot,
    Stance,
}

impl From<AutoMode> for Mode {
    fn from(mode: AutoMode) -> Self {
        match mode {
            AutoMode::RightGripper => Self::RightGripper,
            AutoMode::LeftGripper => Self::LeftGripper,
            AutoMode::RightFoot => Self::RightFoot,
            AutoMode::LeftFoot => Self::LeftFoot,
            AutoMode::Stance => Self::Stance,
        }
    }
}

#[derive(Debug, Args)]
struct PlayArgs {
    /// The trajectory, such as configs/trajectories/square.toml
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Name of the robot
    #[arg(long, default_value = "locoman", value_name = "NAME")]
    robot: String,
    /// Where the robot listens
    #[arg(long, value_name = "tcp/HOST:PORT", default_values = ["tcp/127.0.0.1:7447"])]
    connect: Vec<String>,
    /// Let go after this time, wherever the robot is then
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
}

#[derive(Debug, Args)]
struct TrackArgs {
    /// An MCAP file or a folder of images
    #[arg(value_name = "REC")]
    recording: PathBuf,
    #[command(flatten)]
    files: Files,
    /// The table of poses
    #[arg(short, long, value_name = "POSES.csv")]
    output: PathBuf,
    /// Also write residuals, coverage, losses, jumps and times into this folder, as text, JSON and plots
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct RecordArgs {
    #[command(flatten)]
    files: Files,
    /// The recording
    #[arg(short, long, value_name = "REC.mcap")]
    output: PathBuf,
    /// End after this time
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
}

#[derive(Debug, Args)]
struct DetectArgs {
    #[command(flatten)]
    files: Files,
    /// Ids of the cameras to read [default: those that the rig file calls remote]
    #[arg(long, value_name = "ID,ID", value_delimiter = ',')]
    cameras: Vec<String>,
    /// Read them from a recording, over and over, in place of the devices
    #[arg(long, value_name = "REC")]
    replay: Option<PathBuf>,
    #[command(flatten)]
    pace: PaceArgs,
    /// Name of the robot
    #[arg(long, default_value = "locoman", value_name = "NAME")]
    robot: String,
    /// Where the station listens
    #[arg(long, value_name = "tcp/HOST:PORT", default_values = ["tcp/127.0.0.1:7449"])]
    connect: Vec<String>,
    /// End after this time
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Pretend that this machine's clock is ahead by so much: for tests
    #[arg(long, value_name = "MS", default_value_t = 0.0, hide = true, allow_negative_numbers = true)]
    clock_shift_ms: f64,
}

#[derive(Debug, Args)]
struct DoctorArgs {
    #[command(flatten)]
    files: Files,
    #[command(flatten)]
    peer: Peer,
    /// A recording to look at
    #[arg(long, value_name = "REC")]
    replay: Option<PathBuf>,
    /// On a camera node: the station whose clock to ask for
    #[arg(long, value_name = "tcp/HOST:PORT")]
    station: Option<String>,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    match start_log(&cli.log).and_then(|()| obey(cli)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            report(&error);
            ExitCode::FAILURE
        }
    }
}

/// The error and its causes; a cause that its effect has quoted already is not said twice.
#[expect(clippy::print_stderr, reason = "the one report at the edge of the program")]
fn report(error: &anyhow::Error) {
    let mut said = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if !said.contains(&cause) {
            said += if said.is_empty() { "" } else { ": " };
            said += &cause;
        }
    }
    eprintln!("error: {said}");
}

fn start_log(level: &str) -> Result<()> {
    // Zenoh tells of every connection attempt; its warnings are for us to report in our words.
    let filter = EnvFilter::try_new(format!("{level},zenoh=off,zenoh_transport=off"))
        .with_context(|| format!("--log {level} is no level: use error, warn, info, debug or trace"))?;
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .init();
    Ok(())
}

fn obey(cli: Cli) -> Result<()> {
    let configs = cli.configs;
    match cli.task {
        Task::Run(args) => drive(configs, args),
        Task::Track(args) => {
            let rig = Rig::load(&args.files.rig(&configs))?;
            let shells = ShellSet::load(&args.files.shells(&configs))?;
            sources::check(&args.recording)?;
            let tracker = Tracker::new(rig.clone(), shells.clone(), TrackerSettings::default())?;
            let mut tally = Tally::new(rig.cameras.len(), shells.shells.len());
            let summary = poses::write(&args.recording, tracker, &args.output, &mut tally)?;
            if let Some(folder) = &args.report {
                println!("{}", review::write(folder, &tally, &rig, &shells)?);
            }
            tracing::info!(
                "{} poses of {} instants in {} ({} frames skipped)",
                summary.poses,
                summary.instants,
                args.output.display(),
                summary.skipped
            );
            Ok(())
        }
        Task::Play(args) => perform(args),
        Task::Record(args) => {
            let path = args.files.rig(&configs);
            let rig = Rig::load(&path)?;
            let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
            let stop = stop_on_signal()?;
            let frames = record::run(&rig, &text, &args.output, args.seconds, &stop)?;
            tracing::info!("{frames} frames in {}", args.output.display());
            Ok(())
        }
        Task::Detect(args) => detect(&configs, args),
        Task::Doctor(args) => examine(&configs, &args),
    }
}

/// Set when the user interrupts the program.
fn stop_on_signal() -> Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let on_signal = Arc::clone(&stop);
    ctrlc::set_handler(move || on_signal.store(true, Ordering::Relaxed))?;
    Ok(stop)
}

fn perform(args: PlayArgs) -> Result<()> {
    let options = play::Options {
        file: args.file,
        robot: args.robot,
        endpoints: Endpoints { listen: Vec::new(), connect: args.connect },
        seconds: args.seconds,
    };
    let interrupted = stop_on_signal()?;
    println!("{}", play::run(&options, &interrupted)?);
    Ok(())
}

fn drive(configs: PathBuf, args: RunArgs) -> Result<()> {
    let OperatorArgs { replay, cameras, .. } = args.operator;
    let rig = cameras.clone().unwrap_or_else(|| args.files.rig(&configs));
    let operator = match (replay, cameras) {
        (Some(path), _) => Operator::Tracked(Frames::Replay(path, args.pace.pace())),
        (None, Some(_)) => Operator::Tracked(Frames::Live),
        (None, None) => Operator::Joystick,
    };
    let (interrupt, interrupted) = mpsc::channel();
    ctrlc::set_handler(move || {
        // An error means that the program is ending already.
        let _ = interrupt.send(());
    })?;
    let options = Options {
        rig,
        shells: args.files.shells(&configs),
        configs,
        operator,
        robot: args.peer.robot,
        listen: args.listen,
        connect: args.peer.connect,
        console: args.peer.console,
        auto_engage: args.auto_engage.map(Into::into),
        record: args.record,
        seconds: args.seconds,
    };
    run::run(&options, &interrupted)
}

fn detect(configs: &Path, args: DetectArgs) -> Result<()> {
    let own_clock = node::OwnClock { shift_ns: (args.clock_shift_ms * 1e6) as i64 };
    let pace = args.pace.pace();
    let pace = Pace { start_ns: pace.start_ns.map(|start_ns| own_clock.moved(start_ns)), ..pace };
    let options = node::Options {
        rig: args.files.rig(configs),
        shells: args.files.shells(configs),
        cameras: args.cameras,
        frames: args.replay.map_or(Frames::Live, |path| Frames::Replay(path, pace)),
        robot: args.robot,
        endpoints: Endpoints { listen: Vec::new(), connect: args.connect },
        own_clock,
        seconds: args.seconds,
    };
    node::run(&options, &stop_on_signal()?)
}

fn examine(configs: &Path, args: &DoctorArgs) -> Result<()> {
    let patient = doctor::Patient {
        configs,
        rig: &args.files.rig(configs),
        shells: &args.files.shells(configs),
        replay: args.replay.as_deref(),
        console: &args.peer.console,
        robot: &args.peer.robot,
        connect: &args.peer.connect,
        station: args.station.as_deref(),
    };
    let mut failures = 0;
    doctor::examine(&patient, |finding| {
        failures += usize::from(matches!(finding, doctor::Finding::Bad(_)));
        println!("{finding}");
    });
    if failures > 0 {
        bail!("{failures} of the above keep `run` from working");
    }
    Ok(())
}
