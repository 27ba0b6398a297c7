//! `locoman-calib`: calibration of cameras, rigs and shells.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use locoman_calib::check;
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
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

#[derive(Debug, Subcommand)]
enum Command {
    /// Check a rig file and a shells file, and say what is in them.
    Check {
        /// The rig file; by default `rigs/two_zed_pairs.toml` of the configs folder.
        #[arg(long, value_name = "FILE")]
        rig: Option<PathBuf>,
        /// The shells file; by default `shells/standard.toml` of the configs folder.
        #[arg(long, value_name = "FILE")]
        shells: Option<PathBuf>,
    },
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
    let Command::Check { rig, shells } = &cli.command;
    let or_default =
        |path: &Option<PathBuf>, default: &str| path.clone().unwrap_or_else(|| cli.configs.join(default));
    check_files(&or_default(rig, "rigs/two_zed_pairs.toml"), &or_default(shells, "shells/standard.toml"))
}

fn check_files(rig: &Path, shells: &Path) -> anyhow::Result<()> {
    let (cameras, worn) = (Rig::load(rig)?, ShellSet::load(shells)?);
    println!("{}\n{}", rig.display(), check::describe_rig(&cameras));
    println!("{}\n{}", shells.display(), check::describe_shells(&worn));
    Ok(())
}

#[expect(clippy::print_stderr, reason = "the one report at the edge of the program")]
fn report(error: &anyhow::Error) {
    eprintln!("error: {error:#}");
}
