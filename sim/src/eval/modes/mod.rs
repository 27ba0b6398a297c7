//! `modes`: from every mode to every other, both sides, and with changed minds.
//!
//! On each robot one tour in which every ordered pair of modes comes once; then as many requests at random instants, most of
//! them before the last one was carried out. By the simulator's truth, with all imperfections on.

mod tour;

use std::path::Path;

use rayon::prelude::*;

use super::statistics::{mean, percentile};
use super::{Figure, Must, Report};
use tour::Outcome;

/// Arguments of `eval modes`: without any, the published experiment.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Robots, each with its own imperfections.
    #[arg(long, default_value_t = 10)]
    pub robots: u64,
    /// Requests at random instants on each robot.
    #[arg(long, default_value_t = 60)]
    pub interruptions: u64,
    /// Profile of imperfections.
    #[arg(long, default_value = "hw")]
    pub profile: String,
}

/// Runs the experiment on all cores.
pub fn run(configs: &Path, args: &Args, seed: u64) -> anyhow::Result<Report> {
    let outcomes: Vec<Outcome> = (seed..seed + args.robots)
        .into_par_iter()
        .map(|seed| tour::travel(configs, &args.profile, args.interruptions, seed))
        .collect::<anyhow::Result<_>>()?;
    for (seed, broken) in (seed..).zip(&outcomes).filter_map(|(seed, o)| Some((seed, o.findings.broken()?))) {
        tracing::warn!("seed {seed}: {broken}");
    }
    let mut report = Report::new("modes", seed);
    let total = |of: fn(&Outcome) -> u64| outcomes.iter().map(of).sum::<u64>() as f64;
    report.push(Figure::new("pairs.tried", total(|o| o.tried), ""));
    report.push(Figure::new("pairs.failed", total(|o| o.failed), "").must(Must::AtMost(0.0)));
    report.push(Figure::new("interruptions", total(|o| o.interruptions), ""));
    report.push(Figure::new("falls", total(|o| o.findings.falls), "").must(Must::AtMost(0.0)));
    let worst = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).fold(0.0, f64::max);
    report.push(
        Figure::new("position_over", worst(|o| o.findings.position_over_rad.value), "rad")
            .must(Must::AtMost(0.0)),
    );
    for (name, value) in [
        ("speed", worst(|o| o.findings.speed_share.value)),
        ("torque", worst(|o| o.findings.torque_share.value)),
    ] {
        report.push(Figure::new(name, 100.0 * value, "%").must(Must::AtMost(100.0)));
    }
    report.push(Figure::new("touches_itself", total(|o| o.findings.self_contacts), "ticks"));
    for (from, to) in tour::pairs() {
        let times: Vec<f64> = outcomes
            .iter()
            .flat_map(|outcome| &outcome.times_s)
            .filter(|(pair, _)| *pair == (from, to))
            .map(|(_, time)| *time)
            .collect();
        if !times.is_empty() {
            let name = format!("{}_to_{}", tour::name(from), tour::name(to));
            report.push(Figure::new(format!("{name}.mean"), mean(&times), "s"));
            report.push(Figure::new(format!("{name}.longest"), percentile(&times, 1.0), "s"));
        }
    }
    Ok(report)
}
