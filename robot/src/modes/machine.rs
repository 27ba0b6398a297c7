//! The state machine of modes: decides what to do next, and nothing else. It has no clock and does no I/O:
//! the same state and inputs always give the same next state.

use super::mode::{Effector, Mode, Phase};
use crate::{joints::Side, supervisor::Severity};

/// Why a request was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// The robot says nothing, or not yet.
    NoSensors,
    /// The torso leans too far.
    Tilted,
    /// A stop was latched. This request released it; the next one is obeyed.
    StopReleased,
    /// A stop is still being carried out.
    Stopping,
    /// The whole-body controller gave up.
    Control,
}

impl Refusal {
    /// For people.
    pub const fn text(self) -> &'static str {
        match self {
            Self::NoSensors => "no state from the robot yet",
            Self::Tilted => "the torso leans too far",
            Self::StopReleased => "the stop is released now: ask again",
            Self::Stopping => "still stopping: wait until it is damped",
            Self::Control => "the whole-body controller found no forces",
        }
    }
}

/// What a robot looks like that we meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Start {
    /// Lying, folded, hanging: whatever does not stand.
    Down,
    /// On four feet that carry it.
    Standing,
    /// On three feet, the front foot of this side in the air.
    OnThree(Side),
}

/// A request for a mode that passed the checks, or did not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Request {
    /// Go there.
    Accepted(Mode),
    /// Do not.
    Refused(Refusal),
}

/// What the machine looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Inputs {
    /// A new request, if there is one.
    pub request: Option<Mode>,
    /// What must happen.
    pub severity: Severity,
    /// The torso leans too far for any mode but standing and lying.
    pub tilted: bool,
    /// The whole-body controller reported a fault.
    pub control_fault: bool,
    /// The motion of this phase has ended where it should.
    pub arrived: bool,
    /// The foot of the lifting leg is off the ground.
    pub airborne: bool,
    /// What the robot looks like; needed to leave `Damped`.
    pub start: Start,
}

/// Where the robot is in its modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Machine {
    phase: Phase,
    /// The last mode that was reached.
    mode: Mode,
    goal: Mode,
}

impl Default for Machine {
    fn default() -> Self {
        Self { phase: Phase::Damped, mode: Mode::Damped, goal: Mode::Damped }
    }
}

impl Machine {
    /// What the robot is doing.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// The last mode that was reached.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Where it is going.
    pub fn goal(&self) -> Mode {
        self.goal
    }

    /// Starts over with a robot as it is found: one that stands goes on standing; one that does not stays
    /// damped, unless it should stand up.
    #[must_use]
    pub fn started(start: Start, stand_up: bool) -> Self {
        let stands = start != Start::Down;
        let damped = Self::default();
        if stands || stand_up { Self { goal: Mode::Stance, ..damped }.leave_damped(start) } else { damped }
    }

    /// Judges a request. Pure.
    pub fn judge(&self, mode: Mode, inputs: &Inputs) -> Request {
        let lowers = matches!(mode, Mode::Damped | Mode::LieDown);
        if inputs.severity >= Severity::LieDown {
            return Request::Refused(Refusal::Stopping);
        }
        if inputs.tilted && !lowers {
            return Request::Refused(Refusal::Tilted);
        }
        if inputs.control_fault && mode.is_of_motion() {
            return Request::Refused(Refusal::Control);
        }
        Request::Accepted(mode)
    }

    /// One step. Returns why a request was refused, if it was.
    pub fn step(&mut self, inputs: &Inputs) -> Option<Refusal> {
        let request = inputs.request.map(|mode| self.judge(mode, inputs));
        if let Some(Request::Accepted(mode)) = request {
            self.goal = mode;
        }
        self.obey(inputs.severity);
        self.phase = self.next(inputs);
        match request {
            Some(Request::Refused(refusal)) => Some(refusal),
            _ => None,
        }
    }

    fn obey(&mut self, severity: Severity) {
        match severity {
            Severity::None | Severity::Warn | Severity::Hold | Severity::Disengage => {}
            Severity::Stand => {
                if self.goal.is_of_motion() {
                    self.goal = Mode::Stance;
                }
            }
            Severity::LieDown => {
                if !matches!(self.goal, Mode::Damped | Mode::LieDown) {
                    self.goal = Mode::LieDown;
                }
            }
            Severity::Damp => *self = Self::default(),
        }
    }

    /// The phase after this one; sets the mode where it arrives.
    fn next(&mut self, inputs: &Inputs) -> Phase {
        let lowers = matches!(self.goal, Mode::Damped | Mode::LieDown);
        let wanted = self.goal.effector();
        let walking = match self.goal {
            Mode::LocoManipulation(arms) => Some(arms),
            _ => None,
        };
        let wanted_of = |side: Side| wanted.filter(|effector| effector.side() == side);
        match self.phase {
            Phase::Damped if lowers => {
                self.mode = self.goal;
                Phase::Damped
            }
            Phase::Damped => self.leave_damped(inputs.start).phase,
            Phase::StandUp if lowers => self.turn_back(Mode::Stance, Phase::LieDown),
            Phase::StandUp if inputs.arrived => Phase::Recentre,
            Phase::Recentre if inputs.arrived => {
                self.mode = Mode::Stance;
                Phase::Stance
            }
            Phase::Stance if lowers => Phase::LieDown,
            Phase::Stance => self.leave_stance(),
            Phase::Unfold(arms) if walking != Some(arms) => {
                self.turn_back(Mode::LocoManipulation(arms), Phase::Recentre)
            }
            Phase::Unfold(arms) if inputs.arrived => {
                self.mode = self.goal;
                Phase::WalkHolding(arms)
            }
            Phase::Walk if self.goal != Mode::Locomotion => Phase::Halt,
            Phase::WalkHolding(arms) if walking != Some(arms) => Phase::Halt,
            // Not before it stands: a gait begins on four feet.
            Phase::Halt if inputs.arrived && self.goal == Mode::Locomotion => {
                self.mode = self.goal;
                Phase::Walk
            }
            Phase::Halt if inputs.arrived => Phase::Recentre,
            Phase::Gather if self.goal != Mode::Bimanual => self.turn_back(Mode::Bimanual, Phase::Halt),
            Phase::Gather if inputs.arrived => Phase::Kneel,
            Phase::Kneel if self.goal != Mode::Bimanual => self.turn_back(Mode::Bimanual, Phase::GetUp),
            Phase::Kneel if inputs.arrived => Phase::SitUp,
            Phase::SitUp if self.goal != Mode::Bimanual => self.turn_back(Mode::Bimanual, Phase::SitDown),
            Phase::SitUp if inputs.arrived => {
                self.mode = self.goal;
                Phase::Bimanual
            }
            Phase::Bimanual if self.goal != Mode::Bimanual => Phase::SitDown,
            Phase::SitDown if self.goal == Mode::Bimanual => Phase::SitUp,
            Phase::SitDown if inputs.arrived => Phase::GetUp,
            Phase::GetUp if self.goal == Mode::Bimanual => Phase::Kneel,
            Phase::GetUp if inputs.arrived => Phase::Recentre,
            Phase::ShiftTorso(effector) if wanted != Some(effector) => {
                self.turn_back(effector.mode(), Phase::Recentre)
            }
            Phase::ShiftTorso(effector) if inputs.arrived => Phase::LiftFoot(effector),
            Phase::LiftFoot(effector) if wanted != Some(effector) => {
                let back = if inputs.airborne { Phase::Stow(effector.side()) } else { Phase::Recentre };
                self.turn_back(effector.mode(), back)
            }
            Phase::LiftFoot(effector) if inputs.arrived => {
                self.mode = effector.mode();
                match effector {
                    Effector::Foot(side) => Phase::SingleFoot(side),
                    Effector::Gripper(side) => Phase::SingleGripper(side),
                }
            }
            Phase::SingleFoot(side) if wanted != Some(Effector::Foot(side)) => Phase::Stow(side),
            Phase::SingleGripper(side) if wanted != Some(Effector::Gripper(side)) => Phase::Stow(side),
            // The foot is above its landing point and the arm folded: from here it goes down, or up again for
            // either end effector of this side.
            Phase::Stow(side) if inputs.arrived => {
                wanted_of(side).map_or(Phase::LowerFoot(side), Phase::LiftFoot)
            }
            Phase::LowerFoot(_) if inputs.arrived => Phase::Recentre,
            Phase::LowerFoot(side) if inputs.airborne => {
                wanted_of(side).map_or(Phase::LowerFoot(side), Phase::LiftFoot)
            }
            Phase::LieDown if !lowers => self.turn_back(Mode::LieDown, Phase::StandUp),
            Phase::LieDown if inputs.arrived => {
                self.mode = self.goal;
                Phase::Damped
            }
            phase => phase,
        }
    }

    fn leave_stance(&mut self) -> Phase {
        match self.goal {
            Mode::Foot(side) => Phase::ShiftTorso(Effector::Foot(side)),
            Mode::Gripper(side) => Phase::ShiftTorso(Effector::Gripper(side)),
            Mode::Locomotion => {
                self.mode = self.goal;
                Phase::Walk
            }
            Mode::LocoManipulation(arms) => Phase::Unfold(arms),
            Mode::Bimanual => Phase::Gather,
            Mode::Damped | Mode::Stance | Mode::LieDown => Phase::Stance,
        }
    }

    /// Half-way to a mode: counts as coming from it, so that goal and mode differ until the way back is done.
    fn turn_back(&mut self, from: Mode, phase: Phase) -> Phase {
        self.mode = from;
        phase
    }

    fn leave_damped(mut self, start: Start) -> Self {
        self.phase = match start {
            Start::Down => Phase::StandUp,
            Start::Standing => Phase::Recentre,
            Start::OnThree(side) => Phase::Stow(side),
        };
        self
    }
}

#[cfg(test)]
mod tests;
