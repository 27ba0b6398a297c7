//! `walking`: does it go as fast as it is told, level, and does it stay on its feet?

mod steady;

use std::path::Path;

use rayon::prelude::*;

use super::{Figure, Must, Report};
use steady::{Outcome, Pace};

/// Arguments of `eval walking`: without any, the published experiment.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Robots, each with its own imperfections, on which each thing is tried.
    #[arg(long, default_value_t = 4)]
    pub robots: u64,
    /// Profile of imperfections.
    #[arg(long, default_value = "hw")]
    pub profile: String,
}

/// Runs the experiment on all cores.
pub fn run(configs: &Path, args: &Args, seed: u64) -> anyhow::Result<Report> {
    let mut report = Report::new("walking", seed);
    for pace in Pace::all() {
        let outcomes: Vec<Outcome> = (seed..seed + args.robots)
            .into_par_iter()
            .map(|seed| steady::walk(configs, &args.profile, &pace, seed))
            .collect::<anyhow::Result<_>>()?;
        let name = pace.name();
        let worst = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).fold(0.0, f64::max);
        let fallen = outcomes.iter().filter(|outcome| outcome.fallen).count();
        report.push(Figure::new(format!("{name}.falls"), fallen as f64, "").must(Must::AtMost(0.0)));
        report.push(Figure::new(format!("{name}.speed"), outcomes[0].speed, ""));
        report.push(Figure::new(format!("{name}.speed_error"), worst(|o| o.speed_error), "").must(Must::AtMost(0.03)));
        report.push(Figure::new(format!("{name}.tilt"), worst(|o| o.tilt_rad), "rad").must(Must::AtMost(0.02)));
        report.push(Figure::new(format!("{name}.tilt_max"), worst(|o| o.greatest_tilt_rad), "rad"));
        report.push(Figure::new(format!("{name}.height"), outcomes[0].height_m, "m"));
        report.push(Figure::new(format!("{name}.velocity_rms"), worst(|o| o.velocity_error), "m/s"));
        report.push(Figure::new(format!("{name}.drift"), worst(|o| o.drift), "m/m"));
    }
    Ok(report)
}
