//! `locoman-robot run`: which robot, how it is met, and how it ends.

use std::{
    net::SocketAddr,
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicU8, Ordering},
    },
    time::{Duration, Instant},
};

use anyhow::Context;
use clap::ValueEnum;
use locoman_protocol::{Endpoints, realtime};
use locoman_robot::{
    control::{Controller, Options, RobotConfig, Wish, run as run_loop},
    go1::{
        Driver, Go1Settings,
        apart::{self, Program},
        driver::Place,
    },
    link::RobotLink,
    plant::{
        ArmServos, BusServos, Go1Plant, JointCommand, Plant, PlantError, SimPlant,
        arms::FoldedArms,
        preflight::{self, Finding},
    },
    servo::{ServoDriver, ServoError, ServoSettings, Zeros, default_zeros_file},
    supervisor::Thresholds,
};

use crate::Cli;

/// Arguments of `locoman-robot run`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The robot to control.
    #[arg(long, value_enum)]
    plant: PlantKind,
    /// Where the simulated robot answers.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:7100")]
    sim: SocketAddr,
    #[command(flatten)]
    line: WireArgs,
    #[command(flatten)]
    arms: ArmArgs,
    /// Where stations reach this robot; may be given more than once.
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/127.0.0.1:7447")]
    listen: Vec<String>,
    /// Stations that this robot connects to; may be given more than once.
    #[arg(long, value_name = "ENDPOINT")]
    connect: Vec<String>,
    /// The robot's name on the network.
    #[arg(long, value_name = "NAME", default_value = "locoman")]
    name: String,
    /// Stand up at once, without being asked. Default: true for the simulated robot, false for a real one.
    #[arg(long, value_name = "BOOL")]
    auto_stand: Option<bool>,
}

/// The line to a Go1.
#[derive(Debug, clap::Args)]
pub struct WireArgs {
    /// Where the Go1's motor board listens. Default: `board` of go1.toml.
    #[arg(long, value_name = "ADDRESS")]
    go1: Option<SocketAddr>,
    /// From where to speak to it. Default: `local` of go1.toml.
    #[arg(long, value_name = "ADDRESS")]
    go1_local: Option<SocketAddr>,
}

/// The arms of a Go1.
#[derive(Debug, clap::Args)]
struct ArmArgs {
    /// Whether the arms' servos are driven.
    #[arg(long, value_enum, default_value = "bus")]
    arms: ArmKind,
    /// The servos' port. Default: `port` of servos.toml.
    #[arg(long, value_name = "PORT")]
    servo_port: Option<String>,
    /// The servos' zero angles. Default: where `locoman-robot servo zero` has put them.
    #[arg(long, value_name = "FILE")]
    servo_zeros: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ArmKind {
    /// Eight servos on their bus.
    Bus,
    /// Nothing is connected: the arms are folded along the calves, and stay so.
    Folded,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PlantKind {
    /// The simulated robot of `locoman-sim robot`.
    Sim,
    /// A Unitree Go1 on its wires, or `locoman-sim robot --wires`.
    Go1,
}

/// How long an exchange with the simulated robot waits for a sample: long against a period, short against what
/// counts as late.
const EXCHANGE_TIMEOUT: Duration = Duration::from_millis(20);
/// How long a Go1 is waited for when the program starts.
const MEETING_PATIENCE: Duration = Duration::from_secs(10);
/// How long servos may take to answer all, and between two tries.
const SERVO_PATIENCE: Duration = Duration::from_secs(5);
const SERVO_PAUSE: Duration = Duration::from_millis(200);
/// States that a Go1 must have sent before it is looked at: speeds and modes have settled.
const MEETING_SAMPLES: u32 = 100;

/// Runs the control loop until a person or the robot ends it.
pub fn run(cli: &Cli, args: &Args) -> anyhow::Result<()> {
    let config = RobotConfig::load(&cli.configs)?;
    let endpoints = Endpoints { listen: args.listen.clone(), connect: args.connect.clone() };
    let stale_ms = config.thresholds.source_stale_ms;
    let (_link, mut inbox, mut outbox) = RobotLink::open(&args.name, &endpoints, stale_ms)
        .context("cannot go on the network; see --listen and --connect")?;
    let interrupts = count_interrupts()?;
    let mut plant: Box<dyn Plant> = match args.plant {
        PlantKind::Sim => Box::new(
            SimPlant::open(args.sim, EXCHANGE_TIMEOUT)
                .with_context(|| format!("cannot reach the simulated robot at {}; see --sim", args.sim))?,
        ),
        PlantKind::Go1 => Box::new(meet_go1(cli, args, &config)?),
    };
    let auto_stand = args.auto_stand.unwrap_or(args.plant == PlantKind::Sim);
    let mut controller = Controller::new(config, Options { auto_stand });
    if !realtime::run_before_others() {
        tracing::info!(
            "no real-time priority (it takes root or an rtprio limit); a busy machine will be felt"
        );
    }
    if !realtime::lock_memory() {
        tracing::info!(
            "memory not locked (it takes root or `ulimit -l unlimited`); a page may be waited for"
        );
    }
    tracing::info!(listen = ?args.listen, plant = ?args.plant, "control loop runs; Ctrl-C lies down and ends");
    run_loop(plant.as_mut(), &mut controller, &mut inbox, &mut outbox, || {
        match interrupts.load(Ordering::Relaxed) {
            0 => Wish::Run,
            1 => Wish::Settle,
            _ => Wish::End,
        }
    })?;
    Ok(())
}

/// `locoman-robot wire`: owns the line for the `run` that started it.
pub fn wire(cli: &Cli, args: &WireArgs) -> anyhow::Result<()> {
    apart::run(&settings(cli, args)?)
}

fn settings(cli: &Cli, args: &WireArgs) -> anyhow::Result<Go1Settings> {
    let mut settings = Go1Settings::load(&cli.configs)?;
    settings.board = args.go1.unwrap_or(settings.board);
    settings.local = args.go1_local.unwrap_or(settings.local);
    Ok(settings)
}

/// Starts the sender, waits for the robot, and looks at it: damped, before anything may move.
fn meet_go1(cli: &Cli, args: &Args, config: &RobotConfig) -> anyhow::Result<Go1Plant> {
    let arms = arms(cli, &args.arms, config)?;
    let settings = settings(cli, &args.line)?;
    let mut wire = vec!["--configs".into(), cli.configs.clone().into_os_string()];
    wire.extend(["--log", &cli.log, "wire", "--go1", &settings.board.to_string()].map(Into::into));
    wire.extend(["--go1-local", &settings.local.to_string()].map(Into::into));
    // This very program, also when its file has been replaced since.
    let program = Program { path: "/proc/self/exe".into(), args: wire };
    let driver =
        Driver::start(settings, Place::Process(program)).context("cannot start the sender's process")?;
    let mut plant = Go1Plant::new(driver, arms);
    tracing::info!(board = %settings.board, "waiting for the robot");
    let findings = look(&mut plant, &config.thresholds).with_context(|| {
        format!(
            "no state from {} for {} s: is the robot on, this machine on its network (192.168.123.x), and the \
             robot in low-level mode (lying; L2+A, L2+A, L2+B, then L1+L2+Start on the remote control)?",
            settings.board,
            MEETING_PATIENCE.as_secs()
        )
    })?;
    for finding in &findings {
        tracing::info!("{}{}", finding.found, if finding.remedy.is_some() { ": NOT IN ORDER" } else { "" });
    }
    let obstacles: Vec<String> = findings
        .iter()
        .filter_map(|finding| finding.remedy.map(|remedy| format!("{}: {remedy}", finding.found)))
        .collect();
    anyhow::ensure!(obstacles.is_empty(), "the robot is not fit to move:\n  {}", obstacles.join("\n  "));
    Ok(plant)
}

/// Brings the servos up, limp, or takes the arms as folded.
fn arms(cli: &Cli, args: &ArmArgs, config: &RobotConfig) -> anyhow::Result<Box<dyn ArmServos>> {
    if args.arms == ArmKind::Folded {
        return Ok(Box::new(FoldedArms::new(&config.control.poses)));
    }
    let mut settings = ServoSettings::load(&cli.configs)?;
    if let Some(port) = &args.servo_port {
        settings.port.clone_from(port);
    }
    let zeros = Zeros::load(&args.servo_zeros.clone().unwrap_or_else(default_zeros_file), &settings)?;
    let driver = start_servos(&settings, &zeros)
        .context("cannot bring up the arms' servos; without any, say --arms folded")?;
    Ok(Box::new(BusServos::new(driver, settings.gripper)))
}

/// Starts the servos' driver; a servo that has just been switched on, or a busy computer, may answer late.
fn start_servos(settings: &ServoSettings, zeros: &Zeros) -> Result<ServoDriver, ServoError> {
    let deadline = Instant::now() + SERVO_PATIENCE;
    loop {
        match ServoDriver::start(settings, zeros) {
            Err(error) if Instant::now() < deadline => {
                tracing::info!("{error}; trying again");
                std::thread::sleep(SERVO_PAUSE);
            }
            result => return result,
        }
    }
}

/// Exchanges damping until the robot has spoken for a while, and looks at the last sample.
fn look(plant: &mut Go1Plant, thresholds: &Thresholds) -> Result<Vec<Finding>, PlantError> {
    let deadline = Instant::now() + MEETING_PATIENCE;
    let mut samples = 0;
    loop {
        match plant.exchange(&JointCommand::damping()) {
            Ok(sensors) => {
                samples += 1;
                if samples >= MEETING_SAMPLES {
                    return Ok(preflight::inspect(&sensors, &plant.health(), thresholds));
                }
            }
            Err(PlantError::Silent { .. }) if Instant::now() < deadline => {}
            Err(error) => return Err(error),
        }
    }
}

/// Counts Ctrl-C and termination signals: the first lies down, the second damps at once.
fn count_interrupts() -> anyhow::Result<Arc<AtomicU8>> {
    let count = Arc::new(AtomicU8::new(0));
    let counted = Arc::clone(&count);
    ctrlc::set_handler(move || {
        counted.fetch_add(1, Ordering::Relaxed);
    })
    .context("cannot listen for Ctrl-C")?;
    Ok(count)
}
