//! Motions from wherever a reference is, and however fast it moves, to rest at a goal in a given time.
//!
//! A fifth-order polynomial for each coordinate, with given position, velocity and acceleration at the start,
//! and at rest at the end: a motion may be interrupted by another at any instant without a step in position,
//! velocity or acceleration.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::reference::PoseReference;
use crate::wbc::{PointReference, RotationReference};

/// Motion of a point, or of the three joints of a limb.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMotion {
    coefficients: [Vector3<f64>; 6],
    duration_s: f64,
}

impl PointMotion {
    /// From a moving reference to rest at `goal`.
    pub fn new(start: &PointReference, goal: &Vector3<f64>, duration_s: f64) -> Self {
        let t = duration_s.max(1e-3);
        let (x, v, a) = (start.position, start.velocity, start.acceleration);
        let d = goal - x;
        // Boundary conditions of x(s t) with s = time / t, at s = 0 and s = 1.
        let (v, a) = (v * t, a * t * t);
        let coefficients = [
            x,
            v,
            a / 2.0,
            10.0 * d - 6.0 * v - 1.5 * a,
            -15.0 * d + 8.0 * v + 1.5 * a,
            6.0 * d - 3.0 * v - 0.5 * a,
        ];
        Self { coefficients, duration_s: t }
    }

    /// Stays where it is.
    pub fn hold(position: Vector3<f64>) -> Self {
        Self::new(&PointReference::hold(position), &position, 1.0)
    }

    /// How long it takes, s.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Where it is after some time; at rest at the goal from its end on.
    pub fn sample(&self, elapsed_s: f64) -> PointReference {
        let s = (elapsed_s / self.duration_s).clamp(0.0, 1.0);
        let [c0, c1, c2, c3, c4, c5] = self.coefficients;
        let position = c0 + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5))));
        let velocity = c1 + s * (2.0 * c2 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)));
        let acceleration = 2.0 * c2 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5));
        if s >= 1.0 {
            return PointReference::hold(position);
        }
        PointReference {
            position,
            velocity: velocity / self.duration_s,
            acceleration: acceleration / self.duration_s.powi(2),
        }
    }
}

/// Motion of an orientation: R(t) = exp(φ(t)) R_goal, with φ going to zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotationMotion {
    goal: UnitQuaternion<f64>,
    angle: PointMotion,
}

impl RotationMotion {
    /// From a turning reference to rest at `goal`.
    pub fn new(start: &RotationReference, goal: &UnitQuaternion<f64>, duration_s: f64) -> Self {
        let angle = (start.orientation * goal.inverse()).scaled_axis();
        let to_rate = left_jacobian(&angle).try_inverse().unwrap_or_else(Matrix3::identity);
        let start = PointReference {
            position: angle,
            velocity: to_rate * start.angular_velocity,
            acceleration: to_rate * start.angular_acceleration,
        };
        Self { goal: *goal, angle: PointMotion::new(&start, &Vector3::zeros(), duration_s) }
    }

    /// Where it is after some time.
    pub fn sample(&self, elapsed_s: f64) -> RotationReference {
        let angle = self.angle.sample(elapsed_s);
        let jacobian = left_jacobian(&angle.position);
        RotationReference {
            orientation: UnitQuaternion::from_scaled_axis(angle.position) * self.goal,
            angular_velocity: jacobian * angle.velocity,
            // Without the term of the Jacobian's own change: second order in the speed.
            angular_acceleration: jacobian * angle.acceleration,
        }
    }
}

/// ω = J_l(φ) dφ/dt for R = exp(φ): J_l = I + (1 - cos θ)/θ² [φ] + (θ - sin θ)/θ³ [φ]².
fn left_jacobian(angle: &Vector3<f64>) -> Matrix3<f64> {
    let theta = angle.norm();
    let cross = angle.cross_matrix();
    let (first, second) = if theta < 1e-4 {
        (0.5, 1.0 / 6.0)
    } else {
        ((1.0 - theta.cos()) / theta.powi(2), (theta - theta.sin()) / theta.powi(3))
    };
    Matrix3::identity() + first * cross + second * cross * cross
}

/// Motion of a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseMotion {
    point: PointMotion,
    rotation: RotationMotion,
}

impl PoseMotion {
    /// From a moving reference to rest at `goal`.
    pub fn new(start: &PoseReference, goal: &nalgebra::Isometry3<f64>, duration_s: f64) -> Self {
        Self {
            point: PointMotion::new(&start.point, &goal.translation.vector, duration_s),
            rotation: RotationMotion::new(&start.rotation, &goal.rotation, duration_s),
        }
    }

    /// Where it is after some time.
    pub fn sample(&self, elapsed_s: f64) -> PoseReference {
        PoseReference { point: self.point.sample(elapsed_s), rotation: self.rotation.sample(elapsed_s) }
    }

    /// Whether it has ended.
    pub fn is_over(&self, elapsed_s: f64) -> bool {
        elapsed_s >= self.point.duration_s()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn vector(range: f64) -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-range..range).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn a_motion_starts_as_the_reference_moves_and_ends_at_rest_at_the_goal(
            position in vector(1.0), velocity in vector(1.0), acceleration in vector(3.0),
            goal in vector(1.0), duration in 0.2..4.0f64,
        ) {
            let start = PointReference { position, velocity, acceleration };
            let sut = PointMotion::new(&start, &goal, duration);
            let first = sut.sample(0.0);
            prop_assert!((first.position - position).norm() < 1e-12);
            prop_assert!((first.velocity - velocity).norm() < 1e-9);
            prop_assert!((first.acceleration - acceleration).norm() < 1e-9);
            let last = sut.sample(duration * (1.0 - 1e-9));
            prop_assert!((last.position - goal).norm() < 1e-6);
            prop_assert!(last.velocity.norm() < 1e-5);
        }

        #[test]
        fn a_rotations_velocity_is_that_of_its_orientation(
            from in vector(1.5), velocity in vector(0.5), to in vector(1.5), at in 0.05..0.95f64,
        ) {
            let start = RotationReference {
                orientation: UnitQuaternion::from_scaled_axis(from),
                angular_velocity: velocity,
                angular_acceleration: Vector3::zeros(),
            };
            let goal = UnitQuaternion::from_scaled_axis(to);
            prop_assume!((start.orientation * goal.inverse()).angle() < 2.5);
            let sut = RotationMotion::new(&start, &goal, 1.0);
            prop_assert!((sut.sample(0.0).angular_velocity - velocity).norm() < 1e-9);
            const STEP_S: f64 = 1e-5;
            let (before, after) = (sut.sample(at - STEP_S), sut.sample(at + STEP_S));
            let difference = (after.orientation * before.orientation.inverse()).scaled_axis() / (2.0 * STEP_S);
            prop_assert!((difference - sut.sample(at).angular_velocity).norm() < 1e-5);
        }
    }
}
