//! The figures of all runs, and the table of the shape for people.

use std::fmt::Write as _;

use locoman_robot::joints::Side;

use super::measure::{BodyErrors, Run, Series};
use super::task::{Bounds, PoseBounds, Task};
use crate::eval::body::Body;
use crate::eval::statistics::mean;
use crate::eval::{Figure, Must, Report};

/// What the issue asks for with the imperfections off, mm.
const IDEAL_MM: f64 = 0.2;

/// All figures, task by task, and the table.
pub fn report(runs: &[Run], seed: u64) -> Report {
    let mut report = Report::new("tracking", seed);
    let mut table = String::new();
    for profile in ["hw", "ideal"] {
        for task in Task::ALL {
            let runs: Vec<&Run> =
                runs.iter().filter(|run| run.task == task && run.profile == profile).collect();
            if runs.is_empty() {
                continue;
            }
            if let Some(bounds) = task.limb_bounds() {
                let errors: Vec<&BodyErrors> = runs.iter().filter_map(|run| run.limb.as_ref()).collect();
                let name = task.limb(Side::Right).map_or("", Body::name);
                body(&mut report, &mut table, (profile, task), name, &errors, &bounds);
            }
            let errors: Vec<&BodyErrors> = runs.iter().map(|run| &run.torso).collect();
            body(&mut report, &mut table, (profile, task), "torso", &errors, &task.torso_bounds());
        }
    }
    let head = format!(
        "{:36} {:>9}  {:>9} {:14} {:>8}  {:>9} {:14} {:>8}  {:>10}\n",
        "mean of Euclidean errors", "paper", "estimator", "must", "max", "truth", "must", "max", "reference"
    );
    report.table = Some(head + &table);
    report
}

/// Figures of one body: position, then rotation.
fn body(
    report: &mut Report,
    table: &mut String,
    (profile, task): (&str, Task),
    name: &str,
    errors: &[&BodyErrors],
    bounds: &PoseBounds,
) {
    type Of = fn(&Series) -> &Vec<f64>;
    let quantities: [(&'static str, Of); 2] =
        [("mm", |series| &series.position), ("rad", |series| &series.rotation)];
    // A foot has no orientation.
    let count = if name == "foot" { 1 } else { 2 };
    for ((unit, of), bounds) in quantities.into_iter().zip(bounds).take(count) {
        let prefix = if profile == "hw" { String::new() } else { format!("{profile}.") };
        let what = format!("{prefix}{}.{name}_{unit}", task.name());
        let bounds = if profile == "hw" { *bounds } else { ideal(unit) };
        let all = |column: fn(&BodyErrors) -> &Series| -> Vec<f64> {
            errors.iter().flat_map(|errors| of(column(errors))).copied().collect()
        };
        let columns = [
            ("estimate", all(|errors| &errors.estimate), bounds.estimate),
            ("truth", all(|errors| &errors.truth), bounds.truth),
        ];
        let _ = write!(table, "{what:36} {:>9}", bounds.paper.map_or(String::new(), |v| format!("{v}")));
        for (column, samples, must) in columns {
            let mut figure = Figure::new(format!("{what}.{column}"), mean(&samples), unit);
            figure.must = must.map(Must::AtMost);
            figure = match (column, bounds.paper, bounds.authors_truth) {
                ("estimate", Some(paper), _) => figure.reference(paper, "paper, by its own estimator"),
                ("truth", _, Some(authors)) => {
                    figure.reference(authors, "authors' controller in MuJoCo, better of 2 seeds")
                }
                _ => figure,
            };
            let worst = samples.iter().copied().fold(0.0, f64::max);
            let verdict = figure.must.map_or(String::new(), |must| {
                format!("{must}{}", if must.is_met_by(figure.value) { "" } else { " MISSED" })
            });
            let _ = write!(table, "  {:>9} {verdict:14} {:>8}", short(figure.value), short(worst));
            report.push(figure);
            report.push(Figure::new(format!("{what}.{column}_max"), worst, unit));
        }
        let reference = mean(&all(|errors| &errors.reference));
        let _ = writeln!(table, "  {:>10}", short(reference));
        report.push(Figure::new(format!("{what}.reference"), reference, unit));
    }
}

/// Musts with the imperfections off.
fn ideal(unit: &str) -> Bounds {
    let must = (unit == "mm").then_some(IDEAL_MM);
    Bounds { estimate: must, truth: must, paper: None, authors_truth: None }
}

fn short(value: f64) -> String {
    if value < 0.1 { format!("{value:.4}") } else { format!("{value:.3}") }
}
