//! How far cameras' clocks are apart, before anything is known of where the cameras stand.
//!
//! How fast a body turns is the same in every frame of reference: the angular speeds that two cameras see are shifted
//! against each other until they agree best.

use super::poses::Sight;

/// Samples a second of the speeds that are compared.
const RATE_HZ: f64 = 100.0;
/// Longest shift that is tried, seconds.
const MOST_S: f64 = 0.6;
/// Least correlation that is believed.
const LEAST_CORRELATION: f64 = 0.6;
/// Samples that must overlap: two seconds.
const LEAST_SAMPLES: usize = 200;

/// What has to be added to the other camera's capture times to bring them to the first's clock; `None` if their speeds
/// do not tell.
pub(super) fn offset_s(first: &[Sight], other: &[Sight]) -> Option<f64> {
    let (a, b) = (speeds(first), speeds(other));
    let most = (MOST_S * RATE_HZ) as i64;
    let scores: Vec<f64> = (-most..=most).map(|lag| correlation(&a, &b, lag)).collect();
    let best = (0..scores.len()).max_by(|i, j| scores[*i].total_cmp(&scores[*j]))?;
    if scores[best] < LEAST_CORRELATION {
        return None;
    }
    // The top of the parabola through the best and its neighbours.
    let finer = match (best.checked_sub(1).map(|k| scores[k]), scores.get(best + 1)) {
        (Some(low), Some(high)) => {
            let bend = low - 2.0 * scores[best] + high;
            if bend < 0.0 { 0.5 * (low - high) / bend } else { 0.0 }
        }
        _ => 0.0,
    };
    Some((best as f64 - most as f64 + finer) / RATE_HZ)
}

/// Angular speed, rad/s, by the number of its sample of time.
fn speeds(sights: &[Sight]) -> std::collections::BTreeMap<i64, f64> {
    /// Longer gaps say nothing of the speed within.
    const MOST_GAP_S: f64 = 0.15;
    let middle: Vec<(f64, f64)> = sights
        .windows(2)
        .filter_map(|pair| {
            let gap_s = pair[1].capture_s - pair[0].capture_s;
            let angle = pair[0].camera_from_body.rotation.angle_to(&pair[1].camera_from_body.rotation);
            (gap_s > 0.0 && gap_s < MOST_GAP_S)
                .then(|| (0.5 * (pair[0].capture_s + pair[1].capture_s), (angle / gap_s).min(20.0)))
        })
        .collect();
    let mut sampled = std::collections::BTreeMap::new();
    for pair in middle.windows(2) {
        let ((t0, w0), (t1, w1)) = (pair[0], pair[1]);
        if t1 - t0 > MOST_GAP_S {
            continue;
        }
        for k in (t0 * RATE_HZ).ceil() as i64..=(t1 * RATE_HZ).floor() as i64 {
            sampled.insert(k, w0 + (w1 - w0) * (k as f64 / RATE_HZ - t0) / (t1 - t0));
        }
    }
    sampled
}

/// Of the first's speeds and the other's, `lag` samples later by the first's clock; −1 if too few overlap.
fn correlation(
    first: &std::collections::BTreeMap<i64, f64>,
    other: &std::collections::BTreeMap<i64, f64>,
    lag: i64,
) -> f64 {
    let pairs: Vec<(f64, f64)> =
        other.iter().filter_map(|(k, speed)| Some((*first.get(&(k + lag))?, *speed))).collect();
    if pairs.len() < LEAST_SAMPLES {
        return -1.0;
    }
    let count = pairs.len() as f64;
    let (ma, mb) = pairs.iter().fold((0.0, 0.0), |(a, b), pair| (a + pair.0 / count, b + pair.1 / count));
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (a, b) in pairs {
        aa += (a - ma) * (a - ma);
        bb += (b - mb) * (b - mb);
        ab += (a - ma) * (b - mb);
    }
    if aa * bb > 0.0 { ab / (aa * bb).sqrt() } else { -1.0 }
}
