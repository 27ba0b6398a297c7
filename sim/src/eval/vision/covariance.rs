//! Whether errors are as large as the tracker says: normalised errors and the coverage of its ellipsoids.

use super::tally::{ShellTally, Tally};
use crate::eval::statistics::mean;
use crate::eval::{Figure, Must, Report};

/// Adds the figures of several films, by the name of each.
pub fn report(films: &[(&str, &Tally)], report: &mut Report) {
    for (film, tally) in films {
        for shell in &tally.shells {
            pair(&format!("covariance.{film}.{}", shell.name), std::slice::from_ref(&shell), report);
        }
    }
    let all: Vec<&ShellTally> = films.iter().flat_map(|(_, tally)| &tally.shells).collect();
    pair("covariance.all", &all, report);
}

fn pair(name: &str, shells: &[&ShellTally], report: &mut Report) {
    let errors = || shells.iter().flat_map(|shell| &shell.errors);
    let normalized: Vec<f64> = errors().map(super::error::PoseError::normalized).collect();
    let covered: Vec<f64> = errors().map(|error| f64::from(u8::from(error.is_covered()))).collect();
    report.push(
        Figure::new(format!("{name}.normalized_error"), mean(&normalized), "").must(Must::Between(0.8, 1.25)),
    );
    report.push(
        Figure::new(format!("{name}.coverage_of_95"), mean(&covered), "").must(Must::Between(0.93, 0.97)),
    );
}
