//! Shells glued by hand, against the truth.

use locoman_vision::camera::{Camera, Distortion};
use locoman_vision::rig::Rig;
use locoman_vision::shells::design;
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::rehearsal::{Reading, observe};

fn rig() -> Rig {
    let camera = |k: usize| {
        let angle = k as f64 * 0.7 - 0.7;
        let eye = Vector3::new(0.7 * angle.cos(), 0.7 * angle.sin(), 1.3);
        let z = (Vector3::new(0.0, 0.0, 1.1) - eye).normalize();
        let x = z.cross(&Vector3::z()).normalize();
        let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
        Camera {
            id: format!("c{k}"),
            width: 1280,
            height: 720,
            focal_px: Vector2::new(1000.0, 1001.0),
            center_px: Vector2::new(641.0, 357.0),
            distortion: Distortion::RadTan([-0.05, 0.01, 3e-4, -2e-4, 0.0, 0.0, 0.0, 0.0]),
            world_from_camera: Isometry3::from_parts(eye.into(), UnitQuaternion::from_rotation_matrix(&axes)),
            line_time_s: 0.0,
        }
    };
    Rig::new((0..3).map(camera).collect())
}

#[test]
fn tags_glued_by_hand_are_measured_and_a_slip_of_the_drawing_is_named() {
    let standard = design::standard();
    let drawn =
        standard.shells.iter().find(|shell| shell.name == "right_palm").expect("there is one").clone();
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let mut glued = drawn.clone();
    for tag in &mut glued.tags {
        let mut three = |size: f64| Vector3::from_fn(|_, _| size * normal());
        tag.shell_from_tag *= Isometry3::new(three(2e-4), three(0.01));
    }
    glued.tags[5].shell_from_tag *= Isometry3::translation(0.002, 0.0, 0.0);
    glued.tags[8].size_m *= 1.03;
    let waved = |t: f64| {
        let tilt = Vector3::new(1.1 * (1.7 * t).sin(), 1.0 * (1.3 * t + 1.0).sin(), 3.0 * (0.4 * t).sin());
        let shift =
            Vector3::new(0.05 * (1.3 * t).sin(), 0.05 * (1.9 * t).sin(), 1.1 + 0.05 * (2.3 * t).cos());
        Isometry3::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(tilt))
    };
    let mut observations = Vec::new();
    for frame in 0..250_u64 {
        let t = frame as f64 * 0.08;
        for (index, camera) in rig().cameras.iter().enumerate() {
            let capture_ns = 1 + (t * 1e9) as u64;
            let reading = Reading::default();
            observations.extend(observe(&glued, camera, index, capture_ns, t, &waved, &reading, &mut normal));
        }
    }
    let sut = measure(&rig(), &drawn, &observations, false, &mut |_, _| {}).expect("measured");
    let misplaced: Vec<u32> = sut.tags.iter().filter(|tag| tag.misplaced()).map(|tag| tag.id).collect();
    assert_eq!(misplaced, [drawn.tags[5].id], "{}", describe(&sut));
    let missized: Vec<u32> = sut.tags.iter().filter(|tag| tag.missized()).map(|tag| tag.id).collect();
    assert_eq!(missized, [drawn.tags[8].id], "{}", describe(&sut));
    // Against the truth, laid over it: the frame is the drawing's and so is a convention.
    let of_truth: Vec<_> = (0..drawn.tags.len())
        .filter(|k| *k != 8)
        .flat_map(|k| sut.shell.tags[k].corners().into_iter().zip(glued.tags[k].corners()))
        .collect();
    let pose = align(&of_truth).expect("enough");
    for k in (0..drawn.tags.len()).filter(|k| sut.tags[*k].images >= LEAST_IMAGES && *k != 8) {
        let error = (glued.tags[k].shell_from_tag.inverse() * pose * sut.shell.tags[k].shell_from_tag)
            .translation
            .vector;
        assert!(error.norm() < 1.5e-4, "{k}: {error}");
    }
}
