//! A camera that was bumped by a millimetre or a tenth of a degree, in ten seconds of a waved palm; and no false alarm.

use locoman_calib::inspect::inspect;
use nalgebra::{Isometry3, Vector3};

use super::stage::{Draw, record};
use super::waved::{palm, rig, wave};
use crate::eval::{Figure, Must, Report};

const FILM: (f64, f64) = (10.0, 15.0);
/// Films of each kind.
const FILMS: u64 = 8;

pub fn run(seed: u64, report: &mut Report) -> anyhow::Result<()> {
    let palm = palm()?;
    let bumps = [
        ("harm.shifted_named", Isometry3::translation(0.001, 0.0, 0.0)),
        ("harm.turned_named", Isometry3::rotation(Vector3::y() * 0.1_f64.to_radians())),
    ];
    let mut false_alarms = 0;
    for (name, bump) in bumps {
        let mut named = 0;
        for film in 0..FILMS {
            let mut draw = Draw::new(seed.wrapping_mul(100) + film);
            let wave = wave(&mut draw);
            let filed = rig();
            let mut real = filed.clone();
            let bumped = film as usize % real.cameras.len();
            real.cameras[bumped].world_from_camera *= bump;
            let observations = record(&real, &palm, &|t| wave.at(t), &[0.0; 4], FILM, &mut draw);
            let found = inspect(&filed, &palm, &observations)?;
            for (k, moved) in found.moved.iter().enumerate() {
                named += usize::from(k == bumped && moved.bumped());
                false_alarms += usize::from(k != bumped && moved.bumped());
            }
        }
        report.push(Figure::new(name, named as f64 / FILMS as f64, "").must(Must::AtLeast(1.0)));
    }
    report.push(Figure::new("harm.others_named", false_alarms as f64, "").must(Must::AtMost(0.0)));
    Ok(())
}
