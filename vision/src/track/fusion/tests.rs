//! The tracker on corners alone: what cameras would report of shells that move, without images.

use nalgebra::{Isometry3, Vector3};

use super::*;
use crate::camera::Camera;
use crate::detect::Detection;
use crate::shells::Shell;
use crate::testing::{self, Noise};
use crate::track::{Fate, SeenTag, Verdict};

mod clocks;
mod covariance;
mod harm;
mod moved;

const MS: u64 = 1_000_000;
const STEP_NS: u64 = 33_333_333;
const START_NS: u64 = 1_000_000_000;
const SIGMA_PX: f64 = 0.05;

/// Cameras with rolling shutters; the pairs are exposed 11 ms apart.
fn rig() -> Rig {
    let mut rig = testing::rig();
    rig.cameras.iter_mut().for_each(|camera| camera.line_time_s = 15.7e-6);
    rig
}

fn capture_ns(camera: usize, step: u64) -> u64 {
    START_NS + step * STEP_NS + if camera < 2 { 0 } else { 11 * MS }
}

/// All that is, is known: no floor.
fn settings() -> TrackerSettings {
    let mut settings = TrackerSettings::default();
    settings.solver.corner_floor_px = 0.0;
    settings
}

/// All shells wave about where they are worn, at up to 1 m/s and 360 degrees a second.
fn pose_at(shell: usize, t_s: f64) -> Isometry3<f64> {
    let shift = Vector3::new(0.05 * (3.0 * t_s).sin(), 0.14 * (7.0 * t_s).sin(), 0.06 * (4.0 * t_s).sin());
    let turn = Isometry3::new(Vector3::zeros(), Vector3::new(0.1, 0.8 * (7.8 * t_s).sin(), 0.2 * t_s.cos()));
    Isometry3::from(shift) * testing::worn()[shell] * turn
}

/// What a camera reports of a shell that moves so.
fn seen(
    cameras: &[Camera],
    camera: usize,
    described: &Shell,
    capture_ns: u64,
    pose_at: &dyn Fn(f64) -> Isometry3<f64>,
    noise: &mut Noise,
) -> Vec<SeenTag> {
    let observations = testing::observe(described, cameras, camera, capture_ns, pose_at, SIGMA_PX, noise);
    let tag = |observation: Observation| {
        let detection = Detection {
            id: described.tags[observation.tag].id,
            hamming: 0,
            margin: 60.0,
            corners_px: observation.corners_px,
            decimate: 1.0,
            covariance_px2: Some(observation.covariance_px2),
        };
        let shell = testing::shells().shell_index(&described.name).expect("known");
        SeenTag::new(detection, shell, observation.tag)
    };
    observations.into_iter().map(tag).collect()
}

/// What one camera reports at a step of these shells, which move so.
fn moving_frame(
    sut: &Fusion,
    camera: usize,
    step: u64,
    shells: &[usize],
    pose_at: &dyn Fn(usize, f64) -> Isometry3<f64>,
    noise: &mut Noise,
) -> CameraUpdate {
    let capture_ns = capture_ns(camera, step);
    let mut update = CameraUpdate::nothing(camera, capture_ns);
    for &shell in shells {
        let (described, cameras) = (&sut.shells().shells[shell], &sut.rig().cameras);
        update.tags.extend(seen(cameras, camera, described, capture_ns, &|t_s| pose_at(shell, t_s), noise));
    }
    update
}

/// What one camera reports of these shells at a step.
fn frame(sut: &Fusion, camera: usize, step: u64, shells: &[usize], noise: &mut Noise) -> CameraUpdate {
    moving_frame(sut, camera, step, shells, &pose_at, noise)
}

fn frames(sut: &Fusion, step: u64, shells: &[usize], noise: &mut Noise) -> Vec<CameraUpdate> {
    (0..sut.rig().cameras.len()).map(|camera| frame(sut, camera, step, shells, noise)).collect()
}

/// Distance in metres and radians of an update's pose from the truth.
fn error(update: &TrackUpdate, shell: usize) -> (f64, f64) {
    let truth = pose_at(shell, update.time_ns as f64 * 1e-9);
    let error = truth.inverse() * update.shells[shell].world_from_shell.expect("a pose");
    (error.translation.vector.norm(), error.rotation.angle())
}

fn sut() -> Fusion {
    Fusion::new(rig(), testing::shells(), settings())
}
