//! `vision`: poses that the tracker finds in rendered images, against the truth of the renderer.
//!
//! ```text
//! scene, rig ─► Stage ─► Film ─► Shot ─► Tracker ─► Tally ─► figures beside what is asked and what others reach
//!                        moment by moment   └──────── truth at the pose's own time
//! ```
//!
//! Each [`Part`] is an experiment of its own; all of them but [`Part::Count`] are run if none is named. A pose counts if the tracker calls it
//! measured (`Tracked`). Everything is synthetic: calibration is perfect unless a part disturbs it.

mod bound;
mod corners;
mod count;
mod covariance;
mod disturbance;
mod error;
mod fast;
mod film;
mod hand;
mod harm;
mod ledger;
mod plot;
mod stage;
mod standard;
mod still;
mod tags;
mod tally;

use std::path::{Path, PathBuf};

use anyhow::Context;

use super::Report;
use harm::{HARMS, Trial};
use ledger::Ledger;
use stage::Stage;
use tally::Tally;

/// Arguments of `eval vision`: without any, all parts but `count`, as they are published.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct Args {
    /// Which parts; all but `count` if none is named.
    #[arg(long = "part", value_enum, value_name = "PART")]
    pub parts: Vec<Part>,
    /// Length of each film, seconds, in place of the part's own.
    #[arg(long, value_name = "S")]
    pub seconds: Option<f64>,
    /// Of the disturbances, only those whose names hold this.
    #[arg(long, value_name = "NAME", default_value = "")]
    pub only: String,
}

/// One experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Part {
    /// The demo's operator, cameras exposed together.
    Standard,
    /// At rest: accuracy, and jitter beside the least that is possible.
    Static,
    /// 1 m/s and 360 deg/s before rolling shutters out of step.
    Fast,
    /// Whether errors are as large as the tracker says.
    Covariance,
    /// 40 ms ahead of hands that reach, pause and tremble.
    Prediction,
    /// Corners of single tags, beside the library's.
    Corners,
    /// Tags hidden, misread, exchanged.
    Outliers,
    /// Covered lenses, strangers, torn tags, posters, wrong light, a bumped camera, bad frames.
    Disturbances,
    /// Wrong poses, over as many scenes as `--seconds` lasts.
    Count,
}

impl Part {
    const PUBLISHED: [Self; 8] = [
        Self::Standard,
        Self::Static,
        Self::Fast,
        Self::Covariance,
        Self::Prediction,
        Self::Corners,
        Self::Outliers,
        Self::Disturbances,
    ];
}

/// Runs the parts; draws errors over time beside `plot`, one file for each film.
pub fn run(configs: &Path, args: &Args, seed: u64, plot: Option<&Path>) -> anyhow::Result<Report> {
    let parts = if args.parts.is_empty() { &Part::PUBLISHED[..] } else { &args.parts };
    let wants = |part: Part| parts.contains(&part);
    let seconds = |own: f64| args.seconds.unwrap_or(own);
    let mut report = Report::new("vision", seed);
    let mut ledger = Ledger::default();
    let mut enter = |film: &str, tally: &Tally| -> anyhow::Result<()> {
        ledger.add(tally);
        plot.map_or(Ok(()), |plot| draw(plot, film, tally))
    };
    if wants(Part::Standard) {
        let stage = Stage::new(configs, "two_zed_pairs", "operator", seed)?;
        enter("standard", &standard::run(&stage, &mut report)?)?;
    }
    if wants(Part::Static) {
        let stage = Stage::new(configs, "two_zed_pairs", "static", seed)?;
        enter("static", &still::run(&stage, seed, seconds(still::SECONDS), &mut report)?)?;
    }
    let mut films = Vec::new();
    if wants(Part::Fast) || wants(Part::Covariance) {
        let stage = Stage::new(configs, "two_zed_pairs_1080p", "fast", seed)?;
        let outcome = fast::run(&stage, seconds(fast::SECONDS))?;
        enter("fast", &outcome.with_rows)?;
        if let Some(plot) = plot {
            // Not entered: a tracker that is told wrong things of its cameras may be wrong.
            draw(plot, "fast_without_row_times", &outcome.without_rows)?;
        }
        if wants(Part::Fast) {
            fast::report(&outcome, &mut report);
        }
        films.push(("fast", outcome.with_rows));
    }
    if wants(Part::Prediction) || wants(Part::Covariance) || wants(Part::Outliers) {
        let stage = Stage::new(configs, "two_zed_pairs_rolling_720p", "hand", seed)?;
        let harms = if wants(Part::Outliers) { &HARMS[..] } else { &[] };
        let mut trials =
            harms.iter().map(|harm| Trial::new(&stage, *harm, seed)).collect::<anyhow::Result<Vec<_>>>()?;
        let outcome = hand::run(&stage, seconds(hand::SECONDS), &mut trials)?;
        enter("hand", &outcome.now)?;
        for trial in &trials {
            trial.report(&mut report);
            enter(trial.name(), trial.tally())?;
        }
        if wants(Part::Prediction) {
            hand::report(&outcome, &mut report);
        }
        films.push(("hand", outcome.now));
    }
    if wants(Part::Covariance) {
        let films: Vec<(&str, &Tally)> = films.iter().map(|(name, tally)| (*name, tally)).collect();
        covariance::report(&films, &mut report);
    }
    if wants(Part::Corners) {
        corners::run(seed, &mut report)?;
    }
    if wants(Part::Disturbances) {
        let stage = Stage::new(configs, "two_zed_pairs_rolling_720p", "hand", seed)?;
        disturbance::run(&stage, &args.only, seed, &mut report, &mut enter)?;
    }
    if wants(Part::Count) {
        let stage = Stage::new(configs, "two_zed_pairs_rolling_720p", "hand", seed)?;
        count::run(&stage, seed, seconds(count::SECONDS), &mut enter)?;
    }
    ledger.report(&mut report);
    Ok(report)
}

/// Errors of one film over time, beside the report: `vision-fast.svg` for `vision.svg`.
fn draw(plot: &Path, film: &str, tally: &Tally) -> anyhow::Result<()> {
    let stem = plot.file_stem().unwrap_or_default().to_string_lossy();
    let path: PathBuf = plot.with_file_name(format!("{stem}-{film}.svg"));
    plot::draw(&path, tally).with_context(|| format!("cannot draw {}", path.display()))?;
    tracing::info!("errors over time: {}", path.display());
    Ok(())
}
