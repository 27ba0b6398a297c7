//! `locoman-calib extrinsics`: where a rig's cameras stand, from a recording of a waved board or shell.

use std::path::{Path, PathBuf};

use anyhow::Context;
use locoman_calib::extrinsics::{Freedom, Solved, World, solve};
use locoman_calib::file::write_whole;
use locoman_calib::toml_out;
use nalgebra::Isometry3;

use super::{Body, progress};

/// Arguments of `extrinsics`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The recording.
    #[arg(value_name = "REC")]
    recording: PathBuf,
    #[command(flatten)]
    body: Body,
    /// Find the clocks of cameras that are not exposed together with the first (`sync` in the rig file).
    #[arg(long)]
    clocks: bool,
    /// Find the time between two rows of each camera (rolling shutters).
    #[arg(long)]
    line_times: bool,
    /// Adjust intrinsics too, within about this many pixels of the rig file's.
    #[arg(long, value_name = "PX", default_value_t = 0.0)]
    intrinsics: f64,
    /// The board or shell lies at the world's origin so many seconds after the recording's begin (a board on the floor: z
    /// is up); without it the first camera stays where the rig file has it.
    #[arg(long, value_name = "S")]
    origin_at: Option<f64>,
    /// How high above the origin it then is, metres (a torso: the height of the chest).
    #[arg(long, value_name = "M", default_value_t = 0.0)]
    height: f64,
    /// The rig file to write.
    #[arg(short, long, value_name = "FILE", default_value = "rig.toml")]
    output: PathBuf,
}

/// Adjusts, prints what was found, writes the rig file.
pub fn run(args: &Args, configs: &Path) -> anyhow::Result<()> {
    let (rig, body) = args.body.load(configs)?;
    let observations = args.body.read(&args.recording, &rig, &body)?;
    let freedom = Freedom {
        clocks: args.clocks,
        line_times: args.line_times,
        intrinsics_px: args.intrinsics,
        ..Freedom::PLACES
    };
    let bar = progress("steps");
    let solved = solve(&rig, &body, &observations, &freedom, &mut |step, rms_px| {
        bar.set_position(step as u64);
        bar.set_message(format!("{rms_px:.3} px"));
    })?;
    bar.finish_and_clear();
    let text = described(&solved);
    println!("{text}");
    let world = args.origin_at.map_or(World::FirstCamera, |at_s| World::Body {
        at_s,
        world_from_body: Isometry3::translation(0.0, 0.0, args.height),
    });
    let placed = world.place(&solved).with_context(|| {
        format!(
            "{} s after its begin the recording shows nothing\n  hint: another --origin-at",
            args.origin_at.unwrap_or(0.0)
        )
    })?;
    write_whole(
        &args.output,
        &toml_out::rig_text(&placed, &format!("Places by `locoman-calib extrinsics`.\n{text}")),
    )
    .with_context(|| format!("cannot write {}", args.output.display()))?;
    println!("rig file: {}", args.output.display());
    Ok(())
}

fn described(solved: &Solved) -> String {
    let outcome = &solved.outcome;
    let mut text = format!(
        "{}: {:.3} px RMS over {} points, {} tags set aside, {} steps\n",
        if outcome.converged { "Converged" } else { "Not converged: take a longer recording" },
        outcome.rms_px,
        outcome.points,
        outcome.outliers,
        outcome.steps
    );
    for (k, camera) in solved.rig.cameras.iter().enumerate() {
        let sigmas = outcome.eye_sigmas(k);
        let length =
            |part: Option<&[f64]>| part.map_or(0.0, |part| part.iter().map(|s| s * s).sum::<f64>().sqrt());
        let place = camera.world_from_camera.translation.vector;
        text += &format!(
            "{}: at ({:.4}, {:.4}, {:.4}) m ± {:.3} mm, ± {:.4} degrees, clock {:+.3} ms, rows {:.2} us\n",
            camera.id,
            place.x,
            place.y,
            place.z,
            1e3 * length(sigmas.get(..3)),
            length(sigmas.get(3..6)).to_degrees(),
            1e3 * solved.offsets_s[k],
            1e6 * camera.line_time_s
        );
    }
    text
}
