//! What can be wrong with a model's files.

use std::path::PathBuf;

/// Why a model was refused.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file could not be read.
    #[error("cannot read {file}: {source}; is `--configs` the folder `configs` of this project?")]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is no URDF.
    #[error("{file} is not a valid URDF: {source}; compare it with the one of this project")]
    Urdf {
        /// The file.
        file: PathBuf,
        /// What the parser said.
        source: Box<urdf_rs::UrdfError>,
    },
    /// The file is no valid table of numbers.
    #[error("{file}: {source}")]
    Table {
        /// The file.
        file: PathBuf,
        /// What the parser said, with the line.
        source: Box<toml::de::Error>,
    },
    /// An element is missing, or stands where it should not.
    #[error("{file}: {element}: {reason}")]
    Element {
        /// The file.
        file: PathBuf,
        /// Kind and name of the element.
        element: String,
        /// What is wrong with it and what is expected.
        reason: String,
    },
}
