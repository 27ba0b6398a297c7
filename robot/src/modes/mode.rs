//! What an operator may ask for, and the steps on the way there.

use locoman_protocol::messages;

use crate::joints::Side;

/// The end effector in manipulation: m in the paper's table of operation modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Effector {
    /// A front foot.
    Foot(Side),
    /// A gripper, with the leg that carries it.
    Gripper(Side),
}

impl Effector {
    /// The side whose front foot lifts.
    pub const fn side(self) -> Side {
        match self {
            Self::Foot(side) | Self::Gripper(side) => side,
        }
    }

    /// The mode in which it is driven.
    pub const fn mode(self) -> Mode {
        match self {
            Self::Foot(side) => Mode::Foot(side),
            Self::Gripper(side) => Mode::Gripper(side),
        }
    }
}

/// What an operator may ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mode {
    /// No position control; the joints resist motion softly.
    Damped,
    /// Standing on four feet, the torso follows.
    Stance,
    /// Standing on three feet, torso and the front foot in the air follow.
    Foot(Side),
    /// Standing on three feet, torso and gripper follow.
    Gripper(Side),
    /// Lying on the belly, then damped.
    LieDown,
}

impl Mode {
    /// The end effector that is driven.
    pub const fn effector(self) -> Option<Effector> {
        match self {
            Self::Foot(side) => Some(Effector::Foot(side)),
            Self::Gripper(side) => Some(Effector::Gripper(side)),
            Self::Damped | Self::Stance | Self::LieDown => None,
        }
    }

    /// From the wire; nothing for an unspecified mode.
    pub fn from_message(mode: messages::Mode) -> Option<Self> {
        match mode {
            messages::Mode::Unspecified => None,
            messages::Mode::Damped => Some(Self::Damped),
            messages::Mode::Stance => Some(Self::Stance),
            messages::Mode::RightFoot => Some(Self::Foot(Side::Right)),
            messages::Mode::LeftFoot => Some(Self::Foot(Side::Left)),
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
            Self::Foot(Side::Right) => messages::Mode::RightFoot,
            Self::Foot(Side::Left) => messages::Mode::LeftFoot,
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
    /// On four feet: the centre of mass goes to where the other three feet carry it.
    ShiftTorso(Effector),
    /// The leg is unloaded and lifted; for a gripper, its arm unfolds.
    LiftFoot(Effector),
    /// On three feet, the operator moves torso and foot.
    SingleFoot(Side),
    /// On three feet, the operator moves torso and gripper.
    SingleGripper(Side),
    /// The leg goes back to above its landing point, its arm folds.
    Stow(Side),
    /// The foot goes down until it carries load.
    LowerFoot(Side),
    /// Joints go to the fold, then damp.
    LieDown,
}

impl Phase {
    /// All of them.
    pub const ALL: [Self; 21] = [
        Self::Damped,
        Self::StandUp,
        Self::Recentre,
        Self::Stance,
        Self::ShiftTorso(Effector::Foot(Side::Right)),
        Self::ShiftTorso(Effector::Foot(Side::Left)),
        Self::ShiftTorso(Effector::Gripper(Side::Right)),
        Self::ShiftTorso(Effector::Gripper(Side::Left)),
        Self::LiftFoot(Effector::Foot(Side::Right)),
        Self::LiftFoot(Effector::Foot(Side::Left)),
        Self::LiftFoot(Effector::Gripper(Side::Right)),
        Self::LiftFoot(Effector::Gripper(Side::Left)),
        Self::SingleFoot(Side::Right),
        Self::SingleFoot(Side::Left),
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
            Self::SingleFoot(_) => "single foot",
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
                | Self::SingleFoot(_)
                | Self::SingleGripper(_)
                | Self::Stow(_)
                | Self::LowerFoot(_)
        )
    }

    /// The operator moves the robot.
    pub const fn is_driven(self) -> bool {
        matches!(self, Self::Stance | Self::SingleFoot(_) | Self::SingleGripper(_))
    }
}
