//! How a control step went: nothing is limited or given up silently.

use crate::collision::Link;

/// Where the contact forces of a step come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ForceSource {
    /// No foot stands on the ground: there are none.
    #[default]
    NoContact,
    /// The dense active-set method, which proved that they are optimal.
    ActiveSet,
    /// The interior-point method, because the active set could not prove its solution.
    InteriorPoint,
    /// The last ones that were feasible, because both methods failed.
    LastFeasible(ForceFailure),
}

/// Why no contact forces were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForceFailure {
    /// The problem held a number that is not finite.
    NotFinite,
    /// No forces satisfy the constraints.
    Infeasible,
    /// The iteration cap was reached.
    Iterations,
    /// The solver reported a numerical failure.
    Numerical,
}

/// Why the controller's output can no longer be trusted to balance the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WbcFault {
    /// The state held a number that is not finite: the last command is repeated.
    State,
    /// An objective's reference held a number that is not finite: that objective was left out.
    Reference,
    /// No contact forces were found for several steps in a row.
    Forces(ForceFailure),
    /// The result held a number that is not finite: the last command is repeated.
    Output,
}

/// How a step went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WbcStatus {
    /// Where the contact forces come from.
    pub forces: ForceSource,
    /// Steps since the start whose forces were not found.
    pub force_failures: u64,
    /// No contact forces keep the loaded legs' torques within limits: they were found without regard to them,
    /// and the torques were cut.
    pub torques_relaxed: bool,
    /// Share of the objectives' accelerations that was kept to stay below the joints' limits; 1 normally.
    pub acceleration_scale: f64,
    /// Joints that are held to what their range and their speed permit, or whose desired position, velocity or torque was
    /// cut to its limit, a bit for each.
    pub limited: u32,
    /// A link of a limb in the air is kept above the ground.
    pub grounded: bool,
    /// Two links that are kept from touching each other; one such pair if there are more.
    pub kept_apart: Option<[Link; 2]>,
    /// Set when the output should not be trusted to balance the robot.
    pub fault: Option<WbcFault>,
}

impl Default for WbcStatus {
    fn default() -> Self {
        Self {
            forces: ForceSource::NoContact,
            force_failures: 0,
            torques_relaxed: false,
            acceleration_scale: 1.0,
            limited: 0,
            grounded: false,
            kept_apart: None,
            fault: None,
        }
    }
}
