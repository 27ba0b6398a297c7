//! What the station needs to know of the robot to decide whether anything may move.

use locoman_protocol::messages::{Mode, RobotState, Severity};

use crate::stick::{Hand, Target};

/// A digest of the last `RobotState`.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotView {
    /// When it arrived, on this machine's clock; staleness is judged by this alone.
    pub received_ns: u64,
    /// Which process sent it: a changed one has forgotten everything.
    pub source: u64,
    /// What the robot does.
    pub mode: Mode,
    /// Where it is heading; equals `mode` when it has arrived.
    pub goal: Mode,
    /// How bad things are.
    pub severity: Severity,
    /// Gripper openings right, left.
    pub openings: [f64; 2],
}

impl RobotView {
    /// Reads a state message.
    pub fn new(state: &RobotState, received_ns: u64) -> Self {
        Self {
            received_ns,
            source: state.header.as_ref().map_or(0, |header| header.source),
            mode: state.mode(),
            goal: state.goal(),
            severity: state.severity(),
            openings: [state.right_opening, state.left_opening],
        }
    }

    /// Whether the machine has arrived in `mode`.
    pub fn in_mode(&self, mode: Mode) -> bool {
        self.mode == mode && self.goal == mode
    }

    /// The side (0 right, 1 left) that the robot manipulates with, by foot or gripper.
    pub fn side(&self) -> Option<usize> {
        match self.mode {
            _ if self.goal != self.mode => None,
            Mode::RightGripper | Mode::RightFoot | Mode::RightLocoManipulation => Some(0),
            Mode::LeftGripper | Mode::LeftFoot | Mode::LeftLocoManipulation => Some(1),
            _ => None,
        }
    }

    /// What sticks drive, and the side (0 right, 1 left) that they are for. Upright both grippers work: where there is a
    /// choice between torso and end effector, there is one between left and right.
    pub fn driven(&self, hand: &Hand) -> (Hand, Option<usize>) {
        if !self.in_mode(Mode::Bimanual) {
            return (*hand, self.side());
        }
        let side = match hand.target {
            Target::Effector => 0,
            Target::Torso => 1,
        };
        (Hand { target: Target::Effector, ..*hand }, Some(side))
    }

    /// Whether it walks when it is told to.
    pub fn walks(&self) -> bool {
        use Mode::{LeftLocoManipulation, LocoManipulation, Locomotion, RightLocoManipulation};
        self.goal == self.mode
            && matches!(
                self.mode,
                Locomotion | LocoManipulation | RightLocoManipulation | LeftLocoManipulation
            )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn upright_the_target_chooses_the_hand() {
        let mut sut = RobotView::new(&RobotState::default(), 0);
        (sut.mode, sut.goal) = (Mode::Bimanual, Mode::Bimanual);
        for (target, side) in [(Target::Effector, 0), (Target::Torso, 1)] {
            let (hand, driven) = sut.driven(&Hand { target, ..Hand::default() });
            assert_eq!((hand.target, driven), (Target::Effector, Some(side)));
        }
        sut.goal = Mode::Stance;
        assert_eq!(sut.driven(&Hand::default()).1, None);
    }
}
