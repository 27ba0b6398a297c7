//! Where a body is before each camera, image by image: what the joint adjustment starts from.

use std::collections::BTreeMap;

use locoman_vision::camera::Camera;
use locoman_vision::pose::{Observation, Solver, SolverSettings, Views};
use locoman_vision::shells::Shell;
use nalgebra::Isometry3;
use rayon::prelude::*;

/// A body before one camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sight {
    /// Seconds after the recording's begin, by the camera's clock.
    pub capture_s: f64,
    pub camera_from_body: Isometry3<f64>,
}

/// Poses of the body before each camera, by rising time; images that do not tell the pose are left out.
pub(super) fn sights(
    cameras: &[Camera],
    body: &Shell,
    observations: &[Observation],
    begin_ns: u64,
) -> Vec<Vec<Sight>> {
    let mut images: BTreeMap<(usize, u64), Vec<Observation>> = BTreeMap::new();
    for observation in observations.iter().filter(|o| o.camera < cameras.len()) {
        images.entry((observation.camera, observation.capture_ns)).or_default().push(observation.clone());
    }
    let alone: Vec<Camera> = cameras
        .iter()
        .map(|camera| Camera { world_from_camera: Isometry3::identity(), ..camera.clone() })
        .collect();
    // Tags may be millimetres from where they are drawn: what does not fit well is still a start.
    let settings =
        SolverSettings { outlier_floor_px: 8.0, corner_floor_px: 0.5, ..SolverSettings::default() };
    let images: Vec<((usize, u64), Vec<Observation>)> = images.into_iter().collect();
    let solved: Vec<(usize, Sight)> = images
        .par_iter()
        .filter_map(|((camera, capture_ns), observations)| {
            let views =
                Views { shell: body, cameras: &alone, observations, time_ns: *capture_ns, variance: 1.0 };
            let solution = Solver::default().afresh(&views, &settings).ok()?;
            let capture_s = (i128::from(*capture_ns) - i128::from(begin_ns)) as f64 * 1e-9;
            Some((*camera, Sight { capture_s, camera_from_body: solution.state.world_from_shell }))
        })
        .collect();
    let mut sights = vec![Vec::new(); cameras.len()];
    for (camera, sight) in solved {
        sights[camera].push(sight);
    }
    sights
}

/// The pose at a time, or between two neighbours in time that are at most `most_gap_s` apart.
pub(super) fn interpolated(
    sights: &[(f64, Isometry3<f64>)],
    time_s: f64,
    most_gap_s: f64,
) -> Option<Isometry3<f64>> {
    /// Exposed together, though written down a little apart.
    const SAME_S: f64 = 1e-3;
    let after = sights.partition_point(|(t, _)| *t < time_s);
    let (late, early) = (sights.get(after), after.checked_sub(1).and_then(|before| sights.get(before)));
    let same = |sight: &&(f64, Isometry3<f64>)| (sight.0 - time_s).abs() <= SAME_S;
    if let Some(sight) = late.filter(same).or(early.filter(same)) {
        return Some(sight.1);
    }
    let (late, early) = (late?, early?);
    let gap_s = late.0 - early.0;
    if gap_s > most_gap_s {
        return None;
    }
    let share = if gap_s > 0.0 { (time_s - early.0) / gap_s } else { 0.0 };
    early.1.try_lerp_slerp(&late.1, share, 1e-9)
}
