//! What can be wrong with servos, their bus and their files.

use std::{io, path::PathBuf};

use super::{
    place::Place,
    wire::{HardwareError, Refusal},
};

/// Why something with a servo did not work.
#[derive(Debug, thiserror::Error)]
pub enum ServoError {
    /// A file could not be read.
    #[error("cannot read {file}: {source}")]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// There are no zero angles yet.
    #[error("{file} is not there: no servo's zero angle is known; run `locoman-robot servo zero`")]
    NoZeros {
        /// The file.
        file: PathBuf,
    },
    /// A file could not be written.
    #[error("cannot write {file}: {source}")]
    Write {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file is not what it should be.
    #[error("{file}: {source}")]
    Parse {
        /// The file.
        file: PathBuf,
        /// What the parser said, with the line.
        source: Box<toml::de::Error>,
    },
    /// A setting that makes no sense.
    #[error("{file}: `{key}` must be {expected}")]
    Value {
        /// The file.
        file: PathBuf,
        /// The key.
        key: &'static str,
        /// What it must be.
        expected: &'static str,
    },
    /// Zero angles that do not belong to these servos.
    #[error("{file}: {flaw}; run `locoman-robot servo zero` again")]
    Zeros {
        /// The file.
        file: PathBuf,
        /// What does not fit.
        flaw: String,
    },
    /// No port was found, or several.
    #[error(
        "{found} U2D2 adapters (USB 0403:6014) are connected, one is needed; connect one, or name the port in servos.toml"
    )]
    Port {
        /// How many.
        found: usize,
    },
    /// The port could not be opened.
    #[error(
        "cannot open the servos' line {port}: {source}; is it connected, may you use it (group `dialout`), does another program?"
    )]
    Open {
        /// Its path.
        port: String,
        /// What the system said.
        source: io::Error,
    },
    /// The port failed.
    #[error("the servos' line failed: {0}; is the adapter still connected?")]
    Line(#[from] io::Error),
    /// No answer, or a damaged one.
    #[error(
        "servo {id} does not answer within {waited_ms:.1} ms: look at its cable and power, and at ids and baud rate with `locoman-robot servo scan`"
    )]
    Silent {
        /// Who was asked.
        id: u8,
        /// How long.
        waited_ms: f64,
    },
    /// Servos that should be there and are not.
    #[error("{} of 8 servos do not answer: {}; look at cables, power and `locoman-robot servo scan`", .missing.len(), named(.missing))]
    Missing {
        /// Place and id of each.
        missing: Vec<(Place, u8)>,
    },
    /// It refused.
    #[error("servo {id} refuses `{register}`: {refusal}")]
    Refused {
        /// Who.
        id: u8,
        /// What it was about.
        register: &'static str,
        /// Why.
        refusal: Refusal,
    },
    /// It is another servo.
    #[error("servo {id} ({place}) is of model {model}, 1220 (XC330-T288-T) is needed")]
    Model {
        /// Its id.
        id: u8,
        /// Where it should sit.
        place: Place,
        /// What it is.
        model: u16,
    },
    /// It is not set up as it must be.
    #[error(
        "servo {id} ({place}): {register} is {found}, {expected} is needed; run `locoman-robot servo setup`"
    )]
    Setup {
        /// Its id.
        id: u8,
        /// Where it sits.
        place: Place,
        /// The register.
        register: &'static str,
        /// What it holds.
        found: i64,
        /// What it must hold.
        expected: i64,
    },
    /// It has an error.
    #[error(
        "servo {id} ({place}) reports: {error}; let it cool, look for what blocks it and at the supply, then switch its power off and on"
    )]
    Hardware {
        /// Its id.
        id: u8,
        /// Where it sits.
        place: Place,
        /// What it reports.
        error: HardwareError,
    },
    /// It stands where its joint cannot be.
    #[error("servo {id} ({place}) stands at {angle_rad:.2} rad, its joint reaches from {:.2} to {:.2}: the horn has moved, or the zero is wrong; run `locoman-robot servo zero`", .range_rad[0], .range_rad[1])]
    Range {
        /// Its id.
        id: u8,
        /// Where it sits.
        place: Place,
        /// Its angle.
        angle_rad: f64,
        /// What its joint can take.
        range_rad: [f64; 2],
    },
    /// All servos must know the fast read.
    #[error(
        "servo {id} ({place}) has firmware {firmware}, which does not know the fast read (46 does); set `read = \"auto\"` in servos.toml"
    )]
    Firmware {
        /// Its id.
        id: u8,
        /// Where it sits.
        place: Place,
        /// Its firmware.
        firmware: u8,
    },
    /// The thread did not start.
    #[error("cannot start the servos' thread: {0}")]
    Thread(io::Error),
}

fn named(missing: &[(Place, u8)]) -> String {
    let names: Vec<String> = missing.iter().map(|(place, id)| format!("{place} (id {id})")).collect();
    names.join(", ")
}
