//! Whether a rig and its shells still are what their files say: residuals of a recording, and who is to blame.
//!
//! First nothing but the body's motion is adjusted: what remains is told by camera, by tag and over time. Then the cameras
//! are placed anew, and laid over their old places by the sum of distances: the one that stands out has been bumped. Two
//! cameras alone can only accuse each other.

use std::fmt::Write;

use locoman_vision::pose::Observation;
use locoman_vision::rig::Rig;
use locoman_vision::shells::Shell;
use nalgebra::Point3;

use crate::bundle::{Sighting, errors_px};
use crate::extrinsics::{ExtrinsicsError, Freedom, Solved, align, solve};

/// Errors of some sightings.
#[derive(Debug, Clone, PartialEq)]
pub struct Share {
    /// Whose.
    pub name: String,
    /// Sightings.
    pub count: usize,
    /// Of these, sightings that do not fit.
    pub outliers: usize,
    /// Root mean square of the lengths of the others' errors, pixels.
    pub rms_px: f64,
}

/// How far a camera is from where its file has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Moved {
    /// Its id.
    pub camera: String,
    /// By so much, m, and its standard deviation.
    pub shift_m: (f64, f64),
    /// Turned by so much, rad, and its standard deviation.
    pub turn_rad: (f64, f64),
}

/// What a recording says of a rig.
#[derive(Debug, Clone)]
pub struct Inspection {
    /// Residuals of each camera,
    pub cameras: Vec<Share>,
    /// of each tag that was seen,
    pub tags: Vec<Share>,
    /// and over time, in tenths of the recording.
    pub times: Vec<Share>,
    /// Of each camera, how far it has moved; empty with fewer than two.
    pub moved: Vec<Moved>,
}

/// Looks at what was seen of one body.
pub fn inspect(rig: &Rig, body: &Shell, observations: &[Observation]) -> Result<Inspection, ExtrinsicsError> {
    const TENTHS: usize = 10;
    let solved = solve(rig, body, observations, &Freedom::NOTHING, &mut |_, _| {})?;
    let sightings = &solved.problem.sightings;
    let all = |name: String, belongs: &dyn Fn(&Sighting) -> bool| share(&solved, name, belongs);
    let cameras = (0..rig.cameras.len()).map(|k| all(rig.cameras[k].id.clone(), &|s| s.camera == k));
    let cameras = cameras.collect();
    let tags = (0..body.tags.len()).map(|k| all(format!("tag {}", body.tags[k].id), &|s| s.part == k));
    let tags = tags.filter(|share| share.count > 0).collect();
    let end_s = sightings.iter().map(|s| s.capture_s).fold(0.0, f64::max) + 1e-9;
    let tenth = |s: &Sighting| (s.capture_s / end_s * TENTHS as f64) as usize;
    let begin = |k: usize| format!("from {:.1} s", end_s * k as f64 / TENTHS as f64);
    let times =
        (0..TENTHS).map(|k| all(begin(k), &|s| tenth(s) == k)).filter(|share| share.count > 0).collect();
    let moved = if rig.cameras.len() > 1 { moved(rig, body, observations)? } else { Vec::new() };
    Ok(Inspection { cameras, tags, times, moved })
}

fn share(solved: &Solved, name: String, belongs: &dyn Fn(&Sighting) -> bool) -> Share {
    let (mut count, mut outliers, mut sum, mut points) = (0, 0, 0.0, 0);
    for sighting in solved.problem.sightings.iter().filter(|sighting| belongs(sighting)) {
        count += 1;
        if sighting.outlier {
            outliers += 1;
            continue;
        }
        for error in errors_px(&solved.problem, sighting).unwrap_or_default() {
            sum += error.norm_squared();
            points += 1;
        }
    }
    Share { name, count, outliers, rms_px: (sum / f64::from(points.max(1))).sqrt() }
}

/// Cameras placed anew, and laid over their old places.
fn moved(rig: &Rig, body: &Shell, observations: &[Observation]) -> Result<Vec<Moved>, ExtrinsicsError> {
    /// Points that stand for a camera's place and orientation, m before and beside it.
    const ARM_M: f64 = 0.5;
    let solved = solve(rig, body, observations, &Freedom::PLACES, &mut |_, _| {})?;
    let arms = [[0.0; 3], [0.0, 0.0, ARM_M], [ARM_M, 0.0, 0.0], [0.0, ARM_M, 0.0]].map(Point3::from);
    let pairs: Vec<(Point3<f64>, Point3<f64>)> = solved
        .rig
        .cameras
        .iter()
        .zip(&rig.cameras)
        .flat_map(|(found, filed)| {
            arms.map(|arm| (found.world_from_camera * arm, filed.world_from_camera * arm))
        })
        .collect();
    let filed_from_found = align(&pairs).unwrap_or_default();
    // The first camera's deviation is 0 by convention: each is as sure as the others are against it.
    let spread = |k: usize| {
        let sigmas = solved.outcome.eye_sigmas(k);
        let mean = |part: Option<&[f64]>| part.map_or(0.0, |p| p.iter().map(|s| s * s).sum::<f64>().sqrt());
        (mean(sigmas.get(..3)), mean(sigmas.get(3..6)))
    };
    let least = (1..rig.cameras.len())
        .map(spread)
        .fold((f64::INFINITY, f64::INFINITY), |a, b| (a.0.min(b.0), a.1.min(b.1)));
    let found = solved.rig.cameras.iter().zip(&rig.cameras).enumerate().map(|(k, (found, filed))| {
        let error = filed.world_from_camera.inverse() * filed_from_found * found.world_from_camera;
        let (sigma_m, sigma_rad) = if k == 0 { least } else { spread(k) };
        Moved {
            camera: filed.id.clone(),
            shift_m: (error.translation.vector.norm(), sigma_m),
            turn_rad: (error.rotation.angle(), sigma_rad),
        }
    });
    Ok(found.collect())
}

impl Moved {
    /// Beyond chance, and beyond what does no harm.
    pub fn bumped(&self) -> bool {
        const SIGMAS: f64 = 5.0;
        const HARMLESS_M: f64 = 5e-4;
        const HARMLESS_RAD: f64 = 9e-4;
        self.shift_m.0 > HARMLESS_M.max(SIGMAS * self.shift_m.1)
            || self.turn_rad.0 > HARMLESS_RAD.max(SIGMAS * self.turn_rad.1)
    }
}

impl Inspection {
    /// Tags that fail to fit far more often, or by far more, than tags do.
    pub fn damaged(&self) -> Vec<&Share> {
        const LEAST_SEEN: usize = 10;
        let mut errors: Vec<f64> = self.tags.iter().map(|tag| tag.rms_px).collect();
        errors.sort_by(f64::total_cmp);
        let usual_px = errors.get(errors.len() / 2).copied().unwrap_or(0.0);
        let bad = |tag: &&Share| {
            tag.count >= LEAST_SEEN
                && (5 * tag.outliers > tag.count || tag.rms_px > (3.0 * usual_px).max(0.3))
        };
        self.tags.iter().filter(bad).collect()
    }
}

/// The inspection in words.
pub fn describe(inspection: &Inspection) -> String {
    let mut text = String::new();
    let mut table = |title: &str, shares: &[Share]| {
        let _ = writeln!(text, "{title}");
        for share in shares {
            let Share { name, count, outliers, rms_px } = share;
            let _ = writeln!(text, "  {name:<24} {rms_px:7.3} px RMS  {count:6} tags, {outliers} do not fit");
        }
    };
    table("by camera", &inspection.cameras);
    table("over time", &inspection.times);
    let damaged = inspection.damaged();
    for tag in &damaged {
        let _ = writeln!(
            text,
            "{} does not fit in {} of {} images ({:.2} px): is it torn, or moved? `shells` measures it anew",
            tag.name, tag.outliers, tag.count, tag.rms_px
        );
    }
    let bumped: Vec<&Moved> = inspection.moved.iter().filter(|moved| moved.bumped()).collect();
    for camera in &bumped {
        let Moved { camera, shift_m, turn_rad } = camera;
        let _ = writeln!(
            text,
            "camera `{camera}` is {:.2} mm and {:.3} degrees from where the rig file has it{}: run `extrinsics` again",
            1e3 * shift_m.0,
            turn_rad.0.to_degrees(),
            if inspection.moved.len() == 2 { " (or the other one is)" } else { "" }
        );
    }
    if damaged.is_empty() && bumped.is_empty() {
        let _ = writeln!(text, "cameras and tags are where their files have them");
    }
    text
}
