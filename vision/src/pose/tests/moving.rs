//! Shells that move while cameras expose row after row, each camera at its own time.

use super::*;
use crate::camera::Camera;

/// 1 m/s and 360 degrees a second: what the issue asks for.
const VELOCITY_M_S: [f64; 3] = [0.5, -0.7, 0.5];
const RATE_RAD_S: [f64; 3] = [3.5, -4.0, 3.3];

/// 1080 rows of 25.6 µs: ours have 720.
fn rolling() -> Vec<Camera> {
    let mut cameras = testing::rig().cameras;
    cameras.iter_mut().for_each(|camera| camera.line_time_s = 27.6e-3 / 720.0);
    cameras
}

fn moving(pose: &Isometry3<f64>) -> State {
    State {
        world_from_shell: *pose,
        velocity_m_s: Vector3::from(VELOCITY_M_S),
        rate_rad_s: Vector3::from(RATE_RAD_S),
    }
}

/// Pairs are exposed 11 ms apart.
fn seen(
    shell: &Shell,
    cameras: &[Camera],
    truth: &State,
    sigma_px: f64,
    noise: &mut Noise,
) -> Vec<Observation> {
    const MIDDLE_NS: u64 = 1_000_000_000;
    let pose_at = |t_s: f64| truth.pose_after(t_s - MIDDLE_NS as f64 * 1e-9);
    (0..cameras.len())
        .flat_map(|camera| {
            let capture_ns = MIDDLE_NS + if camera < 2 { 0 } else { 11_000_000 };
            testing::observe(shell, cameras, camera, capture_ns, &pose_at, sigma_px, noise)
        })
        .collect()
}

#[test]
fn exact_corners_of_unsynchronised_rolling_cameras_give_pose_and_twist_exactly() {
    let cameras = rolling();
    for index in [0, 1, 2] {
        let shell = &testing::shells().shells[index];
        let truth = moving(&testing::worn()[index]);
        let observations = seen(shell, &cameras, &truth, 0.0, &mut Noise(1));
        let time_ns = exposure_ns(&cameras, &observations).expect("seen");
        let views = Views { shell, cameras: &cameras, observations: &observations, time_ns, variance: 1.0 };
        // The twist has a prior: what little it pulls shows.
        let settings = SolverSettings { free_speed_m_s: 1e3, free_rate_rad_s: 1e3, ..exact() };
        let solution = Solver::default().afresh(&views, &settings).expect("solvable");
        let expected = truth.pose_after((time_ns as f64 - 1e9) * 1e-9);
        let (position_m, rotation_rad) = error_m_rad(&solution, &expected);
        assert!(position_m < 1e-6 && rotation_rad < 1e-5, "{position_m} m, {rotation_rad} rad");
        let state = solution.state;
        assert!((state.velocity_m_s - truth.velocity_m_s).norm() < 1e-4, "{:?}", state.velocity_m_s);
        assert!((state.rate_rad_s - truth.rate_rad_s).norm() < 2e-3, "{:?}", state.rate_rad_s);
    }
}

#[test]
fn without_row_times_the_same_corners_are_centimetres_off() {
    let cameras = rolling();
    let shell = &testing::shells().shells[1];
    let truth = moving(&testing::worn()[1]);
    let mut observations = seen(shell, &cameras, &truth, 0.05, &mut Noise(1));
    let time_ns = exposure_ns(&cameras, &observations).expect("seen");
    let views = Views { shell, cameras: &cameras, observations: &observations, time_ns, variance: 1.0 };
    let solution = Solver::default().afresh(&views, &exact()).expect("solvable");
    let expected = truth.pose_after((time_ns as f64 - 1e9) * 1e-9);
    let (modelled_m, _) = error_m_rad(&solution, &expected);
    let plain = testing::rig().cameras;
    observations.iter_mut().for_each(|observation| observation.capture_ns = time_ns);
    let views = Views { shell, cameras: &plain, observations: &observations, time_ns, variance: 1.0 };
    let lenient = SolverSettings { outlier_floor_px: 100.0, ..exact() };
    let solution = Solver::default().afresh(&views, &lenient).expect("solvable");
    let (plain_m, _) = error_m_rad(&solution, &expected);
    println!("with row times {:.2} mm, without {:.2} mm", 1e3 * modelled_m, 1e3 * plain_m);
    assert!(modelled_m < 1e-3, "{modelled_m}");
    assert!(plain_m > 2.0 * modelled_m, "{plain_m}");
}

#[test]
fn the_covariance_of_a_moving_shell_is_true() {
    const RUNS: usize = 300;
    let cameras = rolling();
    let shell = &testing::shells().shells[1];
    let mut noise = Noise(31);
    let mut sut = Solver::default();
    let mut sum = 0.0;
    for _ in 0..RUNS {
        // Motions are drawn from the prior, so that all twelve numbers count.
        let mut draw = |sigma: f64| Vector3::from_fn(|_, _| sigma * noise.normal());
        let truth =
            State { world_from_shell: testing::worn()[1], velocity_m_s: draw(1.0), rate_rad_s: draw(5.0) };
        let observations = seen(shell, &cameras, &truth, 0.1, &mut noise);
        let time_ns = exposure_ns(&cameras, &observations).expect("seen");
        let views = Views { shell, cameras: &cameras, observations: &observations, time_ns, variance: 1.0 };
        let expected = State { world_from_shell: truth.pose_after((time_ns as f64 - 1e9) * 1e-9), ..truth };
        let prior = Prior::of_speed(expected.world_from_shell, 1.0, 5.0);
        let solution = sut.near(&views, &prior, &floorless()).expect("solvable");
        let error = solution.state.step_to(&expected);
        sum += error.dot(&(solution.covariance.try_inverse().expect("regular") * error)) / 12.0;
    }
    let nees = sum / RUNS as f64;
    println!("NEES of twelve numbers: {nees:.3}");
    assert!((0.8..=1.25).contains(&nees), "{nees}");
}
