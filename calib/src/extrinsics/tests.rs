//! Rigs from scratch against the truth, and recordings that cannot be used.

use locoman_vision::camera::{Camera, Distortion};
use locoman_vision::pose::Observation;
use locoman_vision::rig::Rig;
use locoman_vision::shells::{Shell, design};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::rehearsal::{Reading, observe};

fn looking(eye: [f64; 3]) -> Isometry3<f64> {
    let eye = Vector3::from(eye);
    let z = (Vector3::new(0.0, 0.0, 1.1) - eye).normalize();
    let x = z.cross(&Vector3::z()).normalize();
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    Isometry3::from_parts(eye.into(), UnitQuaternion::from_rotation_matrix(&axes))
}

/// Four cameras round the body: the first and the last never see the same side of it.
fn rig() -> Rig {
    let places = [[0.8, -0.2, 1.3], [0.5, 0.7, 1.2], [-0.5, 0.65, 1.3], [-0.8, -0.1, 1.4]];
    let camera = |(k, eye): (usize, [f64; 3])| Camera {
        id: format!("c{k}"),
        width: 1280,
        height: 720,
        focal_px: Vector2::new(950.0 + k as f64, 951.0),
        center_px: Vector2::new(641.0, 357.0),
        distortion: Distortion::RadTan([-0.09, 0.03, 3e-4, -2e-4, 0.0, 0.0, 0.0, 0.0]),
        world_from_camera: looking(eye),
        line_time_s: if k == 2 { 22e-6 } else { 0.0 },
    };
    let mut rig = Rig::new(places.into_iter().enumerate().map(camera).collect());
    rig.sync_groups = vec![0, 0, 1, 2];
    rig
}

fn palm() -> Shell {
    design::standard().shells.into_iter().find(|shell| shell.name == "right_palm").expect("there is one")
}

fn waved(t: f64) -> Isometry3<f64> {
    let tilt = Vector3::new(0.9 * (1.7 * t).sin(), 0.8 * (1.3 * t + 1.0).sin(), 2.0 * (0.5 * t).sin());
    let shift = Vector3::new(0.1 * (1.3 * t).sin(), 0.1 * (1.9 * t).sin(), 1.1 + 0.08 * (2.3 * t).cos());
    Isometry3::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(tilt))
}

const OFFSETS_S: [f64; 4] = [0.0, 0.0, 0.131, -0.047];

fn recording(rig: &Rig, body: &Shell, seconds: f64) -> Vec<Observation> {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let mut observations = Vec::new();
    for (index, camera) in rig.cameras.iter().enumerate() {
        for frame in 0..(seconds * 30.0) as u64 {
            let capture_s = frame as f64 / 30.0;
            let capture_ns = 5_000_000_000 + (capture_s * 1e9) as u64;
            let true_s = capture_s + OFFSETS_S[index];
            observations.extend(observe(
                body,
                camera,
                index,
                capture_ns,
                true_s,
                &waved,
                &Reading::default(),
                &mut normal,
            ));
        }
    }
    observations
}

#[test]
fn cameras_and_clocks_are_found_from_a_waved_palm() {
    let truth = rig();
    let body = palm();
    let observations = recording(&truth, &body, 15.0);
    let mut unknown = truth.clone();
    unknown.cameras[1..].iter_mut().for_each(|camera| camera.world_from_camera = Isometry3::identity());
    let freedom = Freedom { clocks: true, ..Freedom::PLACES };
    let sut = solve(&unknown, &body, &observations, &freedom, &mut |_, _| {}).expect("solved");
    assert!((sut.outcome.variance - 1.0).abs() < 0.1, "{} {}", sut.outcome.variance, sut.outcome.rms_px);
    for (k, (found, known)) in sut.rig.cameras.iter().zip(&truth.cameras).enumerate() {
        let error = known.world_from_camera.inverse() * found.world_from_camera;
        assert!(error.translation.vector.norm() < 3e-4 && error.rotation.angle() < 3.5e-4, "{k} {error}");
        assert!((sut.offsets_s[k] - OFFSETS_S[k]).abs() < 3e-4, "{k} {}", sut.offsets_s[k]);
    }
    // A world where the palm was at some moment.
    let world_from_body = Isometry3::translation(0.0, 0.0, 0.5);
    let placed = World::Body { at_s: 3.0, world_from_body }.place(&sut).expect("inside");
    let moved = world_from_body * waved(3.0).inverse() * truth.cameras[0].world_from_camera;
    let error = moved.inverse() * placed.cameras[0].world_from_camera;
    assert!(error.translation.vector.norm() < 1e-3, "{error}");
}

#[test]
fn cameras_that_never_see_it_together_are_named() {
    let truth = rig();
    let body = palm();
    let mut observations = recording(&truth, &body, 8.0);
    observations.retain(|o| (o.capture_ns < 9_000_000_000) == (o.camera < 2));
    let freedom = Freedom::PLACES;
    let error = solve(&truth, &body, &observations, &freedom, &mut |_, _| {}).expect_err("apart");
    assert!(
        matches!(&error, ExtrinsicsError::NeverTogether { apart, together, .. } if apart == "c2, c3" && together == "c0, c1"),
        "{error}"
    );
    observations.retain(|o| o.camera != 3);
    let error = solve(&truth, &body, &observations, &freedom, &mut |_, _| {}).expect_err("not seen");
    assert!(matches!(&error, ExtrinsicsError::HardlySeen { camera, .. } if camera == "c3"), "{error}");
}
