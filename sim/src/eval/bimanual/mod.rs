//! `bimanual`: sits up on its shanks, works with both grippers, is pushed, reaches up, and comes down again. By the
//! simulator's truth, with all imperfections on, each robot on a floor of its own.

mod film;
mod trial;

use std::path::Path;

use anyhow::Context;
use rayon::prelude::*;

use super::statistics::{mean, percentile};
use super::{Figure, Must, Report};
use trial::Outcome;

/// Arguments of `eval bimanual`: without any, the published experiment.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Robots, each with its own imperfections, on floors with frictions from 0.5 to 1.
    #[arg(long, default_value_t = 50)]
    pub robots: u64,
    /// Profile of imperfections.
    #[arg(long, default_value = "hw")]
    pub profile: String,
}

/// Runs the experiment on all cores; draws the first robot on its way to `plot`.
pub fn run(configs: &Path, args: &Args, seed: u64, plot: Option<&Path>) -> anyhow::Result<Report> {
    let outcomes: Vec<Outcome> = (seed..seed + args.robots)
        .into_par_iter()
        .map(|seed| trial::play(configs, &args.profile, seed))
        .collect::<anyhow::Result<_>>()?;
    if let (Some(path), Some(first)) = (plot, outcomes.first()) {
        film::draw(path, &first.film).with_context(|| format!("cannot draw {}", path.display()))?;
        tracing::info!("the first robot on its way: {}", path.display());
    }
    let mut report = Report::new("bimanual", seed);
    let all = args.robots as f64;
    let count = |of: fn(&Outcome) -> bool| outcomes.iter().filter(|outcome| of(outcome)).count() as f64;
    report.push(Figure::new("robots", all, ""));
    report.push(Figure::new("sat_up", count(|o| o.up_s.is_some()), "").must(Must::AtLeast(all)));
    report.push(Figure::new("came_down", count(|o| o.down_s.is_some()), "").must(Must::AtLeast(all)));
    report
        .push(Figure::new("survived_30_newtons", count(|o| o.survived_pushes), "").must(Must::AtLeast(all)));
    let times = |of: fn(&Outcome) -> Option<f64>| outcomes.iter().filter_map(of).collect::<Vec<_>>();
    for (name, times, theirs) in
        [("sits_up", times(|o| o.up_s), 4.4), ("comes_down", times(|o| o.down_s), 3.3)]
    {
        let figure = Figure::new(format!("{name}.mean"), mean(&times), "s");
        report.push(figure.reference(theirs, "authors' code, a recorded motion"));
        report.push(Figure::new(format!("{name}.longest"), percentile(&times, 1.0), "s"));
    }
    let worst = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).fold(0.0, f64::max);
    let average = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).sum::<f64>() / all;
    report.push(Figure::new("gripper", average(|o| o.position_mm), "mm").must(Must::AtMost(2.0)));
    report.push(Figure::new("gripper.greatest", worst(|o| o.greatest_mm), "mm"));
    report.push(Figure::new("gripper.angle", average(|o| o.rotation_rad), "rad").must(Must::AtMost(0.02)));
    report.push(Figure::new("gripper.angle_greatest", worst(|o| o.greatest_rad), "rad"));
    let least = outcomes.iter().map(|outcome| outcome.height_m).fold(f64::INFINITY, f64::min);
    report.push(Figure::new("reach", least, "m").must(Must::AtLeast(1.0)).reference(1.0, "paper, socks"));
    report.push(Figure::new("reach.mean", average(|o| o.height_m), "m"));
    report.push(
        Figure::new("torque_step", 100.0 * worst(|o| o.torque_step), "% of the limit")
            .must(Must::AtMost(30.0)),
    );
    report.push(Figure::new("torque_step_pushed", 100.0 * worst(|o| o.pushed_step), "% of the limit"));
    report.push(Figure::new("torque", 100.0 * worst(|o| o.torque), "% of the limit"));
    Ok(report)
}
