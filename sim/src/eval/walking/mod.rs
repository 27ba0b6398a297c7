//! `walking`: does it go as fast as it is told, level, and does it stay on its feet?
//!
//! At a steady [pace](steady), [pushed](push), on [rough](rough) ground, and under [random](wander) commands. By the
//! simulator's truth, with all imperfections on.

mod push;
mod rough;
mod start;
mod steady;
mod wander;

use std::path::Path;

pub(super) use start::{ready, tilt, velocity};

use rayon::prelude::*;

use super::{Figure, Must, Report};
use steady::{Outcome, Pace};

/// Arguments of `eval walking`: without any, the published experiment.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct Args {
    /// Only these parts.
    #[arg(long, value_enum)]
    pub part: Vec<Part>,
    /// Robots, each with its own imperfections, on which each thing is tried; those of random commands and of rough
    /// ground are 20.
    #[arg(long, default_value_t = 4)]
    pub robots: u64,
    /// Forces of the pushes, N.
    #[arg(long, default_values_t = push::FORCES_N)]
    pub push_n: Vec<f64>,
    /// Pushes with each force: eight directions, at ten phases of the gait.
    #[arg(long, default_value_t = push::TRIALS)]
    pub pushes: usize,
    /// Minutes of random commands for each robot.
    #[arg(long, default_value_t = 10.0)]
    pub minutes: f64,
    /// Profile of imperfections.
    #[arg(long, default_value = "hw")]
    pub profile: String,
}

/// A part of the experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Part {
    /// Steady paces and heights.
    Pace,
    /// Pushes on the trunk.
    Push,
    /// Steps, a slope, a slippery floor.
    Rough,
    /// Random commands for minutes.
    Random,
}

impl Part {
    const ALL: [Self; 4] = [Self::Pace, Self::Push, Self::Rough, Self::Random];
}

/// Robots on rough ground and under random commands.
const MANY: u64 = 20;

/// Runs the experiment on all cores.
pub fn run(configs: &Path, args: &Args, seed: u64) -> anyhow::Result<Report> {
    let mut report = Report::new("walking", seed);
    let parts = if args.part.is_empty() { &Part::ALL } else { args.part.as_slice() };
    for part in parts {
        match part {
            Part::Pace => pace(configs, args, seed, &mut report)?,
            Part::Push => pushes(configs, args, seed, &mut report)?,
            Part::Rough => rough_ground(configs, args, seed, &mut report)?,
            Part::Random => random(configs, args, seed, &mut report)?,
        }
    }
    Ok(report)
}

fn pace(configs: &Path, args: &Args, seed: u64, report: &mut Report) -> anyhow::Result<()> {
    for pace in Pace::all() {
        let outcomes: Vec<Outcome> = (seed..seed + args.robots)
            .into_par_iter()
            .map(|seed| steady::walk(configs, &args.profile, &pace, seed))
            .collect::<anyhow::Result<_>>()?;
        let name = pace.name();
        let worst = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).fold(0.0, f64::max);
        let mean = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).sum::<f64>() / outcomes.len() as f64;
        let fallen = outcomes.iter().filter(|outcome| outcome.fallen).count();
        let mut push = |what: &str, value: f64, unit: &'static str, must: Option<f64>| {
            let figure = Figure::new(format!("{name}.{what}"), value, unit);
            report.push(match must {
                Some(most) => figure.must(Must::AtMost(most)),
                None => figure,
            });
        };
        push("falls", fallen as f64, "", Some(0.0));
        if pace.is_moving() {
            push("speed", mean(|o| o.speed), pace.unit(), None);
            push("speed_error", 100.0 * worst(|o| o.speed_error), "%", pace.must().then_some(3.0));
        }
        push("tilt", worst(|o| o.tilt_rad), "rad", pace.must().then_some(0.02));
        push("tilt_greatest", worst(|o| o.greatest_tilt_rad), "rad", None);
        push("height_error", 1e3 * worst(|o| o.height_error_m), "mm", None);
        push("velocity_estimate_rms", worst(|o| o.velocity_error), "m/s", None);
        if pace.is_moving() && !pace.is_turning() {
            push("drift", 100.0 * worst(|o| o.drift), "%", None);
        }
    }
    Ok(())
}

fn pushes(configs: &Path, args: &Args, seed: u64, report: &mut Report) -> anyhow::Result<()> {
    for &force_n in &args.push_n {
        let survived: Vec<(usize, bool)> = (0..args.pushes)
            .into_par_iter()
            .map(|trial| push::survives(configs, &args.profile, force_n, trial, seed))
            .collect::<anyhow::Result<_>>()?;
        let share = |of: &dyn Fn(usize) -> bool| {
            let tried: Vec<_> = survived.iter().filter(|(direction, _)| of(*direction)).collect();
            100.0 * tried.iter().filter(|(_, survived)| *survived).count() as f64 / tried.len() as f64
        };
        for (name, value) in [
            ("survived", share(&|_| true)),
            ("survived_sideways", share(&|direction| push::SIDEWAYS.contains(&direction))),
        ] {
            let figure = Figure::new(format!("push_{force_n:.0}n.{name}"), value, "%");
            report.push(if force_n == push::MUST_N { figure.must(Must::AtLeast(95.0)) } else { figure });
        }
    }
    Ok(())
}

fn rough_ground(configs: &Path, args: &Args, seed: u64, report: &mut Report) -> anyhow::Result<()> {
    for (name, ground) in rough::grounds() {
        let crossed: Vec<bool> = (seed..seed + MANY)
            .into_par_iter()
            .map(|seed| rough::crosses(configs, &args.profile, ground, seed))
            .collect::<anyhow::Result<_>>()?;
        let count = crossed.iter().filter(|crossed| **crossed).count();
        report.push(
            Figure::new(format!("{name}.crossed_of_{MANY}"), count as f64, "").must(Must::AtLeast(18.0)),
        );
    }
    Ok(())
}

fn random(configs: &Path, args: &Args, seed: u64, report: &mut Report) -> anyhow::Result<()> {
    let fallen_at: Vec<Option<f64>> = (seed..seed + MANY)
        .into_par_iter()
        .map(|seed| wander::falls_at(configs, &args.profile, 60.0 * args.minutes, seed))
        .collect::<anyhow::Result<_>>()?;
    let falls = fallen_at.iter().flatten().count();
    report.push(Figure::new("random.robots", MANY as f64, ""));
    report.push(Figure::new("random.minutes", args.minutes, "min"));
    report.push(Figure::new("random.falls", falls as f64, "").must(Must::AtMost(0.0)));
    Ok(())
}
