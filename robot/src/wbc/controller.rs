//! The control step: hierarchy, forces, torques.

use nalgebra::Matrix3;

use super::{
    ContactSet, Objective, WbcFault, WbcOutput, WbcSettings, WbcStatus,
    ground::{ForceDistribution, GroundReaction, ground_load},
    hierarchy::TaskChain,
    inertia::InertiaFactor,
    stops::Stops,
    task::Task,
};
use crate::{
    dynamics::{DOF, Dynamics, Motion, State},
    joints::JOINTS,
    model::Model,
};

/// Most joints of one limb that can be stopped at the ends of their ranges: all of a front one.
const MAX_STOPS_IN_LIMB: usize = 6;

/// The controller: its settings and the memory that it works in.
pub struct WholeBodyController {
    settings: WbcSettings,
    dynamics: Dynamics,
    factor: InertiaFactor,
    /// q̄ - q and dq̄, in the metric of the joints.
    kinematic: TaskChain<2>,
    /// L ddq̄, in the metric of the mass matrix.
    dynamic: TaskChain<1>,
    forces: ForceDistribution,
    failures: u64,
    failures_in_a_row: u32,
}

impl WholeBodyController {
    /// Takes all memory that it will ever need.
    pub fn new(settings: WbcSettings) -> Self {
        Self {
            settings,
            dynamics: Dynamics::new(),
            factor: InertiaFactor::new(),
            kinematic: TaskChain::new(),
            dynamic: TaskChain::new(),
            forces: ForceDistribution::new(settings.contact),
            failures: 0,
            failures_in_a_row: 0,
        }
    }

    /// The settings in use.
    pub fn settings(&self) -> &WbcSettings {
        &self.settings
    }

    /// Kinematics and dynamics at the state of the last step.
    pub fn dynamics(&self) -> &Dynamics {
        &self.dynamics
    }

    /// One control step. `objectives` stand in order, most important first. Allocates nothing (unless the
    /// interior-point method has to step in).
    ///
    /// `output` holds the last command on entry (at the start: [`WbcOutput::hold`]), and afterwards one that
    /// is safe to send: on a fault that leaves no better one, the last. What was limited or failed stands in
    /// its status.
    pub fn step(
        &mut self,
        model: &Model,
        state: &State,
        objectives: &[Objective],
        contacts: &ContactSet,
        output: &mut WbcOutput,
    ) {
        let mut status = WbcStatus { force_failures: self.failures, ..WbcStatus::default() };
        if !state.is_finite() {
            status.fault = Some(WbcFault::State);
            output.status = status;
            return;
        }
        self.dynamics.update(model, state);
        let acceleration = self.track(model, state, objectives, contacts, &mut status);
        let reaction = self.forces.solve(model, &self.dynamics, contacts, &acceleration);
        let Some(reaction) = reaction else {
            status.fault = Some(WbcFault::Output);
            output.status = status;
            return;
        };
        self.count_failures(&reaction, &mut status);

        let mut command = self.command(state, &acceleration, &reaction);
        command.status = status;
        command.limit(model);
        if command.is_finite() {
            *output = command;
        } else {
            output.status = WbcStatus { fault: Some(WbcFault::Output), ..status };
        }
    }

    /// q̄, dq̄ and ddq̄ of the last objective; returns ddq̄.
    ///
    /// The contacts come first. They start the chains with q̄_0 = q, dq̄_0 = 0 and ddq̄_0 = J_c‡ (-J̇_c q̇): the
    /// paper prints -J_c q̇, which has the unit of a velocity. Then come joints at an end of their range.
    fn track(
        &mut self,
        model: &Model,
        state: &State,
        objectives: &[Objective],
        contacts: &ContactSet,
        status: &mut WbcStatus,
    ) -> Motion {
        self.factor.factor(self.dynamics.mass_matrix());
        self.kinematic.clear();
        self.dynamic.clear();
        for leg in contacts.legs() {
            let task = Task::contact(&self.dynamics, leg);
            self.add(&task, 0.0);
        }
        let contacts_only = self.acceleration();
        let start = (self.kinematic.mark(), self.dynamic.mark());

        let mut stops = Stops::default();
        for _ in 0..=MAX_STOPS_IN_LIMB {
            self.kinematic.rewind(&start.0);
            self.dynamic.rewind(&start.1);
            self.track_with(state, objectives, &stops, status);
            if !stops.extend(model, state, self.kinematic.solution(0), self.settings.joint_margin) {
                break;
            }
        }
        status.limited = stops.iter().fold(0, |limited, (joint, _)| limited | 1 << joint);
        self.bounded(&contacts_only, &self.acceleration(), status)
    }

    /// Adds stopped joints and objectives to the chains.
    fn track_with(&mut self, state: &State, objectives: &[Objective], stops: &Stops, status: &mut WbcStatus) {
        for (joint, end) in stops.iter() {
            let task = Task::stop(state, joint, end, &self.settings.objectives.arm_posture);
            self.add(&task, 0.0);
        }
        for objective in objectives {
            let gains = self.settings.objectives.of(objective.kind());
            let start = gains.damping_start;
            match Task::objective(objective, &self.dynamics, state, gains) {
                Some(task) => self.add(&task, start),
                None => status.fault = Some(WbcFault::Reference),
            }
        }
    }

    /// One level of the hierarchy: the paper's three recursions, with J_pre of the exact null space.
    ///
    /// ```text
    /// q̄_i   = q̄_{i-1}   + J_pre†  D (x̄ - x - J (q̄_{i-1} - q))
    /// dq̄_i  = dq̄_{i-1}  + J_pre†  D (dx̄ - J dq̄_{i-1})
    /// ddq̄_i = ddq̄_{i-1} + J_pre‡  D (ẍ_cmd - J̇ q̇ - J ddq̄_{i-1})
    /// ```
    /// D fades a direction out as it becomes singular. It comes from the kinematic chain and serves both:
    /// J_pre loses rank in the same configurations in either metric.
    fn add(&mut self, task: &Task, damping_start: f64) {
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

    /// ddq̄ = L⁻¹ y
    fn acceleration(&self) -> Motion {
        Motion::from(self.factor.unweigh(self.dynamic.solution(0)))
    }

    /// The objectives' acceleration, scaled back towards that of the contacts alone until all joints are
    /// below their limit. Every mixture of the two satisfies the contacts exactly; cutting joints one by one
    /// would not.
    fn bounded(&self, contacts_only: &Motion, wanted: &Motion, status: &mut WbcStatus) -> Motion {
        let limit = self.settings.max_joint_acceleration;
        let mut scale: f64 = 1.0;
        for index in DOF - JOINTS..DOF {
            let step = wanted[index] - contacts_only[index];
            let room = (limit - contacts_only[index] * step.signum()).max(0.0);
            if step.abs() > room {
                scale = scale.min(room / step.abs());
            }
        }
        status.acceleration_scale = scale;
        contacts_only + (wanted - contacts_only) * scale
    }

    fn count_failures(&mut self, reaction: &GroundReaction, status: &mut WbcStatus) {
        status.forces = reaction.source;
        match reaction.source.failure() {
            None => self.failures_in_a_row = 0,
            Some(failure) => {
                self.failures += 1;
                self.failures_in_a_row += 1;
                if self.failures_in_a_row >= self.settings.contact.failures_to_fault {
                    status.fault = Some(WbcFault::Forces(failure));
                }
            }
        }
        status.force_failures = self.failures;
    }

    /// τ = A q̈_cmd + b + g - J_cᵀ f_r with q̈_cmd = ddq̄ + (δ_t, 0); and q̄, dq̄ of the joints.
    fn command(&self, state: &State, acceleration: &Motion, reaction: &GroundReaction) -> WbcOutput {
        let mut commanded = *acceleration;
        for axis in 0..6 {
            commanded[axis] += reaction.slack[axis];
        }
        let effort =
            self.dynamics.inverse_dynamics(&commanded) - ground_load(&self.dynamics, &reaction.force);
        let mut output = WbcOutput::hold(state.position);
        for joint in 0..JOINTS {
            output.position[joint] += self.kinematic.solution(0)[6 + joint];
            output.velocity[joint] = self.kinematic.solution(1)[6 + joint];
            output.torque[joint] = effort[6 + joint];
        }
        output.foot_force = reaction.force;
        output.torso_slack = reaction.slack;
        output
    }
}

#[cfg(test)]
mod tests;
