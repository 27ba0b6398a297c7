//! Time of a solve, from a prediction and without one.
//!
//! `cargo bench -p locoman-vision --bench solve`. One palm as four cameras see it, 20 tags in all (what the issue
//! bounds by 60 µs), and other counts. Times are processor time of one thread, so that what else runs on the
//! machine counts little.

#![expect(clippy::expect_used, reason = "in a benchmark a panic is the report")]

use std::hint::black_box;

use locoman_protocol::clock::thread_cpu_ns;
use locoman_vision::camera::{Camera, Distortion};
use locoman_vision::detect::CornerCovariance;
use locoman_vision::pose::{Observation, Prior, Solver, SolverSettings, State, Vector12, Views};
use locoman_vision::shells::{Shell, design};
use nalgebra::{Isometry3, Matrix3, Point2, Point3, Rotation3, UnitQuaternion, Vector2, Vector3};

/// Solves that are timed.
const SOLVES: usize = 4000;
const SIGMA_PX: f64 = 0.05;

fn main() {
    let cameras = cameras();
    let shells = design::standard();
    let palm = &shells.shells[1];
    let truth = Isometry3::new(Vector3::new(0.45, -0.22, 1.08), Vector3::new(0.1, -0.2, 0.1));
    let everything = observe(palm, &cameras, &truth);
    println!("µs of processor time a solve                       p50     p99");
    for count in [4, 10, 20, everything.len()] {
        let observations = spread(&everything, count);
        let tags = observations.len();
        time(
            &format!("near a prediction (2 mm, 1.7 deg), {tags} tags"),
            |sut: &mut Solver, views, prior| sut.near(views, prior, &SolverSettings::default()).is_ok(),
            palm,
            &cameras,
            &observations,
            &truth,
        );
        time(
            &format!("without a prediction, {tags} tags"),
            |sut: &mut Solver, views, _| sut.afresh(views, &SolverSettings::default()).is_ok(),
            palm,
            &cameras,
            &observations,
            &truth,
        );
    }
}

/// So many of the observations, from all cameras alike.
fn spread(all: &[Observation], count: usize) -> Vec<Observation> {
    (0..count).map(|k| all[k * all.len() / count].clone()).collect()
}

fn time(
    name: &str,
    run: impl Fn(&mut Solver, &Views<'_>, &Prior) -> bool,
    shell: &Shell,
    cameras: &[Camera],
    observations: &[Observation],
    truth: &Isometry3<f64>,
) {
    let views = Views { shell, cameras, observations, time_ns: 0, variance: 1.0 };
    let step = Vector12::from_iterator([1e-3, -1e-3, 1e-3, 0.02, -0.01, 0.02].into_iter().chain([0.0; 6]));
    let mut prior = Prior::of_speed(State::still(*truth).moved(&step).world_from_shell, 0.1, 0.5);
    for k in 0..3 {
        prior.information[(k, k)] = 2e-3_f64.powi(-2);
        prior.information[(3 + k, 3 + k)] = 0.03_f64.powi(-2);
    }
    let mut sut = Solver::default();
    let mut times_ns: Vec<u64> = (0..SOLVES)
        .map(|_| {
            let begun_ns = thread_cpu_ns();
            assert!(black_box(run(&mut sut, &views, &prior)), "not solved");
            thread_cpu_ns() - begun_ns
        })
        .collect();
    times_ns.sort_unstable();
    let at = |share: f64| times_ns[(share * (SOLVES - 1) as f64) as usize] as f64 * 1e-3;
    println!("{name:46} {:7.1} {:7.1}", at(0.5), at(0.99));
}

/// Two stereo pairs of rolling-shutter cameras in front of the operator.
fn cameras() -> Vec<Camera> {
    let camera = |y: f64| Camera {
        id: format!("at {y}"),
        width: 1280,
        height: 720,
        focal_px: Vector2::new(880.0, 882.0),
        center_px: Vector2::new(641.5, 357.0),
        distortion: Distortion::RadTan([-0.09, 0.03, 3e-4, -2e-4, 0.0, 0.0, 0.0, 0.0]),
        world_from_camera: looking(Point3::new(1.15, y, 1.4), Point3::new(0.3, y * 0.15, 1.12)),
        line_time_s: 15.7e-6,
    };
    [-0.56, -0.44, 0.44, 0.56].map(camera).to_vec()
}

fn looking(eye: Point3<f64>, target: Point3<f64>) -> Isometry3<f64> {
    let z = (target - eye).normalize();
    let x = z.cross(&Vector3::z()).normalize();
    let axes = Matrix3::from_columns(&[x, z.cross(&x), z]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Isometry3::from_parts(eye.coords.into(), rotation)
}

/// What the cameras see of a shell at rest, with a little noise.
fn observe(shell: &Shell, cameras: &[Camera], pose: &Isometry3<f64>) -> Vec<Observation> {
    let mut seed = 1_u64;
    let mut uniform = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut seen = Vec::new();
    for (camera, described) in cameras.iter().enumerate() {
        let camera_from_shell = described.world_from_camera.inverse() * pose;
        for (index, tag) in shell.tags.iter().enumerate() {
            let sight = -(camera_from_shell * tag.center()).coords.normalize();
            if (camera_from_shell * tag.normal()).dot(&sight) < 0.4 {
                continue;
            }
            let corners_px = tag.corners().map(|corner| {
                let pixel = described.project(&(camera_from_shell * corner)).expect("in front");
                // A uniform number has a variance of a twelfth.
                let noise = 12_f64.sqrt() * SIGMA_PX;
                Point2::new(pixel.x + noise * uniform(), pixel.y + noise * uniform())
            });
            let covariance_px2 = CornerCovariance::from_diagonal_element(SIGMA_PX.powi(2));
            seen.push(Observation { camera, tag: index, capture_ns: 0, corners_px, covariance_px2 });
        }
    }
    seen
}
