//! A palm whose tags were glued by hand: off by up to 3 mm and 5 degrees, a minute of waving before three cameras. And one
//! drawn right but for a single tag, 2 mm off: it must be named, and no other.

use locoman_calib::extrinsics::align;
use locoman_calib::layout::{Layout, measure};
use locoman_vision::rig::Rig;
use locoman_vision::shells::Shell;
use nalgebra::{Isometry3, Vector3};

use super::stage::{Draw, record};
use super::waved::{palm, rig, wave};
use crate::eval::statistics::percentile;
use crate::eval::{Figure, Must, Report};

const FILM: (f64, f64) = (60.0, 10.0);

pub fn run(seed: u64, report: &mut Report) -> anyhow::Result<()> {
    let mut three = rig();
    three.cameras.truncate(3);
    let three = Rig::new(three.cameras);
    let drawn = palm()?;
    let mut draw = Draw::new(seed);
    let mut glued = drawn.clone();
    for tag in &mut glued.tags {
        let mut within = |most: f64| {
            let direction = draw.normals(1.0).normalize();
            direction * draw.between(0.0, most)
        };
        let (shift, turn): (Vector3<f64>, Vector3<f64>) = (within(0.003), within(5_f64.to_radians()));
        tag.shell_from_tag *= Isometry3::new(shift, turn);
    }
    let found = measured(&three, &drawn, &glued, &mut draw)?;
    let (positions_mm, turns_deg) = errors(&found, &glued);
    report.push(
        Figure::new("glued.tags", positions_mm.len() as f64, "").must(Must::AtLeast(drawn.tags.len() as f64)),
    );
    report.push(
        Figure::new("glued.position_median", percentile(&positions_mm, 0.5), "mm").must(Must::AtMost(0.05)),
    );
    report.push(
        Figure::new("glued.position_worst", percentile(&positions_mm, 1.0), "mm").must(Must::AtMost(0.15)),
    );
    report.push(
        Figure::new("glued.rotation_worst", percentile(&turns_deg, 1.0), "deg").must(Must::AtMost(0.2)),
    );

    let mut slipped = drawn.clone();
    slipped.tags[7].shell_from_tag *= Isometry3::translation(0.002, 0.0, 0.0);
    let found = measured(&three, &drawn, &slipped, &mut draw)?;
    let named = |id: u32| found.tags.iter().any(|tag| tag.id == id && tag.misplaced());
    let others = found.tags.iter().filter(|tag| tag.misplaced() && tag.id != drawn.tags[7].id).count();
    report.push(
        Figure::new("glued.slip_named", f64::from(named(drawn.tags[7].id)), "").must(Must::AtLeast(1.0)),
    );
    report.push(Figure::new("glued.others_named", others as f64, "").must(Must::AtMost(0.0)));
    Ok(())
}

fn measured(rig: &Rig, drawn: &Shell, real: &Shell, draw: &mut Draw) -> anyhow::Result<Layout> {
    let wave = wave(draw);
    let observations = record(rig, real, &|t| wave.at(t), &[0.0; 3], FILM, draw);
    Ok(measure(rig, drawn, &observations, false, &mut |_, _| {})?)
}

/// Of each tag that was measured, mm and degrees; found and real tags laid over each other.
fn errors(found: &Layout, real: &Shell) -> (Vec<f64>, Vec<f64>) {
    let measured: Vec<usize> = (0..real.tags.len()).filter(|k| found.tags[*k].sigma_m < 1e-3).collect();
    let corners = |shell: &Shell| measured.iter().flat_map(|k| shell.tags[*k].corners()).collect::<Vec<_>>();
    let pairs: Vec<_> = corners(&found.shell).into_iter().zip(corners(real)).collect();
    let real_from_found = align(&pairs).unwrap_or_default();
    let error = |k: &usize| {
        let found = real_from_found * found.shell.tags[*k].shell_from_tag;
        let error = real.tags[*k].shell_from_tag.inverse() * found;
        (1e3 * error.translation.vector.norm(), error.rotation.angle().to_degrees())
    };
    measured.iter().map(error).unzip()
}
