//! Cameras, body and motion of a recording, adjusted together.

use locoman_vision::pose::Observation;
use locoman_vision::rig::Rig;
use locoman_vision::shells::Shell;
use nalgebra::Isometry3;

use super::ExtrinsicsError;
use super::poses::{Sight, interpolated, sights};
use super::{clocks, graph};
use crate::bundle::{self, Eye, EyeLoose, FIXED, FREE, Motion, Outcome, Part, Path, Problem, Sighting};

/// What is to be found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Freedom {
    /// Where the cameras stand; the first one keeps its place.
    pub places: bool,
    /// Their intrinsics too: the deviation of a prior on focal lengths and centres, pixels, and a hundredth of the number
    /// on coefficients. 0 keeps them, infinity frees them.
    pub intrinsics_px: f64,
    /// Clocks of cameras that are not exposed together with the first.
    pub clocks: bool,
    /// The time between two rows of each camera.
    pub line_times: bool,
    /// Where each tag is on the body, m; infinity is free, 0 keeps the drawing.
    pub tags_m: f64,
    /// How each tag is turned, rad.
    pub tags_rad: f64,
    /// How large each tag is, relative.
    pub sizes: f64,
}

impl Freedom {
    /// Cameras alone.
    pub const PLACES: Self = Self {
        places: true,
        intrinsics_px: 0.0,
        clocks: false,
        line_times: false,
        tags_m: 0.0,
        tags_rad: 0.0,
        sizes: 0.0,
    };
    /// Nothing but the motion.
    pub const NOTHING: Self = Self { places: false, ..Self::PLACES };
}

/// A recording, adjusted.
#[derive(Debug, Clone)]
pub struct Solved {
    /// Cameras as they were found, in the first camera's world.
    pub rig: Rig,
    /// The clocks' offsets, seconds; what is added to capture times.
    pub offsets_s: Vec<f64>,
    /// The body as it was found.
    pub body: Shell,
    /// The adjusted state, with every sighting.
    pub problem: Problem,
    /// How it went.
    pub outcome: Outcome,
    /// Which tag of the body keeps its place, if tags were free.
    pub anchor: Option<usize>,
}

/// Adjusts what was seen of a body; `progress` hears of each step and its RMS in pixels.
///
/// With [`Freedom::places`] the rig's places are not looked at, but for the first camera's: all others are found from
/// scratch.
pub fn solve(
    rig: &Rig,
    body: &Shell,
    observations: &[Observation],
    freedom: &Freedom,
    progress: &mut dyn FnMut(usize, f64),
) -> Result<Solved, ExtrinsicsError> {
    let begin_ns = observations.iter().map(|o| o.capture_ns).min().ok_or(ExtrinsicsError::Nothing)?;
    let sights = sights(&rig.cameras, body, observations, begin_ns);
    for (camera, own) in rig.cameras.iter().zip(&sights) {
        if own.len() < LEAST_IMAGES {
            let (camera, images) = (camera.id.clone(), own.len());
            return Err(ExtrinsicsError::HardlySeen { camera, images, least: LEAST_IMAGES });
        }
    }
    let offsets_s = clock_offsets(rig, &sights, freedom);
    let mut found = rig.clone();
    if freedom.places {
        let places = graph::places(rig, &sights, &offsets_s)?;
        let world_from_first = rig.cameras[0].world_from_camera;
        for (camera, first_from_camera) in found.cameras.iter_mut().zip(places) {
            camera.world_from_camera = world_from_first * first_from_camera;
        }
    }
    let moving = freedom.clocks
        || freedom.line_times
        || rig.cameras.iter().any(|camera| camera.line_time_s > 0.0)
        || rig.sync_groups.iter().any(|group| *group != rig.sync_groups[0]);
    let (motion, instants) = motion(&found, &sights, &offsets_s, observations, begin_ns, moving)?;
    let eyes = found.cameras.iter().zip(&offsets_s).map(|(camera, offset_s)| Eye {
        camera: camera.clone(),
        offset_s: *offset_s,
        loose: EyeLoose::FIXED,
    });
    let sightings = observations.iter().zip(instants).filter_map(|(observation, instant)| {
        let known = observation.camera < rig.cameras.len() && observation.tag < body.tags.len();
        Sighting::of_tag(observation, instant?, begin_ns).filter(|_| known)
    });
    let mut problem =
        Problem { eyes: eyes.collect(), parts: Part::tags_of(body), motion, sightings: sightings.collect() };
    let outcome = adjust_by_stages(&mut problem, rig, freedom, progress);
    if !outcome.rms_px.is_finite() || outcome.outliers * 2 > problem.sightings.len() {
        let share = outcome.outliers as f64 / problem.sightings.len().max(1) as f64;
        return Err(ExtrinsicsError::NothingAgrees { share, rms_px: outcome.rms_px });
    }
    Ok(conclude(found, body, problem, outcome, freedom))
}

/// Images in which a camera must tell the body's pose.
const LEAST_IMAGES: usize = 5;

fn clock_offsets(rig: &Rig, sights: &[Vec<Sight>], freedom: &Freedom) -> Vec<f64> {
    let offset = |camera: usize| {
        let together = rig.sync_groups[camera] == rig.sync_groups[0];
        if !freedom.clocks || together {
            return 0.0;
        }
        // Whoever overlaps with the first camera says it directly; the others begin at 0.
        clocks::offset_s(&sights[0], &sights[camera]).unwrap_or(0.0)
    };
    (0..rig.cameras.len()).map(offset).collect()
}

/// The body's motion to begin with, and the instant of each observation (`None`: of no use).
fn motion(
    rig: &Rig,
    sights: &[Vec<Sight>],
    offsets_s: &[f64],
    observations: &[Observation],
    begin_ns: u64,
    moving: bool,
) -> Result<(Motion, Vec<Option<usize>>), ExtrinsicsError> {
    let mut poses: Vec<(f64, Isometry3<f64>)> = rig
        .cameras
        .iter()
        .zip(sights)
        .zip(offsets_s)
        .flat_map(|((camera, own), offset_s)| {
            own.iter().map(move |s| (s.capture_s + offset_s, camera.world_from_camera * s.camera_from_body))
        })
        .collect();
    poses.sort_by(|a, b| a.0.total_cmp(&b.0));
    let nearest = |time_s: f64| {
        let after = poses.partition_point(|(t, _)| *t < time_s).min(poses.len() - 1);
        let before = after.saturating_sub(1);
        if (poses[before].0 - time_s).abs() < (poses[after].0 - time_s).abs() {
            poses[before]
        } else {
            poses[after]
        }
    };
    let (Some(first), Some(last)) = (poses.first(), poses.last()) else {
        return Err(ExtrinsicsError::Nothing);
    };
    if moving {
        /// Longest time over which a pose is interpolated; beyond it the nearest one stands.
        const MOST_GAP_S: f64 = 1.0;
        let (first_s, last_s) = (first.0, last.0);
        let pose_at = |t: f64| interpolated(&poses, t, MOST_GAP_S).unwrap_or_else(|| nearest(t).1);
        let path = Path::through(first_s, last_s, step_s(sights), 0.25, pose_at);
        return Ok((Motion::Path(path), vec![Some(0); observations.len()]));
    }
    /// Frames that lie closer together are of one instant.
    const TOGETHER_NS: u64 = locoman_vision::source::SYNC_TOLERANCE_NS;
    let mut times: Vec<u64> = observations.iter().map(|o| o.capture_ns).collect();
    times.sort_unstable();
    times.dedup();
    let mut begins: Vec<u64> = Vec::new();
    for time in times {
        if begins.last().is_none_or(|begin| time - begin > TOGETHER_NS) {
            begins.push(time);
        }
    }
    // Instants of which no image tells the pose are left out.
    let mut kept = Vec::new();
    let numbers: Vec<Option<usize>> = begins
        .iter()
        .map(|begin| {
            let time_s = (begin - begin_ns) as f64 * 1e-9;
            let (t, pose) = nearest(time_s);
            ((t - time_s).abs() <= 2e-9 * TOGETHER_NS as f64).then(|| {
                kept.push(pose);
                kept.len() - 1
            })
        })
        .collect();
    let instants = observations.iter().map(|observation| {
        let k = begins.partition_point(|begin| *begin <= observation.capture_ns).checked_sub(1)?;
        numbers[k]
    });
    let instants = instants.collect();
    Ok((Motion::Instants(kept), instants))
}

/// Time between a path's controls: that between images, or a little less than a tremor needs.
fn step_s(sights: &[Vec<Sight>]) -> f64 {
    const LEAST_S: f64 = 0.02;
    const MOST_S: f64 = 0.04;
    let mut gaps: Vec<f64> = sights
        .iter()
        .flat_map(|own| own.windows(2).map(|pair| pair[1].capture_s - pair[0].capture_s))
        .collect();
    gaps.sort_by(f64::total_cmp);
    gaps.get(gaps.len() / 2).map_or(MOST_S, |gap_s| gap_s.clamp(LEAST_S, MOST_S))
}

/// Frees one thing after the other: places, clocks and tags first, intrinsics and rows when these are about right.
fn adjust_by_stages(
    problem: &mut Problem,
    rig: &Rig,
    freedom: &Freedom,
    progress: &mut dyn FnMut(usize, f64),
) -> Outcome {
    let rough =
        bundle::Settings { rounds: 1, steps: 15, outlier: f64::INFINITY, ..bundle::Settings::default() };
    let anchor = anchor(problem);
    for stage in 0..2 {
        for (k, eye) in problem.eyes.iter_mut().enumerate() {
            let place = if freedom.places && k > 0 { FREE } else { FIXED };
            let alone = k > 0 && rig.sync_groups[k] != rig.sync_groups[0];
            eye.loose.position = place;
            eye.loose.orientation = place;
            eye.loose.offset = if freedom.clocks && alone { FREE } else { FIXED };
            if stage == 1 {
                eye.loose.line_time = if freedom.line_times { FREE } else { FIXED };
                // A coefficient of exactly 0 is not part of the camera's model.
                let modelled = |k: usize| k < 4 || bundle::lens::value(&eye.camera, k) != 0.0;
                eye.loose.intrinsics = std::array::from_fn(|k| match k {
                    _ if freedom.intrinsics_px == 0.0 || !modelled(k) => FIXED,
                    0..4 => freedom.intrinsics_px,
                    _ => freedom.intrinsics_px * 1e-2,
                });
            }
        }
        for (k, part) in problem.parts.iter_mut().enumerate() {
            let tied = k == anchor;
            part.loose = match stage {
                0 => [0.0; 3],
                _ if tied => [0.0, 0.0, freedom.sizes],
                _ => [freedom.tags_m, freedom.tags_rad, freedom.sizes],
            };
        }
        if stage == 0 {
            bundle::adjust(problem, &rough, progress);
        }
    }
    if freedom.tags_m > 0.0 {
        bundle::adjust(problem, &rough, progress);
    }
    bundle::adjust(problem, &bundle::Settings::default(), progress)
}

/// The tag that is seen most.
fn anchor(problem: &Problem) -> usize {
    let mut counts = vec![0_usize; problem.parts.len()];
    problem.sightings.iter().for_each(|sighting| counts[sighting.part] += 1);
    (0..counts.len()).max_by_key(|k| counts[*k]).unwrap_or(0)
}

fn conclude(mut rig: Rig, body: &Shell, problem: Problem, outcome: Outcome, freedom: &Freedom) -> Solved {
    rig.cameras = bundle::cameras(&problem);
    let mut body = body.clone();
    for (tag, part) in body.tags.iter_mut().zip(&problem.parts) {
        tag.shell_from_tag = part.object_from_part;
        tag.size_m *= part.scale;
    }
    let offsets_s = problem.eyes.iter().map(|eye| eye.offset_s).collect();
    let anchor = (freedom.tags_m > 0.0).then(|| anchor(&problem));
    Solved { rig, offsets_s, body, problem, outcome, anchor }
}
