//! Turns samples that arrive at 30 to 120 Hz, with jitter, into a motion without steps.
//!
//! Each new sample is approached on a straight line over the usual interval between samples, so the ramp
//! lags by about one interval, whatever the jitter of a single one.

use nalgebra::Isometry3;

/// Shortest and longest interval that counts as one between samples, ns: 120 Hz and 20 Hz.
const INTERVAL_RANGE_NS: (f64, f64) = (8e6, 50e6);
/// Share of a new interval in the mean.
const FORGETTING: f64 = 0.1;

/// The usual interval between samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleClock {
    last_ns: Option<u64>,
    interval_ns: f64,
}

impl Default for SampleClock {
    fn default() -> Self {
        Self { last_ns: None, interval_ns: 1e9 / 60.0 }
    }
}

impl SampleClock {
    /// A sample has arrived.
    pub fn tick(&mut self, received_ns: u64) {
        if let Some(last_ns) = self.last_ns.replace(received_ns) {
            let interval = received_ns.saturating_sub(last_ns) as f64;
            let interval = interval.clamp(INTERVAL_RANGE_NS.0, INTERVAL_RANGE_NS.1);
            self.interval_ns += FORGETTING * (interval - self.interval_ns);
        }
    }

    /// Mean interval, ns.
    pub fn interval_ns(&self) -> f64 {
        self.interval_ns
    }
}

/// A straight way from one pose to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    from: Isometry3<f64>,
    to: Isometry3<f64>,
    start_ns: u64,
    span_ns: f64,
}

impl Ramp {
    /// Rests at a pose.
    pub fn at(pose: &Isometry3<f64>) -> Self {
        Self { from: *pose, to: *pose, start_ns: 0, span_ns: 1.0 }
    }

    /// Goes on from where it is to a new sample.
    pub fn append(&mut self, sample: &Isometry3<f64>, clock: &SampleClock, now_ns: u64) {
        *self =
            Self { from: self.at_time(now_ns), to: *sample, start_ns: now_ns, span_ns: clock.interval_ns() };
    }

    /// Where it is.
    pub fn at_time(&self, now_ns: u64) -> Isometry3<f64> {
        let share = (now_ns.saturating_sub(self.start_ns) as f64 / self.span_ns).min(1.0);
        let point = self.from.translation.vector.lerp(&self.to.translation.vector, share);
        let rotation = (self.to.rotation * self.from.rotation.inverse()).powf(share) * self.from.rotation;
        Isometry3::from_parts(point.into(), rotation)
    }
}
