//! An objective or a contact as three rows: J, its errors, and the acceleration that it asks for.

use nalgebra::{Vector3, Vector6};

use super::{ContactSet, Gains, hierarchy::Rows};
use crate::{
    dynamics::{DOF, Dynamics, FrameMotion},
    joints::{Leg, Side},
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
    /// What stands on the ground: it neither moves nor accelerates, so J_c q̈ = -J̇_c q̇.
    pub(super) fn contacts(dynamics: &Dynamics, contacts: &ContactSet) -> impl Iterator<Item = Self> {
        let feet = contacts.legs().map(|leg| Self::foot(dynamics, leg));
        feet.chain(contacts.kneels().then(|| Self::knees(dynamics)))
    }

    fn foot(dynamics: &Dynamics, leg: Leg) -> Self {
        let foot = dynamics.frame(Frame::Foot(leg));
        Self {
            rows: rows(foot, 0),
            error: Vector3::zeros(),
            velocity: Vector3::zeros(),
            acceleration: -linear(&foot.bias_acceleration),
        }
    }

    /// Both knees keep their mean height, one row. Were each of them held in all directions, two shanks that are not
    /// exactly parallel would hold the hips fast, which nothing real does.
    fn knees(dynamics: &Dynamics) -> Self {
        let mut knees = Self {
            rows: [[0.0; DOF]; 3],
            error: Vector3::zeros(),
            velocity: Vector3::zeros(),
            acceleration: Vector3::zeros(),
        };
        for side in Side::ALL {
            let knee = dynamics.frame(Frame::Knee(side));
            for (entry, of_knee) in knees.rows[0].iter_mut().zip(&rows(knee, 0)[2]) {
                *entry += 0.5 * of_knee;
            }
            knees.acceleration.x -= 0.5 * knee.bias_acceleration.z;
        }
        knees
    }

    /// The torso's step, velocity and acceleration in its own frame, linear and angular.
    pub(super) fn torso([step, velocity, acceleration]: &[Vector6<f64>; 3]) -> [Self; 2] {
        [0, 3].map(|first| {
            let of = |motion: &Vector6<f64>| motion.fixed_rows::<3>(first).into_owned();
            let mut rows = [[0.0; DOF]; 3];
            for (axis, row) in rows.iter_mut().enumerate() {
                row[first + axis] = 1.0;
            }
            Self { rows, error: of(step), velocity: of(velocity), acceleration: of(acceleration) }
        })
    }

    /// The same rows without any demand.
    pub(super) fn unmoved(self) -> Self {
        let none = Vector3::zeros();
        Self { error: none, velocity: none, acceleration: none, ..self }
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
        Self { rows, error: error * gains.step_share, velocity: desired, acceleration: command - bias }
    }
}

/// Three rows of a frame's Jacobian: from 0 linear, from 3 angular.
pub(super) fn rows(frame: &FrameMotion, first: usize) -> Rows {
    std::array::from_fn(|row| std::array::from_fn(|column| frame.jacobian[(first + row, column)]))
}

pub(super) fn linear(twist: &Vector6<f64>) -> Vector3<f64> {
    twist.fixed_rows::<3>(0).into_owned()
}

pub(super) fn angular(twist: &Vector6<f64>) -> Vector3<f64> {
    twist.fixed_rows::<3>(3).into_owned()
}
