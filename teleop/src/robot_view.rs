//! What the station needs to know of the robot to decide whether anything may move.

use locoman_protocol::messages::{Mode, RobotState, Severity};

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
