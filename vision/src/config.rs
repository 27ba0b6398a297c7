//! What rig and shells files have in common: reading TOML, and errors that name file, line and remedy.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// A configuration file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}\n  hint: check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file says something that makes no sense.
    #[error("{}:{line}: {problem}\n  hint: {remedy}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// What is wrong, with the numbers.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
}

/// What is wrong in one place of a file; becomes a [`ConfigError`] once the place is known.
#[derive(Debug)]
pub(crate) struct Fault {
    pub problem: String,
    pub remedy: String,
}

impl Fault {
    pub fn new(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { problem: problem.into(), remedy: remedy.into() }
    }
}

/// The text of a file and where it came from.
pub(crate) struct Source {
    pub path: PathBuf,
    pub text: String,
}

impl Source {
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        match std::fs::read_to_string(path) {
            Ok(text) => Ok(Self { path: path.to_owned(), text }),
            Err(source) => Err(ConfigError::Read { path: path.to_owned(), source }),
        }
    }

    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, ConfigError> {
        toml::from_str(&self.text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            let message = error.message().to_owned();
            let remedy = remedy_for(&message);
            self.error(offset, Fault::new(message, remedy))
        })
    }

    /// The error at a byte offset of the text.
    pub fn error(&self, offset: usize, fault: Fault) -> ConfigError {
        let before = self.text.get(..offset).unwrap_or(&self.text);
        let line = 1 + before.bytes().filter(|byte| *byte == b'\n').count();
        ConfigError::Invalid { path: self.path.clone(), line, problem: fault.problem, remedy: fault.remedy }
    }
}

/// Turns serde's "unknown field `a`, expected one of `b`, `c`" into a guess at what was meant.
fn remedy_for(message: &str) -> String {
    let mut quoted = message.split('`').skip(1).step_by(2);
    if message.starts_with("unknown") || message.starts_with("missing") {
        let word = quoted.next().unwrap_or_default();
        if message.starts_with("missing") {
            return format!("add `{word} = …`");
        }
        let known: Vec<&str> = quoted.collect();
        return match did_you_mean(word, &known) {
            Some(guess) => format!("did you mean `{guess}`?"),
            None => "remove it, or see the documented keys in configs/".to_owned(),
        };
    }
    "see the documented files in configs/ for the expected form".to_owned()
}

/// The known word that a mistyped one is nearest to, if it is near at all.
pub(crate) fn did_you_mean<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    let (distance, best) =
        known.iter().map(|candidate| (edit_distance(word, candidate), *candidate)).min()?;
    (distance > 0 && distance <= 1 + word.chars().count() / 3).then_some(best)
}

/// Levenshtein's distance.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, other) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(letter != *other);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// A pose as configuration files write it: metres, and a unit quaternion with w first.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PoseEntry {
    pub xyz: [f64; 3],
    pub quat: [f64; 4],
}

impl PoseEntry {
    pub fn to_isometry(&self, key: &str) -> Result<Isometry3<f64>, Fault> {
        /// Files are written with six digits or more; a quaternion farther off is a mistake.
        const UNIT_TOLERANCE: f64 = 1e-3;
        let [x, y, z] = self.xyz;
        let [qw, qx, qy, qz] = self.quat;
        let quaternion = Quaternion::new(qw, qx, qy, qz);
        let norm = quaternion.norm();
        if ![x, y, z, norm].iter().all(|number| number.is_finite()) {
            return Err(Fault::new(
                format!("{key} holds a number that is not finite"),
                "write plain decimal numbers, metres for xyz",
            ));
        }
        if (norm - 1.0).abs() > UNIT_TOLERANCE {
            return Err(Fault::new(
                format!("{key}.quat has norm {norm:.4}, a rotation has norm 1"),
                "write the unit quaternion as [w, x, y, z]",
            ));
        }
        Ok(Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::new_normalize(quaternion)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_the_finger_is_recognised() {
        assert_eq!(did_you_mean("widht", &["id", "width", "height"]), Some("width"));
        assert_eq!(did_you_mean("rigth_palm", &["right_palm", "left_palm"]), Some("right_palm"));
        assert_eq!(did_you_mean("colour", &["id", "width"]), None);
        assert_eq!(edit_distance("kitten", "sitting"), 3);
    }
}
