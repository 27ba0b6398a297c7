//! Four cameras, intrinsics known, placed by waving a palm shell for a minute; and how long that takes.

use std::time::Instant;

use locoman_calib::extrinsics::{Freedom, solve};
use locoman_vision::camera::Distortion;
use locoman_vision::rig::Rig;
use locoman_vision::shells::{Shell, design};
use nalgebra::{Isometry3, Vector3};

use super::stage::{Draw, Wave, camera, looking, record};
use crate::eval::{Figure, Must, Report};

/// A minute of 2,000 images: 500 of each camera.
const FILM: (f64, f64) = (60.0, 500.0 / 60.0);

/// Four cameras about 0.8 m from a hand.
pub fn rig() -> Rig {
    let place = |k: usize| {
        let side = 0.35 * (k as f64 - 1.5);
        looking(Vector3::new(0.75 - 0.1 * side.abs(), side, 1.3), Vector3::new(0.0, 0.0, 1.1))
    };
    let lens = Distortion::RadTan([-0.05, 0.012, 3e-4, -2e-4, 0.0, 0.0, 0.0, 0.0]);
    Rig::new((0..4).map(|k| camera(k, 1000.0, lens.clone(), place(k), 0.0)).collect())
}

/// The right palm's shell.
pub fn palm() -> anyhow::Result<Shell> {
    let standard = design::standard();
    let palm = standard.shells.into_iter().find(|shell| shell.name == "right_palm");
    palm.ok_or_else(|| anyhow::anyhow!("the standard shells have no right palm"))
}

/// A palm that is waved and turned about.
pub fn wave(draw: &mut Draw) -> Wave {
    Wave::new(Isometry3::translation(0.0, 0.0, 1.1), 0.15, 1.4, draw)
}

pub fn run(seed: u64, report: &mut Report) -> anyhow::Result<()> {
    let (truth, palm) = (rig(), palm()?);
    let mut draw = Draw::new(seed);
    let wave = wave(&mut draw);
    let observations = record(&truth, &palm, &|t| wave.at(t), &[0.0; 4], FILM, &mut draw);
    let mut unknown = truth.clone();
    unknown.cameras[1..].iter_mut().for_each(|camera| camera.world_from_camera = Isometry3::identity());
    let begin = Instant::now();
    let solved = solve(&unknown, &palm, &observations, &Freedom::PLACES, &mut |_, _| {})?;
    let seconds = begin.elapsed().as_secs_f64();
    let (mut worst_mm, mut worst_deg) = (0.0_f64, 0.0_f64);
    for (found, known) in solved.rig.cameras.iter().zip(&truth.cameras) {
        let error = known.world_from_camera.inverse() * found.world_from_camera;
        worst_mm = worst_mm.max(1e3 * error.translation.vector.norm());
        worst_deg = worst_deg.max(error.rotation.angle().to_degrees());
    }
    report.push(Figure::new("waved.position_worst", worst_mm, "mm").must(Must::AtMost(0.15)));
    report.push(Figure::new("waved.rotation_worst", worst_deg, "deg").must(Must::AtMost(0.01)));
    report.push(Figure::new("waved.seconds", seconds, "s").must(Must::AtMost(30.0)));
    Ok(())
}
