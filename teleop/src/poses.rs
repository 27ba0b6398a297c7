//! `track`: a recording to poses, offline and deterministic: every frame is used, no clock is read.
//!
//! Columns: `t_ns,shell,x,y,z,qw,qx,qy,qz,sigma_pos_m,sigma_rot_rad,rms_px,tags,cameras`, one row for each
//! shell and solved instant; `sigma` is the root of the mean variance over the three axes.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use locoman_vision::source::{FrameSets, open_recording};
use locoman_vision::track::{ShellUpdate, Tracker, Verdict};

use crate::review::Tally;

/// The header of the file.
const COLUMNS: [&str; 14] = [
    "t_ns",
    "shell",
    "x",
    "y",
    "z",
    "qw",
    "qx",
    "qy",
    "qz",
    "sigma_pos_m",
    "sigma_rot_rad",
    "rms_px",
    "tags",
    "cameras",
];

/// What was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Summary {
    /// Instants in the recording.
    pub instants: u64,
    /// Poses written.
    pub poses: u64,
    /// Frames that could not be read.
    pub skipped: u64,
}

/// Tracks `recording` and writes `output`, which appears only when it is complete; `tally` hears of every instant.
pub fn write(recording: &Path, mut tracker: Tracker, output: &Path, tally: &mut Tally) -> Result<Summary> {
    let source = open_recording(recording, tracker.rig())?;
    let sync_groups = tracker.rig().sync_groups.clone();
    let partial = partial_path(output);
    let mut summary = Summary { instants: 0, poses: 0, skipped: 0 };
    let written = (|| -> Result<()> {
        let mut csv = csv::Writer::from_path(&partial)
            .with_context(|| format!("cannot write {}; is the folder there?", partial.display()))?;
        csv.write_record(COLUMNS)?;
        let mut sets = FrameSets::new(source, &sync_groups);
        while let Some(set) = sets.next_set()? {
            let update = tracker.update(&set);
            summary.instants += 1;
            tally.add(&update);
            for (shell, seen) in tracker.shells().shells.iter().zip(&update.shells) {
                if let Some(row) = row(update.time_ns, &shell.name, seen) {
                    csv.write_record(row)?;
                    summary.poses += 1;
                }
            }
        }
        csv.flush()?;
        summary.skipped = locoman_vision::source::FrameSource::skipped(sets.source());
        std::fs::rename(&partial, output).with_context(|| format!("cannot write {}", output.display()))
    })();
    if written.is_err() {
        // Nothing half-written is left; it may not have been begun.
        let _ = std::fs::remove_file(&partial);
    }
    written.map(|()| summary)
}

fn partial_path(output: &Path) -> PathBuf {
    let mut name = output.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    output.with_file_name(name)
}

/// One row; `None` unless the pose was measured at this instant.
fn row(time_ns: u64, shell: &str, seen: &ShellUpdate) -> Option<[String; 14]> {
    let pose = seen.world_from_shell.filter(|_| seen.verdict == Verdict::Tracked)?;
    let p = pose.translation.vector;
    // Of the two quaternions of a rotation the one with a positive w: files compare.
    let q = pose.rotation.quaternion() * if pose.rotation.w < 0.0 { -1.0 } else { 1.0 };
    let sigma = |first: usize| {
        let mean = (first..first + 3).map(|i| seen.covariance[(i, i)]).sum::<f64>() / 3.0;
        mean.max(0.0).sqrt()
    };
    let metres = |value: f64| format!("{value:.7}");
    let unit = |value: f64| format!("{value:.9}");
    Some([
        time_ns.to_string(),
        shell.to_owned(),
        metres(p.x),
        metres(p.y),
        metres(p.z),
        unit(q.w),
        unit(q.i),
        unit(q.j),
        unit(q.k),
        format!("{:.3e}", sigma(0)),
        format!("{:.3e}", sigma(3)),
        format!("{:.4}", seen.rms_px),
        seen.tags.to_string(),
        seen.cameras.to_string(),
    ])
}
