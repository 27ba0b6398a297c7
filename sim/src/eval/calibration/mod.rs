//! `calibration`: lenses, rigs and shells found from scratch, against the truth.
//!
//! Projected sets: what cameras would report of boards and shells that are waved by hand, with noise, unlike clocks and
//! rolling rows ([`stage`]). Real sets: OpenCV's chessboards ([`chess`]) and TagSLAM's block ([`block`]), where they are
//! on this machine. No picture is rendered: what the detector adds to errors, `eval vision` tells.

mod block;
mod chess;
mod glued;
mod harm;
mod rigs;
mod stage;
mod waved;

use std::path::PathBuf;

use super::Report;

/// Arguments of `eval calibration`: without any, all parts.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct Args {
    /// Which parts; all if none is named.
    #[arg(long = "part", value_enum, value_name = "PART")]
    pub parts: Vec<Part>,
    /// Random rigs of the part `rigs`.
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub rigs: usize,
    /// The folder with other people's pictures and detections; what is not there is left out.
    #[arg(long, value_name = "DIR", default_value = "../shared/real")]
    pub real: PathBuf,
}

/// One experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Part {
    /// Random rigs from scratch: lenses, places, clocks, rows.
    Rigs,
    /// Four cameras placed by waving a palm for a minute.
    Waved,
    /// A shell whose tags were glued by hand.
    Glued,
    /// TagSLAM's block: even tags against odd ones.
    Block,
    /// OpenCV's chessboards.
    Chess,
    /// A bumped camera, a torn tag.
    Harm,
}

impl Part {
    const ALL: [Self; 6] = [Self::Rigs, Self::Waved, Self::Glued, Self::Block, Self::Chess, Self::Harm];
}

/// Runs the parts.
pub fn run(args: &Args, seed: u64) -> anyhow::Result<Report> {
    let parts = if args.parts.is_empty() { &Part::ALL[..] } else { &args.parts };
    let mut report = Report::new("calibration", seed);
    for part in parts {
        match part {
            Part::Rigs => rigs::run(args.rigs, seed, &mut report),
            Part::Waved => waved::run(seed, &mut report)?,
            Part::Glued => glued::run(seed, &mut report)?,
            Part::Block => block::run(&args.real.join("tagslam_block"), &mut report)?,
            Part::Chess => chess::run(&args.real.join("opencv_samples"), &mut report)?,
            Part::Harm => harm::run(seed, &mut report)?,
        }
    }
    Ok(report)
}
