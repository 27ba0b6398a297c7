//! The hierarchy in both metrics: kinematic for positions and velocities, dynamic for accelerations.

use nalgebra::Matrix3;

use super::{hierarchy::TaskChain, inertia::InertiaFactor, task::Task};
use crate::dynamics::{MassMatrix, Motion};

/// Levels that fit without taking memory: four feet, the torso and all objectives.
const LEVELS: usize = 32;

/// The two chains of tasks.
pub(super) struct Tracking {
    factor: InertiaFactor,
    /// q̄ - q and dq̄, in the metric of the joints.
    kinematic: TaskChain<2>,
    /// L ddq̄, in the metric of the mass matrix.
    dynamic: TaskChain<1>,
    levels: Vec<Level>,
}

/// A task in its place, with what the kinematic chain found of it.
struct Level {
    task: Task,
    damping: Option<Matrix3<f64>>,
}

impl Tracking {
    pub(super) fn new() -> Self {
        Self {
            factor: InertiaFactor::new(),
            kinematic: TaskChain::new(),
            dynamic: TaskChain::new(),
            levels: Vec::with_capacity(LEVELS),
        }
    }

    /// Begins a step: q̄_0 = q, dq̄_0 = 0, ddq̄_0 = 0.
    pub(super) fn begin(&mut self, mass_matrix: &MassMatrix) {
        self.factor.factor(mass_matrix);
        self.restart();
    }

    /// Begins again in the same state.
    pub(super) fn restart(&mut self) {
        self.kinematic.clear();
        self.levels.clear();
    }

    /// How many levels there are.
    pub(super) const fn levels(&self) -> usize {
        self.levels.len()
    }

    /// One level of the hierarchy: the paper's first two recursions, with J_pre of the exact null space.
    ///
    /// ```text
    /// q̄_i   = q̄_{i-1}   + J_pre†  D (x̄ - x - J (q̄_{i-1} - q))
    /// dq̄_i  = dq̄_{i-1}  + J_pre†  D (dx̄ - J dq̄_{i-1})
    /// ```
    /// D fades a direction out as it becomes singular (not at all if `damping_start` is 0).
    pub(super) fn add(&mut self, task: Task, damping_start: f64) {
        let projected = self.kinematic.project(&task.rows, damping_start);
        let damping = projected.damping;
        self.kinematic.track(&projected, damping.as_ref(), &[task.error, task.velocity]);
        self.levels.push(Level { task, damping });
    }

    /// ddq̄ = L⁻¹ y, after the first levels and after all: the third recursion.
    ///
    /// ```text
    /// ddq̄_i = ddq̄_{i-1} + J_pre‡  D (ẍ_cmd - J̇ q̇ - J ddq̄_{i-1})
    /// ```
    /// D is the kinematic chain's: J_pre loses rank in the same configurations in either metric. Nothing of q̄
    /// and dq̄ depends on ddq̄, so that it is computed once, when they are settled.
    pub(super) fn accelerations(&mut self, first: usize) -> [Motion; 2] {
        self.dynamic.clear();
        let mut after_first = Motion::zeros();
        for (index, Level { task, damping }) in self.levels.iter().enumerate() {
            if index == first {
                after_first = self.acceleration();
            }
            let mut weighed = task.rows;
            self.factor.weigh(&mut weighed);
            let projected = self.dynamic.project(&weighed, 0.0);
            self.dynamic.track(&projected, damping.as_ref(), &[task.acceleration]);
        }
        let after_all = self.acceleration();
        [if first < self.levels.len() { after_first } else { after_all }, after_all]
    }

    /// q̄ - q
    pub(super) fn position_step(&self) -> Motion {
        Motion::from(self.kinematic.solution(0))
    }

    /// dq̄
    pub(super) fn velocity(&self) -> Motion {
        Motion::from(self.kinematic.solution(1))
    }

    fn acceleration(&self) -> Motion {
        Motion::from(self.factor.unweigh(&self.dynamic.solution(0)))
    }
}
