//! Three joints of a limb: an arm's, or a leg's.

use nalgebra::Vector3;

use super::{PointReference, Robot, Track};
use crate::{
    dynamics::DOF,
    wbc::{Gains, task::Task},
};

/// Joints that are to keep their angles: J is a choice of columns, so that J̇ = 0.
pub(super) struct Posture<'a> {
    /// The first of the three.
    pub(super) first: usize,
    pub(super) reference: &'a PointReference,
}

impl Track for Posture<'_> {
    fn task(&self, robot: &Robot<'_>, gains: &Gains) -> Task {
        let first = self.first;
        let mut rows = [[0.0; DOF]; 3];
        for (index, row) in rows.iter_mut().enumerate() {
            row[6 + first + index] = 1.0;
        }
        let position = robot.state.position.fixed_rows::<3>(first);
        let velocity = robot.state.velocity.fixed_rows::<3>(first).into_owned();
        Task::commanded(
            rows,
            self.reference.position - position,
            [self.reference.velocity, velocity],
            self.reference.acceleration,
            Vector3::zeros(),
            gains,
        )
    }
}
