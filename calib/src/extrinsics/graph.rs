//! Where cameras stand against each other, from what pairs of them see together: a spanning tree of the surest pairs.

use locoman_vision::rig::Rig;
use nalgebra::Isometry3;

use super::ExtrinsicsError;
use super::poses::{Sight, interpolated};

/// Moments in which two cameras must see the body together.
const LEAST_SHARED: usize = 5;

/// `first_from_camera` of every camera.
pub(super) fn places(
    rig: &Rig,
    sights: &[Vec<Sight>],
    offsets_s: &[f64],
) -> Result<Vec<Isometry3<f64>>, ExtrinsicsError> {
    /// Poses further apart in time are not interpolated, seconds.
    const MOST_GAP_S: f64 = 0.08;
    let timed: Vec<Vec<(f64, Isometry3<f64>)>> = sights
        .iter()
        .zip(offsets_s)
        .map(|(own, offset_s)| own.iter().map(|s| (s.capture_s + offset_s, s.camera_from_body)).collect())
        .collect();
    let shared = |a: usize, b: usize| -> Vec<Isometry3<f64>> {
        let pair = |(t, pose): &(f64, Isometry3<f64>)| {
            let other = interpolated(&timed[b], *t, MOST_GAP_S)?;
            Some(pose * other.inverse())
        };
        timed[a].iter().filter_map(pair).collect()
    };
    let count = rig.cameras.len();
    let mut places: Vec<Option<Isometry3<f64>>> = vec![None; count];
    places[0] = Some(Isometry3::identity());
    let edges: Vec<(usize, usize, Vec<Isometry3<f64>>)> = (0..count)
        .flat_map(|a| (0..count).filter(move |b| *b != a).map(move |b| (a, b)))
        .map(|(a, b)| (a, b, shared(a, b)))
        .filter(|(_, _, shared)| shared.len() >= LEAST_SHARED)
        .collect();
    loop {
        let next = edges
            .iter()
            .filter(|(a, b, _)| places[*a].is_some() && places[*b].is_none())
            .max_by_key(|(_, _, shared)| shared.len());
        let Some((a, b, candidates)) = next else { break };
        let (Some(place), Some(step)) = (places[*a], medoid(candidates)) else { break };
        places[*b] = Some(place * step);
    }
    let apart: Vec<String> =
        (0..count).filter(|k| places[*k].is_none()).map(|k| rig.cameras[k].id.clone()).collect();
    let together: Vec<String> =
        (0..count).filter(|k| places[*k].is_some()).map(|k| rig.cameras[k].id.clone()).collect();
    let found: Option<Vec<Isometry3<f64>>> = places.into_iter().collect();
    found.ok_or_else(|| ExtrinsicsError::NeverTogether {
        apart: apart.join(", "),
        together: together.join(", "),
        least: LEAST_SHARED,
    })
}

/// The candidate that is nearest to half of the others.
fn medoid(candidates: &[Isometry3<f64>]) -> Option<Isometry3<f64>> {
    /// Enough to outvote flipped poses; all of them would take a time that grows with their square.
    const MOST: usize = 120;
    let some: Vec<&Isometry3<f64>> =
        candidates.iter().step_by(candidates.len().div_ceil(MOST).max(1)).collect();
    let far = |a: &Isometry3<f64>| {
        let mut distances: Vec<f64> = some
            .iter()
            .map(|b| (a.translation.vector - b.translation.vector).norm() + a.rotation.angle_to(&b.rotation))
            .collect();
        distances.sort_by(f64::total_cmp);
        distances[distances.len() / 2]
    };
    some.iter().min_by(|a, b| far(a).total_cmp(&far(b))).map(|best| **best)
}
