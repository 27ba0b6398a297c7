//! `locoman-robot`: the controller on the robot's computer, or against the simulated robot.

use std::{
    net::SocketAddr,
    path::PathBuf,
    process::ExitCode,
    sync::{
        Arc,
        atomic::{AtomicU8, Ordering},
    },
    time::Duration,
};

use anyhow::Context;
use clap::{Parser, Subcommand, ValueEnum};
use locoman_protocol::{Endpoints, realtime};
use locoman_robot::{
    control::{Controller, Options, RobotConfig, Wish, run},
    link::RobotLink,
    plant::{Plant, SimPlant},
    servo,
};
use tracing_subscriber::EnvFilter;

/// Model, estimators, whole-body controller and supervisor of the LocoMan robot.
#[derive(Debug, Parser)]
#[command(name = "locoman-robot", version)]
struct Cli {
    /// Folder of robot models and settings.
    #[arg(long, global = true, value_name = "DIR", default_value = "configs")]
    configs: PathBuf,
    /// What to log to stderr: error, warn, info, debug, or a filter such as `info,locoman_robot=debug`.
    #[arg(long, global = true, value_name = "LEVEL", default_value = "info,zenoh=warn")]
    log: String,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the control loop.
    Run(RunArgs),
    /// Check the configuration and the model, and say what is loaded.
    Check,
    /// Find, set up, zero and move the servos of arms and grippers.
    Servo(servo::cli::Args),
}

#[derive(Debug, clap::Args)]
struct RunArgs {
    /// The robot to control.
    #[arg(long, value_enum)]
    plant: PlantKind,
    /// Where the simulated robot answers.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:7100")]
    sim: SocketAddr,
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

#[derive(Debug, Clone, Copy, ValueEnum)]
enum PlantKind {
    /// The simulated robot of `locoman-sim robot`.
    Sim,
}

/// How long an exchange waits for a sample: long against a period, short against what counts as late.
const EXCHANGE_TIMEOUT: Duration = Duration::from_millis(20);

fn main() -> ExitCode {
    let cli = Cli::parse();
    match execute(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            report(&error);
            ExitCode::FAILURE
        }
    }
}

fn execute(cli: &Cli) -> anyhow::Result<()> {
    let filter = EnvFilter::try_new(&cli.log)
        .map_err(|error| anyhow::anyhow!("--log {}: {error}; try `info` or `debug`", cli.log))?;
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    let config = || RobotConfig::load(&cli.configs);
    match &cli.command {
        Command::Run(args) => control(config()?, args),
        Command::Check => check(&config()?),
        Command::Servo(args) => servo::cli::run(args, &cli.configs, &mut servo::cli::Terminal),
    }
}

fn control(config: RobotConfig, args: &RunArgs) -> anyhow::Result<()> {
    let endpoints = Endpoints { listen: args.listen.clone(), connect: args.connect.clone() };
    let stale_ms = config.thresholds.source_stale_ms;
    let (_link, mut inbox, mut outbox) = RobotLink::open(&args.name, &endpoints, stale_ms)
        .context("cannot go on the network; see --listen and --connect")?;
    let (mut plant, stand_by_default): (Box<dyn Plant>, bool) = match args.plant {
        PlantKind::Sim => {
            let plant = SimPlant::open(args.sim, EXCHANGE_TIMEOUT)
                .with_context(|| format!("cannot reach the simulated robot at {}; see --sim", args.sim))?;
            (Box::new(plant), true)
        }
    };
    let options = Options { auto_stand: args.auto_stand.unwrap_or(stand_by_default) };
    let mut controller = Controller::new(config, options);
    let interrupts = count_interrupts()?;
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
    tracing::info!(listen = ?args.listen, sim = %args.sim, "control loop runs; Ctrl-C lies down and ends");
    run(plant.as_mut(), &mut controller, &mut inbox, &mut outbox, || {
        match interrupts.load(Ordering::Relaxed) {
            0 => Wish::Run,
            1 => Wish::Settle,
            _ => Wish::End,
        }
    })?;
    Ok(())
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

fn check(config: &RobotConfig) -> anyhow::Result<()> {
    let model = &config.model;
    tracing::info!("model: {} joints, {:.3} kg", model.joints.len(), model.mass());
    let granted =
        |granted: bool| if granted { "granted" } else { "refused, see `ulimit -r` and `ulimit -l`" };
    tracing::info!("real-time priority: {}", granted(realtime::run_before_others()));
    tracing::info!("memory locked: {}", granted(realtime::lock_memory()));
    tracing::info!("configuration: wbc.toml, control.toml, limits.toml, supervisor.toml are in order");
    Ok(())
}

#[expect(clippy::print_stderr, reason = "the one report at the edge of the program")]
fn report(error: &anyhow::Error) {
    eprintln!("error: {error:#}");
}
