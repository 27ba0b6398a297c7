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

/// Arms that work while the robot walks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Arms {
    /// One of them.
    One(Side),
    /// Both.
    Both,
}

impl Arms {
    /// All choices.
    pub const ALL: [Self; 3] = [Self::One(Side::Right), Self::One(Side::Left), Self::Both];

    /// Whether this one works.
    pub fn contain(self, side: Side) -> bool {
        match self {
            Self::One(one) => one == side,
            Self::Both => true,
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
    /// Walking.
    Locomotion,
    /// Walking, while arms hold and turn their grippers.
    LocoManipulation(Arms),
    /// Sitting upright, both grippers follow.
    Bimanual,
    /// Lying on the belly, then damped.
    LieDown,
}

impl Mode {
    /// The end effector that is driven.
    pub const fn effector(self) -> Option<Effector> {
        match self {
            Self::Foot(side) => Some(Effector::Foot(side)),
            Self::Gripper(side) => Some(Effector::Gripper(side)),
            Self::Damped
            | Self::Stance
            | Self::Locomotion
            | Self::LocoManipulation(_)
            | Self::Bimanual
            | Self::LieDown => None,
        }
    }

    /// Whether the robot moves at all in it, beyond standing and lying.
    pub const fn is_of_motion(self) -> bool {
        !matches!(self, Self::Damped | Self::Stance | Self::LieDown)
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
            messages::Mode::Locomotion => Some(Self::Locomotion),
            messages::Mode::RightLocoManipulation => Some(Self::LocoManipulation(Arms::One(Side::Right))),
            messages::Mode::LeftLocoManipulation => Some(Self::LocoManipulation(Arms::One(Side::Left))),
            messages::Mode::LocoManipulation => Some(Self::LocoManipulation(Arms::Both)),
            messages::Mode::Bimanual => Some(Self::Bimanual),
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
            Self::Locomotion => messages::Mode::Locomotion,
            Self::LocoManipulation(Arms::One(Side::Right)) => messages::Mode::RightLocoManipulation,
            Self::LocoManipulation(Arms::One(Side::Left)) => messages::Mode::LeftLocoManipulation,
            Self::LocoManipulation(Arms::Both) => messages::Mode::LocoManipulation,
            Self::Bimanual => messages::Mode::Bimanual,
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
    /// Walking, or standing ready to; the operator moves the robot.
    Walk,
    /// On four feet: arms unfold.
    Unfold(Arms),
    /// The same as `Walk`, and the operator turns grippers.
    WalkHolding(Arms),
    /// Slows down, steps until all feet are in their places, stands. Arms fold.
    Halt,
    /// Feet step to under the hips, if they are not there.
    Gather,
    /// The torso goes back and the knees to the ground, until shanks alone carry.
    Kneel,
    /// The torso rises, leg and arm of each side come before it.
    SitUp,
    /// Upright, the operator moves both grippers.
    Bimanual,
    /// The torso comes down until the front feet are on the ground.
    SitDown,
    /// The knees leave the ground, the torso goes over the feet.
    GetUp,
    /// Joints go to the fold, then damp.
    LieDown,
}

impl Phase {
    /// All of them.
    pub const ALL: [Self; 35] = [
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
        Self::Walk,
        Self::Unfold(Arms::One(Side::Right)),
        Self::Unfold(Arms::One(Side::Left)),
        Self::Unfold(Arms::Both),
        Self::WalkHolding(Arms::One(Side::Right)),
        Self::WalkHolding(Arms::One(Side::Left)),
        Self::WalkHolding(Arms::Both),
        Self::Halt,
        Self::Gather,
        Self::Kneel,
        Self::SitUp,
        Self::Bimanual,
        Self::SitDown,
        Self::GetUp,
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
            Self::Walk => "walk",
            Self::Unfold(_) => "unfold arms",
            Self::WalkHolding(_) => "walk and hold",
            Self::Halt => "halt",
            Self::Gather => "gather feet",
            Self::Kneel => "kneel",
            Self::SitUp => "sit up",
            Self::Bimanual => "bimanual",
            Self::SitDown => "sit down",
            Self::GetUp => "get up",
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
        ) || self.is_kneeling()
    }

    /// On the shanks of the rear legs, or on the way there or back.
    pub const fn is_kneeling(self) -> bool {
        matches!(self, Self::Kneel | Self::SitUp | Self::Bimanual | Self::SitDown | Self::GetUp)
    }

    /// The torso is upright, or on the way there or back: it leans as far as it should.
    pub const fn is_upright(self) -> bool {
        matches!(self, Self::SitUp | Self::Bimanual | Self::SitDown)
    }

    /// The operator moves the robot.
    pub const fn is_driven(self) -> bool {
        matches!(
            self,
            Self::Stance
                | Self::SingleFoot(_)
                | Self::SingleGripper(_)
                | Self::Walk
                | Self::WalkHolding(_)
                | Self::Bimanual
        )
    }

    /// The robot walks, or may at any time.
    pub const fn is_walking(self) -> bool {
        matches!(self, Self::Walk | Self::WalkHolding(_) | Self::Gather | Self::Halt)
    }
}
