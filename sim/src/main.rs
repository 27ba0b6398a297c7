//! `locoman-sim`: the simulated robot, the rendered operator, the evaluations.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use locoman_sim::{eval, operator, robot};
use tracing_subscriber::EnvFilter;

/// The stand-in world of LocoMan Teleop.
#[derive(Debug, Parser)]
#[command(name = "locoman-sim", version)]
struct Cli {
    /// Folder of rigs, shells, scenes and robot models.
    #[arg(long, global = true, value_name = "DIR", default_value = "configs")]
    configs: PathBuf,
    /// What to log to stderr: error, warn, info, debug, or a filter such as `info,locoman_vision=debug`.
    #[arg(long, global = true, value_name = "LEVEL", default_value = "info,zenoh=warn")]
    log: String,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Simulate the robot, and answer commands as the real one does.
    Robot(robot::Args),
    /// Render what calibrated cameras see of an operator in tag shells, with the truth.
    Operator(operator::Args),
    /// Run one reproducible experiment and report its figures.
    Eval(eval::Args),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            report(&error);
            ExitCode::FAILURE
        }
    }
}

fn run(cli: &Cli) -> anyhow::Result<()> {
    let filter = EnvFilter::try_new(&cli.log)
        .map_err(|error| anyhow::anyhow!("--log {}: {error}; try `info` or `debug`", cli.log))?;
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    match &cli.command {
        Command::Robot(args) => robot::run(args, &cli.configs),
        Command::Operator(args) => operator::run(args, &cli.configs),
        Command::Eval(args) => eval::run(args, &cli.configs),
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
