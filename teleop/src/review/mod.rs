//! What a tracked recording says of the rig, the shells and the tracker: `track --report DIR`.
//!
//! ```text
//! TrackUpdate, one after the other ─► Tally ─► Summary ─► summary.json, summary.txt
//!                                       └────► plots ───► residuals.svg, coverage.svg, time.svg
//! ```
//!
//! Residuals are of the corners that the poses rest on, seen minus reprojected, in pixels.

mod plots;
mod summary;
mod tally;

use std::path::Path;

use anyhow::{Context, Result};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;

pub use plots::COLOURS;
pub use summary::Summary;
pub use tally::Tally;

/// Writes summary and plots into a folder, which is made if need be.
pub fn write(folder: &Path, tally: &Tally, rig: &Rig, shells: &ShellSet) -> Result<Summary> {
    let cannot_write = || format!("cannot write the report into {}", folder.display());
    std::fs::create_dir_all(folder).with_context(cannot_write)?;
    let summary = Summary::new(tally, rig, shells);
    let json = serde_json::to_string_pretty(&summary)?;
    std::fs::write(folder.join("summary.json"), json + "\n").with_context(cannot_write)?;
    std::fs::write(folder.join("summary.txt"), summary.to_string()).with_context(cannot_write)?;
    plots::residuals(&folder.join("residuals.svg"), tally, rig)?;
    plots::coverage(&folder.join("coverage.svg"), tally, rig)?;
    plots::time(&folder.join("time.svg"), tally, shells)?;
    Ok(summary)
}
