//! `locoman-calib`: calibration of cameras, rigs and shells.

mod command;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use command::Command;
use tracing_subscriber::EnvFilter;

/// Calibration of cameras, rigs and shells.
#[derive(Debug, Parser)]
#[command(name = "locoman-calib", version)]
struct Cli {
    /// Folder of rigs and shells.
    #[arg(long, global = true, value_name = "DIR", default_value = "configs")]
    configs: PathBuf,
    /// What to log to stderr: error, warn, info, debug, or a filter.
    #[arg(long, global = true, value_name = "LEVEL", default_value = "info")]
    log: String,
    #[command(subcommand)]
    command: Command,
}

fn main() -> ExitCode {
    match run(&Cli::parse()) {
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
    command::run(&cli.command, &cli.configs)
}

#[expect(clippy::print_stderr, reason = "the one report at the edge of the program")]
fn report(error: &anyhow::Error) {
    eprintln!("error: {error:#}");
}
