//! Cameras round a hand, a hand that waves, and what the cameras report of it.

use locoman_calib::rehearsal::{Reading, observe};
use locoman_vision::camera::{Camera, Distortion};
use locoman_vision::pose::Observation;
use locoman_vision::rig::Rig;
use locoman_vision::shells::Shell;
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Random numbers of one experiment.
pub struct Draw(ChaCha8Rng);

impl Draw {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// Zero mean, unit variance.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.0.random::<f64>()).sum::<f64>() - 6.0
    }

    pub fn normals(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| sigma * self.normal())
    }
}

/// A camera at a point that looks at another, upright.
pub fn looking(eye: Vector3<f64>, target: Vector3<f64>) -> Isometry3<f64> {
    let z = (target - eye).normalize();
    let x = z.cross(&Vector3::z()).normalize();
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    Isometry3::from_parts(eye.into(), UnitQuaternion::from_rotation_matrix(&axes))
}

/// A camera of 1280x720 pixels.
pub fn camera(
    k: usize,
    focal_px: f64,
    distortion: Distortion,
    place: Isometry3<f64>,
    line_time_s: f64,
) -> Camera {
    Camera {
        id: format!("camera_{k}"),
        width: 1280,
        height: 720,
        focal_px: Vector2::new(focal_px, focal_px * 1.001),
        center_px: Vector2::new(640.0, 360.0),
        distortion,
        world_from_camera: place,
        line_time_s,
    }
}

/// How a hand waves something: sums of sines, to 0.4 m/s and 150 degrees a second.
pub struct Wave {
    base: Isometry3<f64>,
    shift_m: [[f64; 3]; 3],
    tilt_rad: [[f64; 3]; 3],
    hertz: [[f64; 3]; 2],
}

impl Wave {
    pub fn new(base: Isometry3<f64>, reach_m: f64, tilt_rad: f64, draw: &mut Draw) -> Self {
        let mut terms = |size: f64| {
            std::array::from_fn(|_| {
                [size * draw.between(0.6, 1.0), draw.between(0.0, 6.3), draw.between(0.0, 6.3)]
            })
        };
        let (shift_m, tilt_rad) = (terms(reach_m), terms(tilt_rad));
        let hertz = std::array::from_fn(|_| std::array::from_fn(|_| draw.between(0.15, 0.35)));
        Self { base, shift_m, tilt_rad, hertz }
    }

    /// `world_from_body`, seconds after the beginning.
    pub fn at(&self, t: f64) -> Isometry3<f64> {
        let term = |[size, phase, tremor]: [f64; 3], hertz: f64| {
            let slow = (std::f64::consts::TAU * hertz * t + phase).sin();
            let quick = (std::f64::consts::TAU * 1.3 * t + tremor).sin();
            size * (slow + 0.08 * quick)
        };
        let shift = Vector3::from_fn(|k, _| term(self.shift_m[k], self.hertz[0][k]));
        let tilt = Vector3::from_fn(|k, _| term(self.tilt_rad[k], self.hertz[1][k]));
        let shifted = nalgebra::Translation3::from(shift) * self.base;
        shifted * UnitQuaternion::from_scaled_axis(tilt)
    }
}

/// What all cameras report of a body; `offsets_s` is what has to be added to their clocks.
pub fn record(
    rig: &Rig,
    body: &Shell,
    wave: &dyn Fn(f64) -> Isometry3<f64>,
    offsets_s: &[f64],
    (seconds, hertz): (f64, f64),
    draw: &mut Draw,
) -> Vec<Observation> {
    /// Clocks need not begin at 0.
    const BEGIN_NS: u64 = 10_000_000_000;
    let mut observations = Vec::new();
    for (index, camera) in rig.cameras.iter().enumerate() {
        for frame in 0..(seconds * hertz) as u64 {
            let capture_s = frame as f64 / hertz;
            let capture_ns = BEGIN_NS + (capture_s * 1e9) as u64;
            let true_s = capture_s + offsets_s[index];
            let mut normal = || draw.normal();
            let reading = Reading::default();
            observations.extend(observe(
                body,
                camera,
                index,
                capture_ns,
                true_s,
                wave,
                &reading,
                &mut normal,
            ));
        }
    }
    observations
}
