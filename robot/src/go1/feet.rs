//! From the pressure in the feet's air bags to the force of the ground, and back for the virtual robot.

use serde::Deserialize;

/// `[feet]` of `go1.toml`; FR, FL, RR, RL. A straight line for each foot: `N = (counts - zero) * newton_per_count`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Feet {
    /// Counts in the air.
    pub zero_counts: [i16; 4],
    /// N for each count.
    pub newton_per_count: [f64; 4],
}

impl Default for Feet {
    fn default() -> Self {
        Self { zero_counts: [120, 90, 100, 110], newton_per_count: [0.25; 4] }
    }
}

impl Feet {
    /// Vertical force of each foot, N.
    pub fn force_n(&self, counts: &[i16]) -> [f64; 4] {
        std::array::from_fn(|foot| {
            let above = f64::from(counts[foot]) - f64::from(self.zero_counts[foot]);
            above * self.newton_per_count[foot]
        })
    }

    /// What the sensors count under these forces, N.
    pub fn counts(&self, force_n: &[f64; 4]) -> [i16; 4] {
        std::array::from_fn(|foot| {
            let counts = force_n[foot] / self.newton_per_count[foot] + f64::from(self.zero_counts[foot]);
            counts.round() as i16
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_come_back_within_half_a_count() {
        let (sut, force_n) = (Feet::default(), [0.0, 33.3, -1.2, 200.0]);
        let back = sut.force_n(&sut.counts(&force_n));
        for foot in 0..4 {
            assert!((back[foot] - force_n[foot]).abs() <= 0.5 * sut.newton_per_count[foot]);
        }
    }
}
