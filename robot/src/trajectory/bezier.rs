//! From rest at one pose to rest at the next: the paper's interpolation.
//!
//! A cubic Bézier curve whose inner control points lie on its ends, P0 = P1 and P2 = P3, is the straight line
//! P0 + s(x) (P3 - P0) with s(x) = 3x² - 2x³, x the share of the time. Orientations go likewise along the
//! geodesic, R(x) = exp(s(x) φ) R_0 with φ = log(R_1 R_0ᵀ), whose axis never turns: its angular velocity is
//! exactly φ ds/dt, its angular acceleration φ d²s/dt².

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::{
    commander::PoseReference,
    wbc::{PointReference, RotationReference},
};

/// The way from one pose to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    start: Isometry3<f64>,
    way: Vector3<f64>,
    turn: Vector3<f64>,
    duration_s: f64,
}

impl Segment {
    /// From one pose to another; of two ways round, the shorter.
    pub fn new(start: &Isometry3<f64>, end: &Isometry3<f64>, duration_s: f64) -> Self {
        Self {
            start: *start,
            way: end.translation.vector - start.translation.vector,
            turn: (end.rotation * start.rotation.inverse()).scaled_axis(),
            duration_s,
        }
    }

    /// Where it is after some time, and how it moves; at rest before and after.
    pub fn sample(&self, elapsed_s: f64) -> PoseReference {
        let x = (elapsed_s / self.duration_s).clamp(0.0, 1.0);
        let share = x * x * (3.0 - 2.0 * x);
        let (rate, acceleration) = if (0.0..self.duration_s).contains(&elapsed_s) {
            (6.0 * x * (1.0 - x) / self.duration_s, (6.0 - 12.0 * x) / self.duration_s.powi(2))
        } else {
            (0.0, 0.0)
        };
        PoseReference {
            point: PointReference {
                position: self.start.translation.vector + self.way * share,
                velocity: self.way * rate,
                acceleration: self.way * acceleration,
            },
            rotation: RotationReference {
                orientation: UnitQuaternion::from_scaled_axis(self.turn * share) * self.start.rotation,
                angular_velocity: self.turn * rate,
                angular_acceleration: self.turn * acceleration,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pose() -> impl Strategy<Value = Isometry3<f64>> {
        (prop::array::uniform3(-1.0..1.0f64), prop::array::uniform3(-1.7..1.7f64))
            .prop_map(|(p, r)| Isometry3::new(p.into(), r.into()))
    }

    proptest! {
        #[test]
        fn it_goes_from_rest_at_one_pose_to_rest_at_the_other(start in pose(), end in pose()) {
            let sut = Segment::new(&start, &end, 2.0);
            for (time_s, pose) in [(-1.0, start), (0.0, start), (2.0, end), (9.0, end)] {
                let sample = sut.sample(time_s);
                prop_assert!((sample.point.position - pose.translation.vector).norm() < 1e-12);
                prop_assert!(sample.rotation.orientation.angle_to(&pose.rotation) < 1e-7);
                prop_assert!(sample.point.velocity.norm() + sample.rotation.angular_velocity.norm() < 1e-12);
            }
        }

        #[test]
        fn velocity_and_acceleration_are_the_derivatives(
            start in pose(), end in pose(), time_s in 0.01..1.99f64,
        ) {
            const H: f64 = 1e-5;
            let sut = Segment::new(&start, &end, 2.0);
            let (before, now, after) = (sut.sample(time_s - H), sut.sample(time_s), sut.sample(time_s + H));
            let slope = (after.point.position - before.point.position) / (2.0 * H);
            prop_assert!((slope - now.point.velocity).norm() < 1e-8);
            let slope = (after.point.velocity - before.point.velocity) / (2.0 * H);
            prop_assert!((slope - now.point.acceleration).norm() < 1e-8);
            let turned = after.rotation.orientation * before.rotation.orientation.inverse();
            let slope = turned.scaled_axis() / (2.0 * H);
            prop_assert!((slope - now.rotation.angular_velocity).norm() < 1e-8);
            let slope = (after.rotation.angular_velocity - before.rotation.angular_velocity) / (2.0 * H);
            prop_assert!((slope - now.rotation.angular_acceleration).norm() < 1e-8);
        }
    }
}
