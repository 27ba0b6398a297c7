//! Where tags are expected, against where the rows of a rolling shutter truly see them.

use super::*;
use crate::pose::{Matrix18, State};
use crate::testing;

/// Full HD of a ZED, as in `configs/rigs/two_zed_pairs_1080p.toml`.
const LINE_TIME_S: f64 = 25.6e-6;

/// A palm at 1 m/s and 360 deg/s.
fn hurried() -> Motion {
    let state = State {
        velocity_m_s: Vector3::new(0.3, -0.6, 0.74),
        rate_rad_s: Vector3::new(3.6, 3.6, -3.6),
        acceleration_m_s2: Vector3::new(0.0, 5.0, -6.0),
        ..State::still(testing::worn()[1])
    };
    Motion::begin(1_000_000_000, &state, &(Matrix18::identity() * 1e-8))
}

/// Where the row sees a corner that is exposed when the corner is there, by iteration to the end.
fn seen(camera: &Camera, motion: &Motion, corner: &Point3<f64>) -> Point2<f64> {
    let camera_from_world = camera.world_from_camera.inverse();
    let at =
        |delay_s: f64| camera.project(&(camera_from_world * motion.state().pose_after(delay_s) * corner));
    (0..30).fold(at(0.0).expect("in front"), |pixel, _| at(camera.row_delay_s(pixel.y)).expect("in front"))
}

#[test]
fn tags_of_a_hurried_hand_are_expected_where_the_rows_see_them() {
    /// The shear is linear and the turn over a tag's own rows left out.
    const MOST_PX: f64 = 0.5;
    let (motion, settings) = (hurried(), TrackerSettings::default());
    let shells = testing::shells();
    let shell = &shells.shells[1];
    let (mut expected, mut compared, mut farthest_px) = (Vec::new(), 0, 0.0_f64);
    for camera in testing::rig().cameras {
        let camera = Camera { line_time_s: LINE_TIME_S * 1080.0 / f64::from(camera.height), ..camera };
        let still = camera.world_from_camera.inverse() * motion.world_from_shell;
        expected_tags(&camera, shell, &motion, &settings, &mut expected);
        for tag in &expected {
            for (corner, found) in shell.tags[tag.tag].corners().iter().zip(&tag.corners_px) {
                let truth = seen(&camera, &motion, corner);
                assert!((truth - found).norm() < MOST_PX, "{found} is seen at {truth}");
                let without = camera.project(&(still * corner)).expect("in front");
                farthest_px = farthest_px.max((truth - without).norm());
                compared += 1;
            }
        }
    }
    assert!(
        compared >= 40 && farthest_px > 3.0,
        "{compared} corners, up to {farthest_px} px from the capture time"
    );
}

#[test]
fn the_rate_of_a_tag_is_that_of_differences() {
    /// Of rates up to 1.5: what bends over a tenth of a millisecond, and what the middle row's time leaves.
    const TOLERANCE: f64 = 2e-3;
    const STEP_S: f64 = 1e-4;
    let (motion, settings) = (hurried(), TrackerSettings::default());
    let shells = testing::shells();
    let camera = Camera { line_time_s: LINE_TIME_S, ..testing::rig().cameras[0].clone() };
    let camera_from_world = camera.world_from_camera.inverse();
    let mut expected = Vec::new();
    expected_tags(&camera, &shells.shells[1], &motion, &settings, &mut expected);
    assert!(!expected.is_empty());
    for Expected { tag, expectation, .. } in &expected {
        let tag = &shells.shells[1].tags[*tag];
        let middle = seen(&camera, &motion, &tag.center());
        let delay_s = camera.row_delay_s(middle.y);
        for corner in tag.corners() {
            let ideal = |later_s: f64| {
                let p = camera_from_world * motion.state().pose_after(delay_s + later_s) * corner;
                p.xy() / p.z
            };
            let difference = (ideal(STEP_S) - ideal(-STEP_S)) / (2.0 * STEP_S);
            let here = ideal(0.0);
            let rate = expectation.ideal_rate * here.coords.push(1.0);
            let rate = rate.xy() - here.coords * rate.z;
            assert!((rate - difference).norm() < TOLERANCE, "{rate} {difference}");
        }
    }
}
