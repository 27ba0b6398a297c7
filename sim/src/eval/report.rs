//! Figures of an evaluation, as a table for people and as JSON for scripts.

use std::fmt;
use std::path::Path;

use anyhow::Context;
use serde::{Serialize, Serializer};

/// What a figure has to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Must {
    /// At most this.
    AtMost(f64),
    /// At least this.
    AtLeast(f64),
    /// At least the first, at most the second.
    Between(f64, f64),
}

impl Must {
    /// Whether a value satisfies it; what is no number does not.
    pub fn is_met_by(&self, value: f64) -> bool {
        match self {
            Self::AtMost(limit) => value <= *limit,
            Self::AtLeast(limit) => value >= *limit,
            Self::Between(low, high) => (*low..=*high).contains(&value),
        }
    }
}

impl fmt::Display for Must {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtMost(limit) => write!(f, "<= {limit}"),
            Self::AtLeast(limit) => write!(f, ">= {limit}"),
            Self::Between(low, high) => write!(f, "{low} to {high}"),
        }
    }
}

impl Serialize for Must {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// One measured number.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// What it is, dotted from general to particular: `gripper.position_mean`.
    pub name: String,
    /// The number; JSON `null` if nothing was there to be measured.
    pub value: f64,
    /// Its unit; empty for counts.
    pub unit: &'static str,
    /// What the issue asks for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub must: Option<Must>,
    /// Somebody else's figure to compare with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<f64>,
    /// Whose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
}

impl Figure {
    /// A bare number.
    pub fn new(name: impl Into<String>, value: f64, unit: &'static str) -> Self {
        Self { name: name.into(), value, unit, must: None, reference: None, source: None }
    }

    /// With what it has to be.
    #[must_use]
    pub fn must(self, must: Must) -> Self {
        Self { must: Some(must), ..self }
    }

    /// With a figure to compare with.
    #[must_use]
    pub fn reference(self, value: f64, source: impl Into<String>) -> Self {
        Self { reference: Some(value), source: Some(source.into()), ..self }
    }
}

/// All figures of one run of one evaluation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Name of the evaluation.
    pub eval: &'static str,
    /// Seed of everything random in it.
    pub seed: u64,
    /// The figures, in the order of the table.
    pub figures: Vec<Figure>,
    /// What people see in place of the list of figures.
    #[serde(skip)]
    pub table: Option<String>,
}

impl Report {
    /// An empty report.
    pub fn new(eval: &'static str, seed: u64) -> Self {
        Self { eval, seed, figures: Vec::new(), table: None }
    }

    /// Adds a figure.
    pub fn push(&mut self, figure: Figure) {
        self.figures.push(figure);
    }

    /// The value of a figure.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.figures.iter().find(|figure| figure.name == name).map(|figure| figure.value)
    }

    /// Prints the table to stdout and writes the JSON file, if one is wanted.
    pub fn finish(&self, json: Option<&Path>) -> anyhow::Result<()> {
        println!("{self}");
        let Some(path) = json else { return Ok(()) };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)
                .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        }
        let text = serde_json::to_string_pretty(self)?;
        std::fs::write(path, text + "\n").with_context(|| format!("cannot write {}", path.display()))
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.figures.iter().map(|figure| figure.name.len()).max().unwrap_or(0);
        writeln!(f, "{} (seed {})", self.eval, self.seed)?;
        if let Some(table) = &self.table {
            return f.write_str(table);
        }
        for figure in &self.figures {
            write!(f, "  {:width$}  {:>12} {:4}", figure.name, rounded(figure.value), figure.unit)?;
            if let Some(must) = &figure.must {
                let verdict = if must.is_met_by(figure.value) { "met" } else { "MISSED" };
                write!(f, "  must be {must}: {verdict}")?;
            }
            if let (Some(reference), Some(source)) = (figure.reference, &figure.source) {
                write!(f, "  ({source}: {reference})")?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}

/// Four significant digits are enough for a person.
fn rounded(value: f64) -> String {
    if !value.is_finite() {
        return "none".into();
    }
    let decimals = match value.abs() {
        1000.0.. => 0,
        100.0.. => 1,
        10.0.. => 2,
        1.0.. => 3,
        _ => 4,
    };
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_json_has_the_form_that_scripts_expect() {
        let mut report = Report::new("demo", 1);
        report.push(Figure::new("gripper_mm", 0.71, "mm").must(Must::AtMost(0.84)).reference(1.67, "paper"));
        report.push(Figure::new("nothing", f64::NAN, ""));
        let json: serde_json::Value = serde_json::from_str(&serde_json::to_string(&report).unwrap()).unwrap();
        let expected = serde_json::json!({"eval": "demo", "seed": 1, "figures": [
            {"name": "gripper_mm", "value": 0.71, "unit": "mm", "must": "<= 0.84", "reference": 1.67, "source": "paper"},
            {"name": "nothing", "value": null, "unit": ""},
        ]});
        assert_eq!(json, expected);
        assert!(!Must::AtMost(1.0).is_met_by(f64::NAN) && Must::AtLeast(1.0).is_met_by(1.0));
    }
}
