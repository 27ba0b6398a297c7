//! The hierarchy in both metrics: kinematic for positions and velocities, dynamic for accelerations.

use nalgebra::Matrix3;

use super::{
    hierarchy::{Mark, TaskChain},
    inertia::InertiaFactor,
    task::Task,
};
use crate::dynamics::{MassMatrix, Motion};

/// The two chains of tasks.
pub(super) struct Tracking {
    factor: InertiaFactor,
    /// q̄ - q and dq̄, in the metric of the joints.
    kinematic: TaskChain<2>,
    /// L ddq̄, in the metric of the mass matrix.
    dynamic: TaskChain<1>,
}

/// Both chains after some of their tasks.
pub(super) struct TrackingMark {
    kinematic: Mark<2>,
    dynamic: Mark<1>,
}

impl Tracking {
    pub(super) const fn new() -> Self {
        Self { factor: InertiaFactor::new(), kinematic: TaskChain::new(), dynamic: TaskChain::new() }
    }

    /// Begins a step: q̄_0 = q, dq̄_0 = 0, ddq̄_0 = 0.
    pub(super) fn begin(&mut self, mass_matrix: &MassMatrix) {
        self.factor.factor(mass_matrix);
        self.kinematic.clear();
        self.dynamic.clear();
    }

    /// One level of the hierarchy: the paper's three recursions, with J_pre of the exact null space.
    ///
    /// ```text
    /// q̄_i   = q̄_{i-1}   + J_pre†  D (x̄ - x - J (q̄_{i-1} - q))
    /// dq̄_i  = dq̄_{i-1}  + J_pre†  D (dx̄ - J dq̄_{i-1})
    /// ddq̄_i = ddq̄_{i-1} + J_pre‡  D (ẍ_cmd - J̇ q̇ - J ddq̄_{i-1})
    /// ```
    /// D fades a direction out as it becomes singular (not at all if `damping_start` is 0). It comes from the
    /// kinematic chain and serves both: J_pre loses rank in the same configurations in either metric.
    pub(super) fn add(&mut self, task: &Task, damping_start: f64) {
        let projected = self.kinematic.project(&task.rows);
        let damping =
            if damping_start > 0.0 { projected.damping(damping_start) } else { Matrix3::identity() };
        self.kinematic.track(&task.rows, &projected, &damping, &[task.error, task.velocity]);

        let mut weighed = task.rows;
        for row in &mut weighed {
            self.factor.weigh(row);
        }
        let projected = self.dynamic.project(&weighed);
        self.dynamic.track(&weighed, &projected, &damping, &[task.acceleration]);
    }

    /// To come back to with [`Self::rewind`].
    pub(super) const fn mark(&self) -> TrackingMark {
        TrackingMark { kinematic: self.kinematic.mark(), dynamic: self.dynamic.mark() }
    }

    /// Forgets the tasks since a mark.
    pub(super) const fn rewind(&mut self, mark: &TrackingMark) {
        self.kinematic.rewind(&mark.kinematic);
        self.dynamic.rewind(&mark.dynamic);
    }

    /// q̄ - q
    pub(super) fn position_step(&self) -> Motion {
        Motion::from(*self.kinematic.solution(0))
    }

    /// dq̄
    pub(super) fn velocity(&self) -> Motion {
        Motion::from(*self.kinematic.solution(1))
    }

    /// ddq̄ = L⁻¹ y
    pub(super) fn acceleration(&self) -> Motion {
        Motion::from(self.factor.unweigh(self.dynamic.solution(0)))
    }
}
