//! A pose as a function of time, from samples.

use nalgebra::Isometry3;

/// No interpolation across a longer gap: something was lost there.
const MAX_GAP_NS: u64 = 100_000_000;

/// Samples of a pose, by rising time.
#[derive(Debug, Clone, Default)]
pub struct Track {
    samples: Vec<(u64, Isometry3<f64>)>,
}

impl Track {
    /// Takes samples in any order.
    pub fn new(mut samples: Vec<(u64, Isometry3<f64>)>) -> Self {
        samples.sort_by_key(|(time_ns, _)| *time_ns);
        samples.dedup_by_key(|(time_ns, _)| *time_ns);
        Self { samples }
    }

    /// The pose at a time: straight between samples, on the shortest arc; nothing outside or in a gap.
    pub fn at(&self, time_ns: u64) -> Option<Isometry3<f64>> {
        let after = self.samples.partition_point(|(sample_ns, _)| *sample_ns < time_ns);
        let (b_ns, b) = self.samples.get(after)?;
        if *b_ns == time_ns {
            return Some(*b);
        }
        let (a_ns, a) = self.samples.get(after.checked_sub(1)?)?;
        let gap_ns = b_ns - a_ns;
        if gap_ns > MAX_GAP_NS {
            return None;
        }
        let share = (time_ns - a_ns) as f64 / gap_ns as f64;
        a.try_lerp_slerp(b, share, 1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn a_pose_between_samples_is_between_them() {
        let end = Isometry3::new(Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.4));
        let sut = Track::new(vec![(20_000_000, end), (10_000_000, Isometry3::identity())]);
        let middle = sut.at(15_000_000).unwrap();
        assert!((middle.translation.x - 0.5).abs() < 1e-12 && (middle.rotation.angle() - 0.2).abs() < 1e-12);
        assert_eq!(sut.at(20_000_000), Some(end));
        assert!(sut.at(9_999_999).is_none() && sut.at(20_000_001).is_none());
    }

    #[test]
    fn a_gap_is_not_bridged() {
        let sut = Track::new(vec![(0, Isometry3::identity()), (200_000_000, Isometry3::identity())]);
        assert!(sut.at(100_000_000).is_none());
    }
}
