//! `loco-manipulation`: how well a gripper keeps to an orientation in the world, as a person points a flashlight, while the
//! robot trots. Beside it plain locomotion, whose arm is held by its joints.

mod plot;
mod pointing;

use std::path::Path;

use anyhow::Context;
use locoman_robot::joints::Side;
use locoman_robot::modes::Arms;
use rayon::prelude::*;

use super::{Figure, Must, Report};
use pointing::{Outcome, Task};

/// Arguments of `eval loco-manipulation`: without any, the published experiment.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct Args {
    /// Robots, each with its own imperfections.
    #[arg(long, default_value_t = 4)]
    pub robots: u64,
    /// Profile of imperfections.
    #[arg(long, default_value = "hw")]
    pub profile: String,
}

/// What is tried, by its name in figures.
const TASKS: [(&str, Task); 4] = [
    ("right", Task::Held(Arms::One(Side::Right))),
    ("left", Task::Held(Arms::One(Side::Left))),
    ("both", Task::Held(Arms::Both)),
    ("vanilla", Task::Vanilla),
];

/// Runs the experiment on all cores; draws errors over time to `plot`.
pub fn run(configs: &Path, args: &Args, seed: u64, plot: Option<&Path>) -> anyhow::Result<Report> {
    let mut report = Report::new("loco-manipulation", seed);
    let mut shown = Vec::new();
    for (name, task) in TASKS {
        let outcomes: Vec<Outcome> = (seed..seed + args.robots)
            .into_par_iter()
            .map(|seed| pointing::point(configs, &args.profile, task, seed))
            .collect::<anyhow::Result<_>>()?;
        let falls = outcomes.iter().filter(|outcome| outcome.fallen).count();
        let mean = outcomes.iter().map(Outcome::mean_rad).sum::<f64>() / outcomes.len() as f64;
        let greatest = outcomes.iter().map(Outcome::greatest_rad).fold(0.0, f64::max);
        let held = task != Task::Vanilla;
        let figure = |what: &str, value: f64, unit| Figure::new(format!("{name}.{what}"), value, unit);
        report.push(figure("falls", falls as f64, "").must(Must::AtMost(0.0)));
        let (mean, greatest) = (figure("mean", mean, "rad"), figure("greatest", greatest, "rad"));
        if held {
            let theirs = "authors' code in MuJoCo";
            report.push(mean.must(Must::AtMost(0.008)).reference(0.019, theirs));
            report.push(greatest.must(Must::AtMost(0.02)).reference(0.037, theirs));
        } else {
            report.push(mean);
            report.push(greatest);
        }
        let about_vertical = outcomes.iter().map(|outcome| outcome.about_vertical_rad).sum::<f64>();
        report.push(figure("mean_about_vertical", about_vertical / outcomes.len() as f64, "rad"));
        shown.extend(outcomes.into_iter().next().map(|outcome| (name, outcome)));
    }
    if let Some(path) = plot {
        plot::draw(path, &shown).with_context(|| format!("cannot draw {}", path.display()))?;
        tracing::info!("errors over time: {}", path.display());
    }
    Ok(report)
}
