//! `robustness`: targets that cannot be reached, and what nobody planned. Does it fall, break a limit, shake?
//!
//! 1,000 random trajectories of four gripper poses each, in turn of four [kinds](targets::Kind), while the torso
//! moves; between two of them the gripper comes back to its start. Then [disturbances](trial::Case), each on
//! several robots whose imperfections differ. Everything by the simulator's truth, with all imperfections on.

pub(super) mod monitor;
mod plot;
mod table;
mod targets;
mod trial;
mod wander;

use std::path::Path;

use anyhow::Context;
use rayon::prelude::*;

use super::Report;
use trial::Case;

/// Trajectories on one robot, before another with other imperfections takes its place.
const ON_ONE_ROBOT: u64 = 20;

/// Arguments of `eval robustness`: without any, the published experiment.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Random trajectories.
    #[arg(long, default_value_t = 1000)]
    pub trajectories: u64,
    /// Robots on which each disturbance is tried; 0 for none.
    #[arg(long, default_value_t = 4)]
    pub robots: u64,
    /// Profile of imperfections.
    #[arg(long, default_value = "hw")]
    pub profile: String,
}

/// Runs the experiment on all cores; draws what happened to `plot`.
pub fn run(configs: &Path, args: &Args, seed: u64, plot: Option<&Path>) -> anyhow::Result<Report> {
    let robots = args.trajectories.div_ceil(ON_ONE_ROBOT);
    let sessions: Vec<Vec<u64>> = (0..robots)
        .map(|robot| {
            // One side a robot: seeds of one parity.
            let first = seed + 2 * ON_ONE_ROBOT * (robot / 2) + robot % 2;
            let count = ON_ONE_ROBOT.min(args.trajectories - robot * ON_ONE_ROBOT);
            (0..count).map(|place| first + 2 * place).collect()
        })
        .collect();
    let wander = |seeds: &Vec<u64>| {
        wander::wander(configs, &args.profile, seeds)
            .with_context(|| format!("trajectories of the seeds from {}", seeds.first().unwrap_or(&0)))
    };
    let outcomes: Vec<Vec<wander::Outcome>> =
        sessions.par_iter().map(wander).collect::<anyhow::Result<_>>()?;
    let outcomes = outcomes.concat();

    let trials: Vec<(Case, u64)> =
        Case::ALL.into_iter().flat_map(|case| (0..args.robots).map(move |n| (case, seed + n))).collect();
    let try_out = |&(case, seed): &(Case, u64)| {
        let outcome = trial::run(configs, &args.profile, case, seed)
            .with_context(|| format!("{}, seed {seed}", case.name()))?;
        Ok((case, outcome))
    };
    let trials: Vec<(Case, trial::Outcome)> =
        trials.par_iter().map(try_out).collect::<anyhow::Result<_>>()?;
    if let Some(path) = plot {
        plot::draw(path, &outcomes, &trials).with_context(|| format!("cannot draw {}", path.display()))?;
        tracing::info!("errors and disturbances: {}", path.display());
    }
    Ok(table::report(&outcomes, &trials, seed))
}
