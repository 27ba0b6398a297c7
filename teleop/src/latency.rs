//! Latency by stage: durations of the last seconds, and their percentiles.

use std::collections::VecDeque;

/// Samples kept for each stage: about four seconds of commands.
const KEPT: usize = 240;

/// The stages, in the order of a frame's way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Stage {
    Decode,
    Detect,
    Solve,
    /// The last image of an instant, decoded in memory, to its poses published.
    InMemory,
    /// Capture to solved.
    Solved,
    /// Solved to sent.
    Map,
    /// Sent to received by the robot.
    Link,
    /// Received to applied by the robot.
    Apply,
    /// Capture to applied.
    Total,
}

impl Stage {
    /// All.
    pub const ALL: [Self; 9] = [
        Self::Decode,
        Self::Detect,
        Self::Solve,
        Self::InMemory,
        Self::Solved,
        Self::Map,
        Self::Link,
        Self::Apply,
        Self::Total,
    ];

    /// For people and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Decode => "decode",
            Self::Detect => "detect",
            Self::Solve => "solve",
            Self::InMemory => "image to pose",
            Self::Solved => "capture to pose",
            Self::Map => "pose to command",
            Self::Link => "link",
            Self::Apply => "robot",
            Self::Total => "capture to motion",
        }
    }
}

/// The last durations of every stage.
#[derive(Debug, Default)]
pub struct Latency {
    samples: [VecDeque<u64>; 9],
}

impl Latency {
    /// Adds a duration.
    pub fn add(&mut self, stage: Stage, ns: u64) {
        let samples = &mut self.samples[stage as usize];
        if samples.len() == KEPT {
            samples.pop_front();
        }
        samples.push_back(ns);
    }

    /// Median and 99th percentile of a stage; `None` before its first sample.
    pub fn percentiles_ns(&self, stage: Stage) -> Option<(u64, u64)> {
        let mut sorted: Vec<u64> = self.samples[stage as usize].iter().copied().collect();
        sorted.sort_unstable();
        // Nearest rank.
        let rank =
            |share: f64| sorted.get(((share * sorted.len() as f64).ceil() as usize).max(1) - 1).copied();
        Some((rank(0.5)?, rank(0.99)?))
    }

    /// Forgets everything that a robot has contributed: it is gone.
    pub fn forget_robot(&mut self) {
        for stage in [Stage::Link, Stage::Apply, Stage::Total] {
            self.samples[stage as usize].clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_of_the_last_samples_by_nearest_rank() {
        let mut sut = Latency::default();
        assert_eq!(sut.percentiles_ns(Stage::Link), None);
        sut.add(Stage::Link, 5);
        assert_eq!(sut.percentiles_ns(Stage::Link), Some((5, 5)));
        for ns in (0..1000).rev() {
            sut.add(Stage::Link, ns);
        }
        // 239 .. 0 are left.
        assert_eq!(sut.percentiles_ns(Stage::Link), Some((119, 237)));
        sut.forget_robot();
        assert_eq!(sut.percentiles_ns(Stage::Link), None);
    }
}
