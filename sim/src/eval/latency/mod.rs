//! `latency`: from images in memory to poses published, by the station's own threads, in real time.
//!
//! ```text
//! rendered images, held in memory ─► Sight (capture, eyes, scout) ─► Solver ─► Zenoh ─► a subscriber that notes the times
//!  forwards and backwards, over and over, each handed over at its capture time
//! ```
//!
//! Images are grey and decoded, as a camera without compression delivers them: nothing but reading, solving and publishing
//! is timed, and nothing else takes the processor's time but what else the machine does. The hands of `hand.toml` move
//! before pairs of cameras out of step; the shutters are global, because a film cannot run backwards through a rolling one.

mod station;
mod strip;

use std::path::Path;

use anyhow::ensure;

use super::statistics::percentile;
use super::{Figure, Must, Report};
use station::Session;
use strip::Strip;

/// Arguments of `eval latency`.
#[derive(Debug, Clone, Copy, PartialEq, clap::Args)]
pub struct Args {
    /// How long with each kind of camera, seconds; the published figures are of 600.
    #[arg(long, default_value_t = 20.0)]
    pub seconds: f64,
}

/// Cameras: name in figures, rig file, images a second.
const KINDS: [(&str, &str, f64); 2] =
    [("720p_60_hz", "two_zed_pairs", 60.0), ("1080p_30_hz", "two_zed_pairs_1080p", 30.0)];

/// Runs the experiment. Anything else that the machine does shows in it.
pub fn run(configs: &Path, args: Args, seed: u64) -> anyhow::Result<Report> {
    ensure!(args.seconds > station::WARM_UP_S, "--seconds must be above {}", station::WARM_UP_S);
    let mut report = Report::new("latency", seed);
    for (name, rig, rate_hz) in KINDS {
        tracing::info!("{name}: rendering {} s to play", strip::SECONDS);
        let strip = Strip::render(configs, rig, rate_hz, seed)?;
        tracing::info!("{name}: {} s in real time", args.seconds);
        push(&mut report, name, &station::play(configs, strip, args.seconds)?);
    }
    Ok(report)
}

fn push(report: &mut Report, name: &str, session: &Session) {
    const SOURCE: &str = "strand-braid, 5 cameras, simple blobs";
    let figure = |what: &str, value: f64, unit| Figure::new(format!("{name}.{what}"), value, unit);
    let of = |share: f64| percentile(&session.image_to_pose_ms, share);
    report.push(figure("image_to_pose_p50", of(0.5), "ms").must(Must::AtMost(4.0)).reference(0.98, SOURCE));
    report.push(figure("image_to_pose_p99", of(0.99), "ms").must(Must::AtMost(8.0)).reference(1.2, SOURCE));
    report.push(figure("image_to_pose_worst", of(1.0), "ms"));
    report.push(figure("capture_to_pose_p50", percentile(&session.age_ms, 0.5), "ms"));
    report.push(figure("capture_to_pose_p99", percentile(&session.age_ms, 0.99), "ms"));
    report.push(figure("frames", session.frames as f64, ""));
    report.push(figure("frames_dropped", session.dropped as f64, "").must(Must::AtMost(0.0)));
    report.push(figure("images_searched_whole", session.searched_whole as f64, ""));
    report.push(figure("poses_published", session.image_to_pose_ms.len() as f64, ""));
    report.push(figure("shells_tracked", session.tracked_share, ""));
    report.push(figure("processor_share_of_all_cores", session.cpu_share, ""));
}
