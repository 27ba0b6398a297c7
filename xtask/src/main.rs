//! `cargo xtask …`: everything that a person runs in this repository.
//!
//! Depends on nothing heavy, because it is what installs the heavy things.

mod demo;
mod processes;
mod setup;
mod shell;
mod test;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// Set-up, demo, tests and evaluations of LocoMan Teleop.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Install what is missing: Debian packages and the MuJoCo library.
    Setup,
    /// A recorded operator drives the simulated robot; watch it in the browser, then take over.
    Demo(demo::Args),
    /// What CI runs: formatting, clippy, all tests, doc tests, a headless demo.
    Test(test::Args),
    /// Run one reproducible experiment and print its figures beside the paper's or a peer's.
    Eval(EvalArgs),
    /// Time the control step, the reading of tags and the solve, each with its parts or beside its peers.
    Bench,
}

#[derive(clap::Args)]
struct EvalArgs {
    /// Which one: `vision`, `latency`, `tracking`, `workspace`, `robustness`, `loop`, `wire`, `faults`; `demo` judges the recording of
    /// the last headless demo.
    name: String,
    /// Another seed than the published one.
    #[arg(long)]
    seed: Option<u64>,
    /// What else the experiment takes, after `--`: see `locoman-sim eval NAME --help`.
    #[arg(last = true, value_name = "ARGS")]
    more: Vec<String>,
}

fn main() -> ExitCode {
    match run(Cli::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            shell::say(&format!("error: {error:#}"));
            ExitCode::FAILURE
        }
    }
}

fn run(command: Command) -> Result<()> {
    std::env::set_current_dir(root())?;
    match command {
        Command::Setup => setup::ensure(setup::Purpose::Test),
        Command::Demo(args) => demo::run(&args),
        Command::Test(args) => test::run(&args),
        Command::Eval(args) => eval(&args),
        Command::Bench => {
            setup::ensure(setup::Purpose::Run)?;
            // The one profile of this workspace: see the root Cargo.toml.
            let benches = ["--bench", "wbc", "--bench", "read", "--bench", "solve"];
            shell::cargo(&[&["bench", "--profile", "dev", "--workspace"], benches.as_slice()].concat())
        }
    }
}

fn eval(args: &EvalArgs) -> Result<()> {
    setup::ensure(setup::Purpose::Run)?;
    shell::cargo(&["build", "--workspace", "--bins"])?;
    let folder = shell::target_dir().join("eval");
    std::fs::create_dir_all(&folder)?;
    let json = folder.join(format!("{}.json", args.name));
    let mut command = shell::program("locoman-sim");
    command.arg("eval").arg(&args.name).arg("--json").arg(&json);
    if let Some(seed) = args.seed {
        command.arg("--seed").arg(seed.to_string());
    }
    if args.name == "demo" {
        command.arg("--recording").arg(demo::session_recording());
    }
    command.args(&args.more);
    shell::run(&mut command)
}

/// The repository that this program was built from: `cargo xtask` works from any folder of it.
fn root() -> PathBuf {
    PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| ".".into())).join("..")
}
