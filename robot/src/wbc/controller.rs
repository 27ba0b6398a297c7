//! The control step: hierarchy, forces, torques.

use nalgebra::Vector6;

use super::{
    ContactSet, Objective, WbcFault, WbcOutput, WbcSettings, WbcStatus,
    force::ForceProblem,
    ground::{ForceDistribution, GroundReaction},
    objective::Robot,
    stops::{Stops, Surroundings},
    task::Task,
    tracking::Tracking,
};
use crate::{
    dynamics::{DOF, Dynamics, Motion, State},
    joints::JOINTS,
    model::Model,
};

/// Parts of a control step, in order. What follows, assembling the command, is not worth a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepPart {
    /// Kinematics and dynamics.
    Dynamics,
    /// q̄, dq̄ and ddq̄.
    Hierarchy,
    /// Contact forces and torques.
    Forces,
}

/// What the hierarchy asks of torso and joints: q̄ - q, dq̄ and ddq̄.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tracked {
    /// q̄ - q: m and rad in the torso's frame, then rad.
    pub step: Motion,
    /// dq̄
    pub velocity: Motion,
    /// ddq̄
    pub acceleration: Motion,
}

/// The controller: its settings and the memory that it works in.
pub struct WholeBodyController {
    settings: WbcSettings,
    walks: bool,
    dynamics: Dynamics,
    tracking: Tracking,
    stops: Stops,
    /// Of the last step.
    tracked: Tracked,
    forces: ForceDistribution,
    failures: u64,
    failures_in_a_row: u32,
}

impl WholeBodyController {
    /// Takes all memory that it will ever need.
    pub fn new(settings: WbcSettings) -> Self {
        Self {
            settings,
            walks: false,
            dynamics: Dynamics::new(),
            tracking: Tracking::new(),
            stops: Stops::new(),
            tracked: Tracked {
                step: Motion::zeros(),
                velocity: Motion::zeros(),
                acceleration: Motion::zeros(),
            },
            forces: ForceDistribution::new(settings.contact),
            failures: 0,
            failures_in_a_row: 0,
        }
    }

    /// The settings in use.
    pub fn settings(&self) -> &WbcSettings {
        &self.settings
    }

    /// The robot walks from now on, or stands.
    pub const fn set_walking(&mut self, walks: bool) {
        self.walks = walks;
    }

    /// Kinematics and dynamics at the state of the last step.
    pub fn dynamics(&self) -> &Dynamics {
        &self.dynamics
    }

    /// What the hierarchy asked for in the last step.
    pub const fn tracked(&self) -> Tracked {
        self.tracked
    }

    /// The contact-force problem of the last step.
    pub const fn force_problem(&self) -> &ForceProblem {
        self.forces.problem()
    }

    /// Leaves the contact forces of every step to the interior-point method, for measurements.
    #[must_use]
    pub const fn with_interior_point_only(mut self) -> Self {
        self.forces.use_second_only();
        self
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
        self.step_watched(model, state, objectives, contacts, output, |_| {});
    }

    /// The same, telling when each part is done: for measurements.
    pub fn step_watched(
        &mut self,
        model: &Model,
        state: &State,
        objectives: &[Objective],
        contacts: &ContactSet,
        output: &mut WbcOutput,
        mut done: impl FnMut(StepPart),
    ) {
        let mut status = WbcStatus { force_failures: self.failures, ..WbcStatus::default() };
        if !state.is_finite() {
            status.fault = Some(WbcFault::State);
            output.status = status;
            return;
        }
        self.dynamics.update(model, state);
        done(StepPart::Dynamics);
        self.track(model, state, objectives, contacts, &mut status);
        done(StepPart::Hierarchy);
        let reaction = self.forces.solve(model, &self.dynamics, contacts, &self.tracked.acceleration);
        done(StepPart::Forces);
        let Some(reaction) = reaction else {
            status.fault = Some(WbcFault::Output);
            output.status = status;
            return;
        };
        self.count_failures(&reaction, &mut status);

        let mut command = self.command(state, &reaction);
        hold_shanks(&mut command, objectives, contacts);
        command.status = status;
        command.limit(model);
        if command.is_finite() {
            *output = command;
        } else {
            output.status = WbcStatus { fault: Some(WbcFault::Output), ..status };
        }
    }

    /// q̄ - q, dq̄ and ddq̄ of the last objective, within all limits.
    ///
    /// The contacts come first. They start the chains with q̄_0 = q, dq̄_0 = 0 and ddq̄_0 = J_c‡ (-J̇_c q̇): the
    /// paper prints -J_c q̇, which has the unit of a velocity.
    fn track(
        &mut self,
        model: &Model,
        state: &State,
        objectives: &[Objective],
        contacts: &ContactSet,
        status: &mut WbcStatus,
    ) {
        let dynamics = &self.dynamics;
        self.tracking.begin(dynamics.mass_matrix());
        for task in Task::contacts(dynamics, contacts) {
            self.tracking.add(task, 0.0);
        }
        let contact_levels = self.tracking.levels();
        for objective in objectives {
            let mut gains = *self.settings.gains(objective.kind(), self.walks);
            if matches!(objective, Objective::LegPosture(leg, _) if contacts.contains(*leg)) {
                // Two shanks hold the torso twice. The joints' own law keeps them; from here noise would come back as forces.
                gains = gains.feed_forward();
            }
            match objective.task(&Robot { state, dynamics }, &gains) {
                Some(task) => self.tracking.add(task, gains.damping_start),
                None => status.fault = Some(WbcFault::Reference),
            }
        }
        let [contacts_only, wanted] = self.tracking.accelerations(contact_levels);
        self.tracked = Tracked {
            step: self.tracking.position_step(),
            velocity: self.tracking.velocity(),
            acceleration: bounded(&self.settings, &contacts_only, &wanted, status),
        };
        let around = Surroundings { model, state, dynamics, contacts, objectives, settings: &self.settings };
        self.stops.begin(&around);
        if let Some(torso) = self.stops.restrain(&around, &self.tracked) {
            follow(&mut self.tracking, &around, &torso, &mut self.tracked);
        }
        self.stops.restrict(&around, &mut self.tracked);
        status.limited = self.stops.joints();
        status.grounded = self.stops.grounded();
        status.kept_apart = self.stops.pair();
    }

    fn count_failures(&mut self, reaction: &GroundReaction, status: &mut WbcStatus) {
        status.forces = reaction.source;
        status.torques_relaxed = reaction.torques_relaxed;
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

    /// q̄, dq̄ and τ = A q̈_cmd + b + g - J_cᵀ f_r of the joints, with q̈_cmd = ddq̄ + (δ_t, 0).
    fn command(&self, state: &State, reaction: &GroundReaction) -> WbcOutput {
        let mut output = WbcOutput::hold(state.position);
        let Tracked { step, velocity, .. } = &self.tracked;
        for joint in 0..JOINTS {
            output.position[joint] += step[6 + joint];
            output.velocity[joint] = velocity[6 + joint];
            output.torque[joint] = reaction.effort[6 + joint];
        }
        output.contact_force = reaction.force;
        output.torso_slack = reaction.slack;
        output
    }
}

/// Legs on which the robot kneels take their posture as it is: were it only what the contacts leave of it, a foot or knee
/// that has slid would stay where it is.
fn hold_shanks(command: &mut WbcOutput, objectives: &[Objective], contacts: &ContactSet) {
    for objective in objectives {
        if let Objective::LegPosture(leg, reference) = objective
            && contacts.contains(*leg)
        {
            command.position.fixed_rows_mut::<3>(leg.first_joint()).copy_from(&reference.position);
            command.velocity.fixed_rows_mut::<3>(leg.first_joint()).copy_from(&reference.velocity);
        }
    }
}

/// Changes the torso's step, velocity and acceleration, and all joints with it: stance feet rest, and as far as the
/// joints can do it, what the other objectives control goes on as it did.
///
/// It is the hierarchy of the change alone, which knows no targets but the torso's, and therefore linear in it.
fn follow(tracking: &mut Tracking, around: &Surroundings, torso: &[Vector6<f64>; 3], tracked: &mut Tracked) {
    let Surroundings { state, dynamics, settings, .. } = *around;
    tracking.restart();
    for task in Task::contacts(dynamics, around.contacts) {
        tracking.add(task.unmoved(), 0.0);
    }
    for task in Task::torso(torso) {
        tracking.add(task, 0.0);
    }
    for objective in around.objectives.iter().filter(|objective| !objective.kind().is_of_torso()) {
        let gains = settings.objectives.of(objective.kind());
        if let Some(task) = objective.task(&Robot { state, dynamics }, gains) {
            tracking.add(task.unmoved(), gains.damping_start);
        }
    }
    tracked.step += tracking.position_step();
    tracked.velocity += tracking.velocity();
    tracked.acceleration += tracking.accelerations(0)[1];
}

/// The objectives' acceleration, scaled back towards that of the contacts alone until all joints are below their
/// limit. Every mixture of the two satisfies the contacts exactly; cutting joints one by one would not.
///
/// A tenth of the limit is always left to the objectives: were it nothing, the sign of the least wish would decide
/// about all of them wherever the contacts alone take a joint beyond the limit.
fn bounded(
    settings: &WbcSettings,
    contacts_only: &Motion,
    wanted: &Motion,
    status: &mut WbcStatus,
) -> Motion {
    const LEAST_SHARE: f64 = 0.1;
    let limit = settings.max_joint_acceleration;
    let mut scale: f64 = 1.0;
    for index in DOF - JOINTS..DOF {
        let step = wanted[index] - contacts_only[index];
        let room = (limit - contacts_only[index] * step.signum()).max(LEAST_SHARE * limit);
        if step.abs() > room {
            scale = scale.min(room / step.abs());
        }
    }
    status.acceleration_scale = scale;
    contacts_only + (wanted - contacts_only) * scale
}

#[cfg(test)]
mod limit_tests;
#[cfg(test)]
mod tests;
