//! The figures of a tracked recording, for people and for programs.

use std::fmt;

use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use serde::Serialize;

use super::tally::{Residuals, Tally};

/// Image parts, each way, of which it is told how many were ever seen into.
const GRID: usize = 12;

/// All figures.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names are those of the file, and carry the units")]
pub struct Summary {
    pub instants: u64,
    pub seconds: f64,
    pub cameras: Vec<Camera>,
    pub shells: Vec<Shell>,
    pub tags: Vec<Tag>,
}

/// One camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Camera {
    pub camera: String,
    pub frames: u64,
    pub unusable: u64,
    pub searched_whole: u64,
    /// Frames before which it was found to have moved from where the rig file has it.
    pub moved: u64,
    pub tags_seen: u64,
    pub tags_used: u64,
    /// Along each axis.
    pub residual_rms_px: f64,
    /// From the median: outliers do not count.
    pub noise_px: f64,
    pub residual_mean_px: [f64; 2],
    /// Share of the image's parts in which a corner was used.
    pub coverage: f64,
    pub detect_p50_ms: f64,
    pub detect_p99_ms: f64,
}

/// One shell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shell {
    pub shell: String,
    pub tracked: f64,
    pub predicted: f64,
    pub lost: f64,
    pub longest_gap_ms: f64,
    pub jumps: usize,
    pub largest_jump_mm: f64,
}

/// One tag.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tag {
    pub id: u32,
    pub shell: String,
    pub seen: u64,
    pub used: u64,
    pub residual_rms_px: f64,
    pub residual_mean_px: [f64; 2],
}

impl Summary {
    /// Of what was tallied.
    pub fn new(tally: &Tally, rig: &Rig, shells: &ShellSet) -> Self {
        let name =
            |index: usize| shells.shells.get(index).map_or_else(String::new, |shell| shell.name.clone());
        let seconds = tally.span_ns.map_or(0.0, |(first, last)| last.saturating_sub(first) as f64 * 1e-9);
        let cameras = rig.cameras.iter().zip(&tally.cameras).map(|(camera, tally)| {
            let size = [f64::from(camera.width), f64::from(camera.height)];
            let mut seen = [[false; GRID]; GRID];
            for corner in &tally.corners.kept {
                let part = |axis: usize| (corner.at_px[axis] / size[axis] * GRID as f64) as usize;
                seen[part(1).min(GRID - 1)][part(0).min(GRID - 1)] = true;
            }
            let covered = seen.iter().flatten().filter(|seen| **seen).count();
            let mut off_px: Vec<f64> =
                tally.corners.kept.iter().flat_map(|corner| corner.residual_px).map(f64::abs).collect();
            let mut detect_ms: Vec<f64> = tally.detect_ns.kept.iter().map(|ns| *ns as f64 * 1e-6).collect();
            Camera {
                camera: camera.id.clone(),
                frames: tally.frames,
                unusable: tally.unusable,
                searched_whole: tally.searched_whole,
                moved: tally.moved,
                tags_seen: tally.seen,
                tags_used: tally.used,
                residual_rms_px: tally.residuals.rms_px(),
                // The median of the magnitude of a normal variable is 0.6745 sigma.
                noise_px: quantile(&mut off_px, 0.5) / 0.6745,
                residual_mean_px: tally.residuals.mean_px(),
                coverage: covered as f64 / (GRID * GRID) as f64,
                detect_p50_ms: quantile(&mut detect_ms, 0.5),
                detect_p99_ms: quantile(&mut detect_ms, 0.99),
            }
        });
        let all_shells = tally.shells.iter().enumerate().map(|(index, tally)| {
            let instants = tally.verdicts.iter().sum::<u64>().max(1) as f64;
            let [tracked, predicted, lost] = tally.verdicts.map(|count| count as f64 / instants);
            Shell {
                shell: name(index),
                tracked,
                predicted,
                lost,
                longest_gap_ms: tally.longest_gap_ns as f64 * 1e-6,
                jumps: tally.jumps.len(),
                largest_jump_mm: tally.jumps.iter().map(|jump| jump.off_m * 1e3).fold(0.0, f64::max),
            }
        });
        let tags = tally.tags.iter().map(|(&id, tally)| {
            let residuals: &Residuals = &tally.residuals;
            Tag {
                id,
                shell: name(tally.shell),
                seen: tally.seen,
                used: tally.used,
                residual_rms_px: residuals.rms_px(),
                residual_mean_px: residuals.mean_px(),
            }
        });
        Self {
            instants: tally.instants,
            seconds,
            cameras: cameras.collect(),
            shells: all_shells.collect(),
            tags: tags.collect(),
        }
    }
}

/// By nearest rank; 0 of nothing.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let rank = (share * values.len() as f64).ceil() as usize;
    values.get(rank.max(1) - 1).copied().unwrap_or(0.0)
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} instants in {:.1} s\n", self.instants, self.seconds)?;
        writeln!(f, "shell          tracked predicted    lost  longest gap  jumps  largest")?;
        for s in &self.shells {
            let [tracked, predicted, lost] = [s.tracked, s.predicted, s.lost].map(|share| 100.0 * share);
            writeln!(
                f,
                "{:<14} {tracked:>5.1} % {predicted:>7.1} % {lost:>5.1} % {:>9.0} ms {:>6} {:>5.1} mm",
                s.shell, s.longest_gap_ms, s.jumps, s.largest_jump_mm
            )?;
        }
        writeln!(
            f,
            "\ncamera           frames  unusable  whole  tags used/seen    rms   noise  mean x, y         covers  read p50 / p99"
        )?;
        for c in &self.cameras {
            let [x, y] = c.residual_mean_px;
            writeln!(
                f,
                "{:<16} {:>6} {:>9} {:>6} {:>8}/{:<8} {:>5.3}  {:>5.3} px {x:>+6.3}, {y:>+6.3} px {:>5.0} % {:>6.2} / {:.2} ms",
                c.camera,
                c.frames,
                c.unusable,
                c.searched_whole,
                c.tags_used,
                c.tags_seen,
                c.residual_rms_px,
                c.noise_px,
                100.0 * c.coverage,
                c.detect_p50_ms,
                c.detect_p99_ms
            )?;
        }
        for c in self.cameras.iter().filter(|c| c.moved > 0) {
            writeln!(
                f,
                "\ncamera {} has moved from where the rig file has it, in {} of {} frames: calibrate the rig again",
                c.camera, c.moved, c.frames
            )?;
        }
        writeln!(f, "\ntag  shell           used/seen     rms     mean x, y")?;
        for t in &self.tags {
            let [x, y] = t.residual_mean_px;
            writeln!(
                f,
                "{:>3}  {:<14} {:>6}/{:<6} {:>6.3} px  {x:>+6.3}, {y:>+6.3} px",
                t.id, t.shell, t.used, t.seen, t.residual_rms_px
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_by_nearest_rank() {
        let mut values = [3.0, 1.0, 2.0, 4.0];
        assert_eq!((quantile(&mut values, 0.5), quantile(&mut values, 0.99)), (2.0, 4.0));
        assert_eq!(quantile(&mut [], 0.5), 0.0);
    }
}
