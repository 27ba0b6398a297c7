//! Means, root mean squares and percentiles of samples.

/// Mean; not a number for no samples.
pub fn mean(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len() as f64
}

/// Root of the mean of the squares; not a number for no samples.
pub fn rms(samples: &[f64]) -> f64 {
    mean(&samples.iter().map(|sample| sample * sample).collect::<Vec<_>>()).sqrt()
}

/// The sample below which this share of all lies (nearest rank); not a number for no samples.
pub fn percentile(samples: &[f64], share: f64) -> f64 {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_samples() {
        let samples: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        assert_eq!(percentile(&samples, 0.5), 50.0);
        assert_eq!(percentile(&samples, 0.99), 99.0);
        assert_eq!(percentile(&samples, 1.0), 100.0);
        assert!(percentile(&[], 0.5).is_nan() && mean(&[]).is_nan());
    }
}
