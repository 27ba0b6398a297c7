//! When pictures are taken: at a steady rate, by each camera with its own phase.

use super::studio::Studio;

/// Capture time of scene time 0: a round number, so that times are easy to read.
pub const FIRST_CAPTURE_NS: u64 = 1_000_000_000;

/// When pictures are taken.
#[derive(Debug, Clone, Copy)]
pub struct Schedule {
    /// Pictures of each camera.
    pub count: u64,
    /// Pictures a second.
    pub rate_hz: f64,
}

impl Schedule {
    /// As many as fit into a length of time.
    pub fn new(seconds: f64, rate_hz: f64) -> anyhow::Result<Self> {
        anyhow::ensure!(
            (0.1..=1000.0).contains(&rate_hz),
            "--rate {rate_hz}: must lie between 0.1 and 1000 images a second"
        );
        let count = (seconds * rate_hz).round();
        anyhow::ensure!(
            (1.0..1e7).contains(&count),
            "--seconds {seconds} at {rate_hz} Hz are {count} images: give a longer time"
        );
        Ok(Self { count: count as u64, rate_hz })
    }

    /// Scene time of a picture of a camera without a phase.
    pub fn time_s(&self, number: u64) -> f64 {
        number as f64 / self.rate_hz
    }

    /// All moments in the order of time: pictures of cameras with the same phase are taken together.
    pub fn moments(&self, studio: &Studio) -> Vec<Moment> {
        let mut phases: Vec<(f64, Vec<usize>)> = Vec::new();
        for camera in 0..studio.cameras().len() {
            let phase_s = studio.phase_s(camera).rem_euclid(1.0 / self.rate_hz);
            match phases.iter_mut().find(|(known_s, _)| *known_s == phase_s) {
                Some((_, cameras)) => cameras.push(camera),
                None => phases.push((phase_s, vec![camera])),
            }
        }
        phases.sort_by(|a, b| a.0.total_cmp(&b.0));
        (0..self.count)
            .flat_map(|frame| {
                phases.iter().map(move |(phase_s, cameras)| {
                    let time_s = self.time_s(frame) + phase_s;
                    Moment { time_s, capture_ns: capture_ns(time_s), frame, cameras: cameras.clone() }
                })
            })
            .collect()
    }
}

/// Pictures that are taken at the same time.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Scene time.
    pub time_s: f64,
    /// Capture time.
    pub capture_ns: u64,
    /// How many pictures each of these cameras took before.
    pub frame: u64,
    /// By their places in the rig.
    pub cameras: Vec<usize>,
}

/// The capture time of a scene time.
pub fn capture_ns(time_s: f64) -> u64 {
    FIRST_CAPTURE_NS + (time_s * 1e9).round() as u64
}
