//! An objective, a contact or a stop as three rows: J, its errors, and the acceleration that it asks for.

use nalgebra::Vector3;

use super::{Gains, hierarchy::Rows};
use crate::{
    dynamics::{DOF, Dynamics, FrameMotion},
    joints::Leg,
    model::Frame,
};

/// What the hierarchy needs of an objective or a contact.
#[derive(Debug, Clone)]
pub(super) struct Task {
    /// J_i
    pub(super) rows: Rows,
    /// x̄_i - x_i
    pub(super) error: Vector3<f64>,
    /// The desired velocity.
    pub(super) velocity: Vector3<f64>,
    /// ẍ_i^cmd - J̇_i q̇
    pub(super) acceleration: Vector3<f64>,
}

impl Task {
    /// A foot on the ground: it neither moves nor accelerates, so J_c q̈ = -J̇_c q̇.
    pub(super) fn contact(dynamics: &Dynamics, leg: Leg) -> Self {
        let foot = dynamics.frame(Frame::Foot(leg));
        Self {
            rows: rows(foot, 0),
            error: Vector3::zeros(),
            velocity: Vector3::zeros(),
            acceleration: -linear(&foot.bias_acceleration),
        }
    }

    /// A quantity that is held to what is permitted to it: one row; the other two are empty.
    pub(super) fn held(row: [f64; DOF], step: f64, velocity: f64, acceleration: f64) -> Self {
        let along = |value: f64| Vector3::new(value, 0.0, 0.0);
        let rows = [row, [0.0; DOF], [0.0; DOF]];
        Self { rows, error: along(step), velocity: along(velocity), acceleration: along(acceleration) }
    }

    /// Whether every number but the rows is finite; those of the state are checked before.
    pub(super) fn is_finite(&self) -> bool {
        let vectors = [&self.error, &self.velocity, &self.acceleration];
        vectors.iter().all(|vector| vector.iter().all(|entry| entry.is_finite()))
    }

    /// ẍ^cmd = ẍ̄ + K_p (x̄ - x) + K_d (ẋ̄ - ẋ), the paper's acceleration command, with its error and its
    /// length limited.
    pub(super) fn commanded(
        rows: Rows,
        error: Vector3<f64>,
        [desired, velocity]: [Vector3<f64>; 2],
        feed_forward: Vector3<f64>,
        bias: Vector3<f64>,
        gains: &Gains,
    ) -> Self {
        let error = error.cap_magnitude(gains.max_error);
        let feedback = gains.kp.component_mul(&error) + gains.kd.component_mul(&(desired - velocity));
        let command = (feed_forward + feedback).cap_magnitude(gains.max_acceleration);
        Self { rows, error, velocity: desired, acceleration: command - bias }
    }
}

/// Three rows of a frame's Jacobian: from 0 linear, from 3 angular.
pub(super) fn rows(frame: &FrameMotion, first: usize) -> Rows {
    std::array::from_fn(|row| std::array::from_fn(|column| frame.jacobian[(first + row, column)]))
}

pub(super) fn linear(twist: &nalgebra::Vector6<f64>) -> Vector3<f64> {
    twist.fixed_rows::<3>(0).into_owned()
}

pub(super) fn angular(twist: &nalgebra::Vector6<f64>) -> Vector3<f64> {
    twist.fixed_rows::<3>(3).into_owned()
}
