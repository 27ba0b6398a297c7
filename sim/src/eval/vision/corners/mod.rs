//! Corners of single tags: our reader beside the library's, tag by tag in the same pictures.
//!
//! A tag of a given side, tilted about a random direction and turned at random, is printed on grey; blur 0.7 px, noise 2
//! of a contrast of 160. The reader is told where the tag is to within a pixel and how fast it moves, as tracking tells it; the library
//! (AprilTag with its edge refinement, every pixel) searches the picture. Errors are those per axis of the tags that both
//! found, from where the corners truly are; the bound is the least that any unbiased estimate can have
//! ([`super::bound`]).

mod print;

use locoman_vision::camera::Camera;
use locoman_vision::detect::expected::{Expectation, Reader};
use locoman_vision::detect::{Detector, Search};
use locoman_vision::image::GrayImage;
use nalgebra::{Point2, Vector2};
use rayon::prelude::*;

use super::bound;
use crate::eval::statistics::rms;
use crate::eval::{Figure, Must, Report};
use crate::operator::sensor::mix;
use print::{NOISE, Print};

/// What is printed, and what is asked.
struct Case {
    name: &'static str,
    side_px: f64,
    tilt_deg: f64,
    motion_px: f64,
    /// RMS per axis: asked of the reader, and AprilTag 3.4.5's by an earlier measure of the same kind.
    most_px: f64,
    library_px: f64,
}

const CASES: [Case; 6] = [
    Case { name: "20px", side_px: 20.0, tilt_deg: 20.0, motion_px: 0.0, most_px: 0.05, library_px: 0.070 },
    Case { name: "40px", side_px: 40.0, tilt_deg: 20.0, motion_px: 0.0, most_px: 0.010, library_px: 0.013 },
    Case { name: "80px", side_px: 80.0, tilt_deg: 20.0, motion_px: 0.0, most_px: 0.010, library_px: 0.013 },
    Case { name: "160px", side_px: 160.0, tilt_deg: 20.0, motion_px: 0.0, most_px: 0.010, library_px: 0.015 },
    Case {
        name: "80px_tilted_60",
        side_px: 80.0,
        tilt_deg: 60.0,
        motion_px: 0.0,
        most_px: 0.013,
        library_px: 0.033,
    },
    Case {
        name: "60px_moving_8px",
        side_px: 60.0,
        tilt_deg: 20.0,
        motion_px: 8.0,
        most_px: 0.06,
        library_px: 0.089,
    },
];

/// Tags of each case.
const TAGS: u32 = 120;

/// One tag, read twice.
#[derive(Default)]
struct Outcome {
    read: bool,
    found: bool,
    /// Errors per axis, if both found it.
    read_px: Vec<f64>,
    found_px: Vec<f64>,
    /// Squared: least variance of each axis.
    bound_px2: Vec<f64>,
    /// By the reader's own covariance, per degree of freedom.
    normalized: Option<f64>,
}

/// Prints and reads all tags; adds the figures.
pub fn run(seed: u64, report: &mut Report) -> anyhow::Result<()> {
    for case in &CASES {
        let camera = print::camera(case.side_px);
        let outcomes: Vec<Outcome> = (0..TAGS)
            .into_par_iter()
            .map(|number| one(&camera, case, number, mix(seed ^ mix(u64::from(number)))))
            .collect::<anyhow::Result<_>>()?;
        figures(case, &outcomes, report);
    }
    Ok(())
}

fn one(camera: &Camera, case: &Case, number: u32, random: u64) -> anyhow::Result<Outcome> {
    // Ids from all over the family.
    let id = (number * 89 + 7) % 587;
    let print = Print::draw(camera, id, case, random);
    let light = print.light(camera);
    let image = GrayImage::new(camera.width, camera.height, print::developed(&light, NOISE, random))?;
    let truth_px = print.corners_px(camera);

    let off = Vector2::new(1.4 * (unit(random, 1) - 0.5), 1.4 * (unit(random, 2) - 0.5));
    let about = truth_px.map(|corner| corner + off);
    let mut reader = Reader::new(camera, &[id]);
    let reading = Expectation::from_corners(id, camera, &about, 2.0)
        .map(|still| Expectation { ideal_rate: print.ideal_rate(camera), ..still })
        .and_then(|expectation| reader.read(&image, &expectation).ok());
    let found = Detector::new(&[id])?.detect(&image, Search::Full { decimate: 1.0 });
    let found = found.first();

    let mut outcome = Outcome { read: reading.is_some(), found: found.is_some(), ..Outcome::default() };
    if let (Some(reading), Some(found)) = (&reading, found) {
        outcome.read_px = errors(&reading.corners_px, &truth_px);
        outcome.found_px = errors(&found.corners_px, &truth_px);
        let error = nalgebra::SVector::<f64, 8>::from_column_slice(&outcome.read_px);
        outcome.normalized =
            reading.covariance_px2.cholesky().map(|factor| error.dot(&factor.solve(&error)) / 8.0);
        let clean = print::picture(camera, print::developed(&light, 0.0, random));
        let variance = NOISE * NOISE + 1.0 / 12.0;
        if let Some(bound) = bound::of_corners(&clean, &truth_px, |_| variance) {
            outcome.bound_px2 = bound.diagonal().iter().copied().collect();
        }
    }
    Ok(outcome)
}

fn errors(found: &[Point2<f64>; 4], truth: &[Point2<f64>; 4]) -> Vec<f64> {
    found.iter().zip(truth).flat_map(|(a, b)| [a.x - b.x, a.y - b.y]).collect()
}

/// The `k`-th number between 0 and 1 that follows from a seed.
fn unit(random: u64, k: u64) -> f64 {
    (mix(random ^ mix(k)) >> 11) as f64 / (1u64 << 53) as f64
}

fn figures(case: &Case, outcomes: &[Outcome], report: &mut Report) {
    let figure =
        |what: &str, value: f64, unit| Figure::new(format!("corners.{}.{what}", case.name), value, unit);
    let all = |of: fn(&Outcome) -> &Vec<f64>| -> Vec<f64> { outcomes.iter().flat_map(of).copied().collect() };
    let share = |of: fn(&Outcome) -> bool| {
        outcomes.iter().filter(|outcome| of(outcome)).count() as f64 / outcomes.len() as f64
    };
    let bound_px = crate::eval::statistics::mean(&all(|outcome| &outcome.bound_px2)).sqrt();
    let normalized: Vec<f64> = outcomes.iter().filter_map(|outcome| outcome.normalized).collect();
    report.push(
        figure("reader_rms", rms(&all(|outcome| &outcome.read_px)), "px")
            .must(Must::AtMost(case.most_px))
            .reference(case.library_px, "AprilTag 3.4.5, anchors"),
    );
    report.push(figure("library_rms", rms(&all(|outcome| &outcome.found_px)), "px"));
    report.push(figure("bound_rms", bound_px, "px"));
    report.push(figure("reader_normalized_error", crate::eval::statistics::mean(&normalized), ""));
    report.push(figure("reader_read", share(|outcome| outcome.read), ""));
    report.push(figure("library_found", share(|outcome| outcome.found), ""));
}
