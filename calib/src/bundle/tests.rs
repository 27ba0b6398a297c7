//! The adjustment against truth: projected boards, with lenses, clocks and rows to be found.

use locoman_vision::camera::{Camera, Distortion};
use locoman_vision::shells::Shell;
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::columns::Columns;
use super::lens::INTRINSICS;
use super::term::{self, Linear};
use super::*;
use crate::board::Board;
use crate::rehearsal::{Reading, observe};

fn board() -> Shell {
    Board { columns: 6, rows: 5, first_id: 0, tag_mm: 40.0, gap_mm: 12.0 }.to_shell()
}

fn looking(eye: [f64; 3], target: [f64; 3]) -> Isometry3<f64> {
    let (eye, target) = (Vector3::from(eye), Vector3::from(target));
    let z = (target - eye).normalize();
    let x = z.cross(&Vector3::z()).normalize();
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    Isometry3::from_parts(eye.into(), UnitQuaternion::from_rotation_matrix(&axes))
}

fn camera(id: &str, eye: [f64; 3], distortion: Distortion, line_time_s: f64) -> Camera {
    Camera {
        id: id.into(),
        width: 1280,
        height: 720,
        focal_px: Vector2::new(820.0, 818.0),
        center_px: Vector2::new(645.0, 352.0),
        distortion,
        world_from_camera: looking(eye, [0.0, 0.0, 1.0]),
        line_time_s,
    }
}

fn cameras() -> Vec<Camera> {
    let radtan = Distortion::RadTan([-0.12, 0.05, 4e-4, -3e-4, 0.0, 0.0, 0.0, 0.0]);
    vec![
        camera("a", [1.0, -0.4, 1.1], radtan.clone(), 20e-6),
        camera("b", [1.0, 0.4, 1.2], radtan, 0.0),
        camera("c", [0.9, 0.0, 1.6], Distortion::Fisheye([0.02, -0.004, 0.001, 0.0]), 30e-6),
    ]
}

/// A board that faces the cameras and is waved.
fn waved(t: f64) -> Isometry3<f64> {
    let facing = UnitQuaternion::from_basis(Vector3::y(), Vector3::z());
    let tilt = Vector3::new(0.5 * (2.1 * t).sin(), 0.5 * (1.7 * t + 1.0).sin(), 0.6 * (0.9 * t).cos());
    let shift = Vector3::new(0.15 * (1.3 * t).sin(), 0.25 * (1.9 * t).sin(), 1.1 + 0.15 * (2.3 * t).cos());
    Isometry3::from_parts(shift.into(), facing * UnitQuaternion::from_scaled_axis(tilt))
}

trait Basis {
    fn from_basis(x: Vector3<f64>, y: Vector3<f64>) -> Self;
}

impl Basis for UnitQuaternion<f64> {
    fn from_basis(x: Vector3<f64>, y: Vector3<f64>) -> Self {
        let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
        Self::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
    }
}

const OFFSETS_S: [f64; 3] = [0.0, 0.0113, -0.0172];
const SIGMA_PX: f64 = 0.05;

/// The true state, seen for some seconds at 30 Hz by cameras whose clocks are off.
fn problem(seconds: f64, seed: u64) -> Problem {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let (cameras, board) = (cameras(), board());
    let reading = Reading { sigma_px: SIGMA_PX, ..Reading::default() };
    let mut sightings = Vec::new();
    for (index, camera) in cameras.iter().enumerate() {
        for frame in 0..(seconds * 30.0) as u64 {
            let capture_ns = 1_000_000_000 + frame * 33_333_333;
            let true_s = frame as f64 * 0.033_333_333 + OFFSETS_S[index];
            let seen = observe(&board, camera, index, capture_ns, true_s, &waved, &reading, &mut normal);
            sightings.extend(seen.iter().filter_map(|o| Sighting::of_tag(o, 0, 1_000_000_000)));
        }
    }
    let eyes = cameras.into_iter().zip(OFFSETS_S).enumerate().map(|(k, (camera, offset_s))| Eye {
        camera,
        offset_s,
        loose: EyeLoose {
            position: if k == 0 { FIXED } else { FREE },
            orientation: if k == 0 { FIXED } else { FREE },
            intrinsics: std::array::from_fn(|k| if k < 8 { FREE } else { FIXED }),
            offset: if k == 0 { FIXED } else { FREE },
            line_time: FREE,
        },
    });
    let motion = Motion::Path(Path::through(0.0, seconds, 1.0 / 30.0, 0.2, waved));
    Problem { eyes: eyes.collect(), parts: Part::tags_of(&board), motion, sightings }
}

#[test]
fn derivatives_are_those_of_the_residuals() {
    const STEP: f64 = 1e-6;
    let mut sut = problem(0.5, 1);
    sut.parts.iter_mut().for_each(|part| part.loose = [FREE; 3]);
    let columns = Columns::new(&sut);
    for sighting in sut.sightings.iter().step_by(37) {
        let linear = Linear::new(&sut, &columns, sighting).expect("in view");
        let at = |problem: &Problem| {
            sighting.whitening
                * nalgebra::SVector::from(term::residuals_px(problem, sighting).expect("in view"))
        };
        for (k, column) in linear.border[..linear.border_count].iter().enumerate() {
            let moved = |sign: f64| {
                let mut other = sut.clone();
                let mut step = vec![0.0; columns.len()];
                step[*column] = sign * STEP;
                columns.apply(&mut other, &step);
                at(&other)
            };
            let numeric = (moved(1.0) - moved(-1.0)) / (2.0 * STEP);
            for row in 0..8 {
                let analytic = linear.rows[row][6 * linear.count + k];
                let scale = numeric.norm().max(1.0);
                // Rows of one tag are a millisecond apart, which the derivatives leave out.
                assert!(
                    (analytic - numeric[row]).abs() < 2e-2 * scale,
                    "{column}: {analytic} {}",
                    numeric[row]
                );
            }
        }
    }
}

#[test]
fn lenses_places_clocks_and_rows_are_found_together() {
    let truth = problem(12.0, 3);
    let mut sut = truth.clone();
    for (k, eye) in sut.eyes.iter_mut().enumerate() {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        eye.camera.focal_px += Vector2::new(12.0, 9.0) * sign;
        eye.camera.center_px += Vector2::new(6.0, -8.0) * sign;
        if let Distortion::RadTan(k) = &mut eye.camera.distortion {
            *k = [0.0; 8];
        }
        eye.camera.line_time_s = 0.0;
        if k > 0 {
            eye.offset_s = 0.0;
            let shift =
                Isometry3::new(Vector3::new(0.02, -0.01, 0.015) * sign, Vector3::new(0.01, 0.02, -0.01));
            eye.camera.world_from_camera *= shift;
        }
    }
    let outcome = adjust(&mut sut, &Settings::default(), &mut |_, _| {});
    assert!(outcome.converged, "{} steps, {} px", outcome.steps, outcome.rms_px);
    assert!((outcome.variance - 1.0).abs() < 0.05, "{}", outcome.variance);
    let mut nees = 0.0;
    for k in 0..sut.eyes.len() {
        let (found, known) = (&sut.eyes[k], &truth.eyes[k]);
        assert!((found.offset_s - known.offset_s).abs() < 2e-4, "{}", found.offset_s);
        assert!((found.camera.line_time_s - known.camera.line_time_s).abs() < 1e-6);
        let error = known.camera.world_from_camera.inverse() * found.camera.world_from_camera;
        assert!(error.translation.vector.norm() < 5e-4 && error.rotation.angle() < 5e-4, "{error}");
        let sigmas = outcome.eye_sigmas(k);
        for index in 0..INTRINSICS {
            let off = lens::value(&found.camera, index) - lens::value(&known.camera, index);
            assert!(off.abs() <= 4.5 * sigmas[6 + index], "{k} {index}: {off} {}", sigmas[6 + index]);
            nees += if sigmas[6 + index] > 0.0 { (off / sigmas[6 + index]).powi(2) / 24.0 } else { 0.0 };
        }
    }
    assert!((0.4..2.0).contains(&nees), "{nees}");
}

#[test]
fn tags_that_are_not_where_they_are_drawn_are_found() {
    let mut sut = problem(8.0, 4);
    sut.eyes.iter_mut().for_each(|eye| eye.loose = EyeLoose::FIXED);
    let drawn = sut.parts[7].object_from_part;
    for (k, part) in sut.parts.iter_mut().enumerate() {
        if k > 0 {
            part.loose = [FREE, FREE, FREE];
        }
    }
    sut.parts[7].object_from_part *= Isometry3::new(Vector3::new(0.002, -0.001, 0.0015), Vector3::zeros());
    let outcome = adjust(&mut sut, &Settings::default(), &mut |_, _| {});
    let error = drawn.inverse() * sut.parts[7].object_from_part;
    assert!(outcome.converged && error.translation.vector.norm() < 2e-4, "{error}");
    assert!((sut.parts[7].scale - 1.0).abs() < 1e-3);
    assert!(error.translation.vector.norm() < 5.0 * outcome.part_sigmas(7)[..3].iter().sum::<f64>());
}
