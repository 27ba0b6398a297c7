//! `faults`: what the robot does when its line, its motors, its battery or its own program fail, in real time and over
//! the real robot's datagrams; each reaction within its time.

mod case;
mod kills;

use std::path::Path;

use super::{Figure, Report};

/// Arguments of `eval faults`.
#[derive(Debug, Clone, Copy, PartialEq, clap::Args)]
pub struct Args {
    /// How often the robot's program is killed.
    #[arg(long, default_value_t = 50)]
    pub kills: u32,
}

/// Runs the experiment.
pub fn run(configs: &Path, args: Args, seed: u64) -> anyhow::Result<Report> {
    let mut report = Report::new("faults", seed);
    for case in case::CASES {
        tracing::info!("{}", case.name);
        match case::run(case, configs, seed) {
            Ok(figures) => figures.into_iter().for_each(|figure| report.push(figure)),
            Err(error) => {
                tracing::error!("{}: {error:#}", case.name);
                report.push(Figure::new(format!("{}.failed", case.name), f64::NAN, ""));
            }
        }
    }
    kills::run(configs, args.kills, seed, &mut report)?;
    Ok(report)
}
