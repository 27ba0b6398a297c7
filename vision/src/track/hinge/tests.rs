//! A thumb that opens and closes on a palm that moves.

use super::*;

const AXIS: [f64; 3] = [0.0, 0.0, 1.0];

fn motion(world_from_shell: Isometry3<f64>) -> Motion {
    let covariance = Matrix12::identity() * 1e-8;
    Motion::begin(0, &State::still(world_from_shell), &covariance, &FilterSettings::default())
}

fn palm(k: u32) -> Motion {
    let t = f64::from(k) * 0.033;
    motion(Isometry3::new(Vector3::new(0.3 * t, 0.1, 1.0), Vector3::new(0.2 * t, 0.4 * t, -0.1)))
}

fn thumb(palm: &Motion, opening_rad: f64) -> Motion {
    let hinge = Isometry3::translation(0.02, 0.03, 0.0)
        * UnitQuaternion::from_scaled_axis(Vector3::from(AXIS) * opening_rad)
        * Translation3::new(0.04, 0.0, 0.0);
    motion(palm.world_from_shell * hinge)
}

fn learned(instants: u32) -> Hinge {
    let mut sut = Hinge::begin(&palm(0), &thumb(&palm(0), 0.0));
    for k in 1..instants {
        let palm = palm(k);
        sut.learn(&palm, &thumb(&palm, 0.5 * (f64::from(k) * 0.1).sin()));
    }
    sut
}

#[test]
fn nothing_is_said_before_enough_was_seen() {
    let settings = FilterSettings::default();
    assert!(learned(LEAST - 1).expected(&palm(0), &settings).is_none());
    assert!(learned(LEAST).expected(&palm(0), &settings).is_some());
}

#[test]
fn the_thumb_is_expected_where_it_was_on_the_palm_wherever_the_palm_is() {
    /// 95 % of χ² with six degrees of freedom, and far less: the covariance is wide on purpose.
    const CHI2_6: f64 = 12.592;
    let sut = learned(300);
    for (k, opening_rad) in [(0, 0.5), (40, -0.5), (90, 0.0), (90, 0.8)] {
        let palm = palm(k);
        let truth = thumb(&palm, opening_rad);
        let expected = sut.expected(&palm, &FilterSettings::default()).expect("learned");
        let error = expected.state().step_to(&truth.state()).fixed_rows::<6>(0).into_owned();
        let information = expected.pose_covariance().try_inverse().expect("regular");
        let distance2 = error.dot(&(information * error));
        assert!(distance2 < CHI2_6, "{k} {opening_rad}: {distance2}");
        assert!(error.fixed_rows::<3>(0).norm() < 0.05, "{error}");
    }
}

#[test]
fn the_hinge_shows_as_one_large_direction() {
    let sut = learned(600);
    let rotation = sut.covariance.fixed_view::<3, 3>(3, 3).into_owned();
    let eigen = rotation.symmetric_eigen();
    let mut values: Vec<f64> = eigen.eigenvalues.iter().copied().collect();
    values.sort_by(f64::total_cmp);
    assert!(values[2] > 100.0 * values[1], "{values:?}");
    let axis = eigen.eigenvectors.column(eigen.eigenvalues.imax());
    assert!(axis.dot(&Vector3::from(AXIS)).abs() > 0.99, "{axis}");
}
