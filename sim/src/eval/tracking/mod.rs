//! `tracking`: the paper's five tasks and its square, against the robot's own estimator and against the truth.
//!
//! Each task is played for every seed in two profiles: `hw`, with all of the simulator's imperfections, and
//! `ideal`, without. Four intermediate poses in 8 s, 3200 targets at 400 Hz; the poses are uniform on each axis
//! within ±50 mm and ±0.25 rad (gripper), ±50 mm (foot), ±15 mm and ±0.08 rad (torso), ±40 mm and ±0.2 rad (torso on four feet):
//! the paper does not give its own, these are those with which its authors' controller was measured in MuJoCo.
//! Odd seeds use the right limb, even seeds the left.

mod measure;
mod plot;
mod table;
mod task;

use std::path::Path;

use anyhow::Context;
use locoman_protocol::trajectory::TrajectoryFile;
use locoman_robot::trajectory::Trajectory;
use rayon::prelude::*;

use super::Report;
use measure::Run;
pub use task::Task;

/// Arguments of `eval tracking`: without any, the published experiment.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Only these tasks.
    #[arg(long = "task", value_enum)]
    pub tasks: Vec<Task>,
    /// Seeds of poses and noise, from `--seed` on.
    #[arg(long, default_value_t = 10)]
    pub seeds: u64,
    /// Only these profiles of imperfections.
    #[arg(long = "profile", value_parser = ["hw", "ideal"])]
    pub profiles: Vec<String>,
}

/// Runs the experiment on all cores; draws errors and paths to `plot`.
pub fn run(configs: &Path, args: &Args, seed: u64, plot: Option<&Path>) -> anyhow::Result<Report> {
    let tasks = if args.tasks.is_empty() { Task::ALL.to_vec() } else { args.tasks.clone() };
    let profiles: Vec<&str> = match args.profiles.as_slice() {
        [] => vec!["hw", "ideal"],
        some => some.iter().map(String::as_str).collect(),
    };
    let square = square(configs)?;
    let mut plays = Vec::new();
    for profile in profiles {
        for &task in &tasks {
            plays.extend((seed..seed + args.seeds.max(1)).map(|seed| (profile, task, seed)));
        }
    }
    let play = |&(profile, task, seed): &(&str, Task, u64)| {
        let trajectory = task.trajectory(seed, &square);
        measure::measure(configs, task, profile, seed, &trajectory)
            .with_context(|| format!("{}, profile {profile}, seed {seed}", task.name()))
    };
    let runs: Vec<Run> = plays.par_iter().map(play).collect::<anyhow::Result<_>>()?;
    if let Some(path) = plot {
        plot::draw(path, &runs).with_context(|| format!("cannot draw {}", path.display()))?;
        tracing::info!("errors over time and the square: {}", path.display());
    }
    Ok(table::report(&runs, seed))
}

/// The square as it is shipped.
fn square(configs: &Path) -> anyhow::Result<Trajectory> {
    let path = configs.join("trajectories/square.toml");
    let file = TrajectoryFile::read(&path)?;
    Trajectory::from_message(&file.trajectory).with_context(|| format!("{}: no trajectory", path.display()))
}
