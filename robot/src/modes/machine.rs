//! The state machine of modes: decides what to do next, and nothing else. It has no clock and does no I/O:
//! the same state and inputs always give the same next state.

use super::mode::{Mode, Phase};
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
        if inputs.control_fault && matches!(mode, Mode::Gripper(_)) {
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
                if matches!(self.goal, Mode::Gripper(_)) {
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
        let side_wanted = match self.goal {
            Mode::Gripper(side) => Some(side),
            _ => None,
        };
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
            Phase::Stance => side_wanted.map_or(Phase::Stance, Phase::ShiftTorso),
            Phase::ShiftTorso(side) if side_wanted != Some(side) => {
                self.turn_back(Mode::Gripper(side), Phase::Recentre)
            }
            Phase::ShiftTorso(side) if inputs.arrived => Phase::LiftFoot(side),
            Phase::LiftFoot(side) if side_wanted != Some(side) => {
                let back = if inputs.airborne { Phase::Stow(side) } else { Phase::Recentre };
                self.turn_back(Mode::Gripper(side), back)
            }
            Phase::LiftFoot(side) if inputs.arrived => {
                self.mode = Mode::Gripper(side);
                Phase::SingleGripper(side)
            }
            Phase::SingleGripper(side) if side_wanted != Some(side) => Phase::Stow(side),
            Phase::Stow(side) if inputs.arrived => {
                if side_wanted == Some(side) {
                    Phase::LiftFoot(side)
                } else {
                    Phase::LowerFoot(side)
                }
            }
            Phase::LowerFoot(_) if inputs.arrived => Phase::Recentre,
            Phase::LowerFoot(side) if inputs.airborne && side_wanted == Some(side) => Phase::LiftFoot(side),
            Phase::LieDown if !lowers => self.turn_back(Mode::LieDown, Phase::StandUp),
            Phase::LieDown if inputs.arrived => {
                self.mode = self.goal;
                Phase::Damped
            }
            phase => phase,
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
mod tests {
    use std::collections::HashSet;

    use super::*;

    fn calm() -> Inputs {
        Inputs {
            request: None,
            severity: Severity::None,
            tilted: false,
            control_fault: false,
            arrived: false,
            airborne: true,
            start: Start::Down,
        }
    }

    fn ask(sut: &mut Machine, mode: Mode) -> Option<Refusal> {
        sut.step(&Inputs { request: Some(mode), ..calm() })
    }

    /// Lets every motion arrive until the phase no longer changes; returns the phases on the way.
    fn run(sut: &mut Machine, inputs: &Inputs) -> Vec<Phase> {
        let mut way = vec![sut.phase()];
        for _ in 0..20 {
            sut.step(&Inputs { arrived: true, ..*inputs });
            if way.last() != Some(&sut.phase()) {
                way.push(sut.phase());
            }
        }
        way
    }

    fn standing() -> Machine {
        let mut sut = Machine::started(Start::Standing, false);
        run(&mut sut, &calm());
        sut
    }

    #[test]
    fn a_robot_that_lies_stays_damped_until_asked_and_one_that_stands_goes_on_standing() {
        assert_eq!(Machine::started(Start::Down, false).phase(), Phase::Damped);
        assert_eq!(Machine::started(Start::Down, true).phase(), Phase::StandUp);
        assert_eq!(Machine::started(Start::Standing, false).phase(), Phase::Recentre);
        assert_eq!(Machine::started(Start::OnThree(Side::Left), false).phase(), Phase::Stow(Side::Left));
    }

    #[test]
    fn from_lying_to_a_gripper_and_back_every_step_is_taken() {
        let mut sut = Machine::default();
        assert_eq!(ask(&mut sut, Mode::Gripper(Side::Right)), None);
        let right = Side::Right;
        assert_eq!(
            run(&mut sut, &calm()),
            [
                Phase::StandUp,
                Phase::Recentre,
                Phase::Stance,
                Phase::ShiftTorso(right),
                Phase::LiftFoot(right),
                Phase::SingleGripper(right)
            ]
        );
        assert_eq!(sut.mode(), Mode::Gripper(right));
        ask(&mut sut, Mode::LieDown);
        assert_eq!(
            run(&mut sut, &calm()),
            [
                Phase::Stow(right),
                Phase::LowerFoot(right),
                Phase::Recentre,
                Phase::Stance,
                Phase::LieDown,
                Phase::Damped
            ]
        );
    }

    #[test]
    fn from_one_gripper_to_the_other_goes_through_stance() {
        let mut sut = standing();
        ask(&mut sut, Mode::Gripper(Side::Right));
        run(&mut sut, &calm());
        ask(&mut sut, Mode::Gripper(Side::Left));
        let way = run(&mut sut, &calm());
        assert!(way.contains(&Phase::Stance));
        assert_eq!(sut.phase(), Phase::SingleGripper(Side::Left));
    }

    #[test]
    fn a_changed_mind_turns_back_without_standing_on_a_foot_that_is_up() {
        let mut sut = standing();
        ask(&mut sut, Mode::Gripper(Side::Left));
        sut.step(&Inputs { arrived: true, ..calm() });
        assert_eq!(sut.phase(), Phase::LiftFoot(Side::Left));
        ask(&mut sut, Mode::Stance);
        assert_eq!(sut.phase(), Phase::Stow(Side::Left));
        assert_ne!(sut.mode(), sut.goal(), "not there yet");
        assert_eq!(run(&mut sut, &calm()).last(), Some(&Phase::Stance));
    }

    #[test]
    fn r_safe_010_damping_is_immediate_from_every_phase() {
        for phase in Phase::ALL {
            let mut sut = Machine { phase, mode: Mode::Stance, goal: Mode::Stance };
            sut.step(&Inputs { severity: Severity::Damp, ..calm() });
            assert_eq!(sut, Machine::default());
        }
    }

    #[test]
    fn r_safe_011_a_leaning_robot_refuses_to_lift_a_foot_but_may_lie_down() {
        let mut sut = standing();
        let leaning = Inputs { tilted: true, severity: Severity::Stand, ..calm() };
        let ask = |mode| Inputs { request: Some(mode), ..leaning };
        assert_eq!(sut.step(&ask(Mode::Gripper(Side::Right))), Some(Refusal::Tilted));
        assert_eq!(sut.phase(), Phase::Stance);
        assert_eq!(sut.step(&ask(Mode::LieDown)), None);
        assert_eq!(sut.phase(), Phase::LieDown);
    }

    #[test]
    fn r_safe_012_while_stopping_nothing_else_is_accepted() {
        let mut sut = standing();
        let stopping = Inputs { severity: Severity::LieDown, ..calm() };
        let ask = Inputs { request: Some(Mode::Gripper(Side::Right)), ..stopping };
        assert_eq!(sut.step(&ask), Some(Refusal::Stopping));
        assert_eq!(run(&mut sut, &stopping).last(), Some(&Phase::Damped));
    }

    /// All states that any inputs can lead to within `depth` steps.
    fn reachable(from: Machine, depth: usize) -> HashSet<Machine> {
        let modes = [
            None,
            Some(Mode::Damped),
            Some(Mode::Stance),
            Some(Mode::LieDown),
            Some(Mode::Gripper(Side::Right)),
            Some(Mode::Gripper(Side::Left)),
        ];
        let severities = [Severity::None, Severity::Stand, Severity::LieDown, Severity::Damp];
        let starts = [Start::Down, Start::Standing, Start::OnThree(Side::Right)];
        let mut known = HashSet::from([from]);
        let mut frontier = vec![from];
        for _ in 0..depth {
            let mut next = Vec::new();
            for machine in frontier {
                for request in modes {
                    for severity in severities {
                        for start in starts {
                            for bits in 0..8 {
                                let mut sut = machine;
                                sut.step(&Inputs {
                                    request,
                                    severity,
                                    tilted: bits & 1 != 0,
                                    control_fault: false,
                                    arrived: bits & 2 != 0,
                                    airborne: bits & 4 != 0,
                                    start,
                                });
                                if known.insert(sut) {
                                    next.push(sut);
                                }
                            }
                        }
                    }
                }
            }
            frontier = next;
        }
        known
    }

    #[test]
    fn every_state_that_can_be_reached_can_lie_down_and_stand_up_again() {
        let states = reachable(Machine::default(), 12);
        assert!(states.len() > 30, "{}", states.len());
        for state in states {
            let mut sut = state;
            run(&mut sut, &Inputs { severity: Severity::LieDown, ..calm() });
            assert_eq!(sut.phase(), Phase::Damped, "{state:?}");
            ask(&mut sut, Mode::Stance);
            run(&mut sut, &calm());
            assert_eq!(sut.phase(), Phase::Stance, "{state:?}");
        }
    }
}
