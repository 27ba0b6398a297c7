//! Names and order of the 18 actuated joints and of the limbs; nothing indexes joints by a bare number.
//!
//! Order everywhere in this program: legs FR, FL, RR, RL (hip, thigh, calf each: the order of the Go1's
//! motors), then arms right, left (3 joints each).

use nalgebra::SVector;

/// Actuated joints.
pub const JOINTS: usize = 18;
/// One number for each joint.
pub type JointVector = SVector<f64, JOINTS>;

/// A leg, in the order of the Go1's motor and foot-force arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Leg {
    /// Front right; carries the right arm.
    FrontRight,
    /// Front left; carries the left arm.
    FrontLeft,
    /// Rear right.
    RearRight,
    /// Rear left.
    RearLeft,
}

impl Leg {
    /// All legs, in order.
    pub const ALL: [Self; 4] = [Self::FrontRight, Self::FrontLeft, Self::RearRight, Self::RearLeft];

    /// Place in arrays of four.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Index of its hip joint; thigh and calf follow.
    pub const fn first_joint(self) -> usize {
        3 * self as usize
    }

    /// The leg on the other side.
    pub const fn across(self) -> Self {
        match self {
            Self::FrontRight => Self::FrontLeft,
            Self::FrontLeft => Self::FrontRight,
            Self::RearRight => Self::RearLeft,
            Self::RearLeft => Self::RearRight,
        }
    }

    /// The side of a front leg: that of the arm which it carries.
    pub const fn side(self) -> Option<Side> {
        match self {
            Self::FrontRight => Some(Side::Right),
            Self::FrontLeft => Some(Side::Left),
            Self::RearRight | Self::RearLeft => None,
        }
    }
}

/// A side of the body: a loco-manipulator and the front leg that carries it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// Right.
    Right,
    /// Left.
    Left,
}

impl Side {
    /// Both sides, in order.
    pub const ALL: [Self; 2] = [Self::Right, Self::Left];

    /// Place in arrays of two.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The front leg of this side.
    pub const fn leg(self) -> Leg {
        match self {
            Self::Right => Leg::FrontRight,
            Self::Left => Leg::FrontLeft,
        }
    }

    /// The rear leg of this side.
    pub const fn rear_leg(self) -> Leg {
        match self {
            Self::Right => Leg::RearRight,
            Self::Left => Leg::RearLeft,
        }
    }

    /// Index of the arm's first joint; the other two follow.
    pub const fn first_arm_joint(self) -> usize {
        12 + 3 * self as usize
    }

    /// Hip, thigh, calf and the arm's three joints.
    pub const fn limb_joints(self) -> [usize; 6] {
        let (leg, arm) = (self.leg().first_joint(), self.first_arm_joint());
        [leg, leg + 1, leg + 2, arm, arm + 1, arm + 2]
    }
}
