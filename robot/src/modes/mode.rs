//! What an operator may ask for, and the steps on the way there.

use locoman_protocol::messages;

use crate::joints::Side;

/// What an operator may ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mode {
    /// No position control; the joints resist motion softly.
    Damped,
    /// Standing on four feet, the torso follows.
    Stance,
    /// Standing on three feet, torso and gripper follow.
    Gripper(Side),
    /// Lying on the belly, then damped.
    LieDown,
}

impl Mode {
    /// From the wire; nothing for an unspecified mode.
    pub fn from_message(mode: messages::Mode) -> Option<Self> {
        match mode {
            messages::Mode::Unspecified => None,
            messages::Mode::Damped => Some(Self::Damped),
            messages::Mode::Stance => Some(Self::Stance),
            messages::Mode::RightGripper => Some(Self::Gripper(Side::Right)),
            messages::Mode::LeftGripper => Some(Self::Gripper(Side::Left)),
            messages::Mode::LieDown => Some(Self::LieDown),
        }
    }

    /// On the wire.
    pub fn to_message(self) -> messages::Mode {
        match self {
            Self::Damped => messages::Mode::Damped,
            Self::Stance => messages::Mode::Stance,
            Self::Gripper(Side::Right) => messages::Mode::RightGripper,
            Self::Gripper(Side::Left) => messages::Mode::LeftGripper,
            Self::LieDown => messages::Mode::LieDown,
        }
    }
}

/// What the robot is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Phase {
    /// Damping, after lying down or before standing up.
    Damped,
    /// Joints go from wherever they are to the stand.
    StandUp,
    /// On four feet: the torso goes to the middle of the feet, arms are stowed.
    Recentre,
    /// On four feet, the operator moves the torso.
    Stance,
    /// On four feet: the torso goes back and away from the leg that is to lift.
    ShiftTorso(Side),
    /// The leg is unloaded and lifted, its arm unfolds.
    LiftFoot(Side),
    /// On three feet, the operator moves torso and gripper.
    SingleGripper(Side),
    /// The arm folds, the foot stays in the air.
    Stow(Side),
    /// The foot goes down until it carries load.
    LowerFoot(Side),
    /// Joints go to the fold, then damp.
    LieDown,
}

impl Phase {
    /// All of them.
    pub const ALL: [Self; 15] = [
        Self::Damped,
        Self::StandUp,
        Self::Recentre,
        Self::Stance,
        Self::ShiftTorso(Side::Right),
        Self::ShiftTorso(Side::Left),
        Self::LiftFoot(Side::Right),
        Self::LiftFoot(Side::Left),
        Self::SingleGripper(Side::Right),
        Self::SingleGripper(Side::Left),
        Self::Stow(Side::Right),
        Self::Stow(Side::Left),
        Self::LowerFoot(Side::Right),
        Self::LowerFoot(Side::Left),
        Self::LieDown,
    ];

    /// For people.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Damped => "damped",
            Self::StandUp => "stand up",
            Self::Recentre => "recentre",
            Self::Stance => "stance",
            Self::ShiftTorso(_) => "shift torso",
            Self::LiftFoot(_) => "lift foot",
            Self::SingleGripper(_) => "single gripper",
            Self::Stow(_) => "stow",
            Self::LowerFoot(_) => "lower foot",
            Self::LieDown => "lie down",
        }
    }

    /// The whole-body controller is at work; else the joints follow plain set-points.
    pub const fn is_balanced(self) -> bool {
        !matches!(self, Self::Damped | Self::StandUp | Self::LieDown)
    }

    /// A foot is in the air, or about to be.
    pub const fn is_manipulating(self) -> bool {
        matches!(
            self,
            Self::ShiftTorso(_)
                | Self::LiftFoot(_)
                | Self::SingleGripper(_)
                | Self::Stow(_)
                | Self::LowerFoot(_)
        )
    }

    /// The operator moves the robot.
    pub const fn is_driven(self) -> bool {
        matches!(self, Self::Stance | Self::SingleGripper(_))
    }
}
