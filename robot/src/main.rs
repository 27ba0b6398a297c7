//! `locoman-robot`: the controller on the robot's computer, or against the simulated robot.

mod run;

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

use clap::{Parser, Subcommand};
use locoman_protocol::realtime;
use locoman_robot::{control::RobotConfig, go1::Go1Settings, servo};
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
    Run(run::Args),
    /// Check the configuration and the model, and say what is loaded.
    Check,
    /// Find, set up, zero and move the servos of arms and grippers.
    Servo(servo::cli::Args),
    /// Own the line to a Go1 for a controller, and damp its motors when that ends. Started by `run`.
    #[command(hide = true)]
    Wire(run::WireArgs),
}

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
    match &cli.command {
        Command::Run(args) => run::run(cli, args),
        Command::Check => check(&cli.configs),
        Command::Servo(args) => servo::cli::run(args, &cli.configs, &mut servo::cli::Terminal),
        Command::Wire(args) => run::wire(cli, args),
    }
}

fn check(configs: &Path) -> anyhow::Result<()> {
    let config = RobotConfig::load(configs)?;
    let go1 = Go1Settings::load(configs)?;
    let model = &config.model;
    tracing::info!("model: {} joints, {:.3} kg", model.joints.len(), model.mass());
    let granted =
        |granted: bool| if granted { "granted" } else { "refused, see `ulimit -r` and `ulimit -l`" };
    tracing::info!("real-time priority: {}", granted(realtime::run_before_others()));
    tracing::info!("memory locked: {}", granted(realtime::lock_memory()));
    tracing::info!("Go1: commands go to {} from {}", go1.board, go1.local);
    tracing::info!(
        "configuration: wbc.toml, control.toml, limits.toml, supervisor.toml, go1.toml are in order"
    );
    Ok(())
}

#[expect(clippy::print_stderr, reason = "the one report at the edge of the program")]
fn report(error: &anyhow::Error) {
    eprintln!("error: {error:#}");
}
