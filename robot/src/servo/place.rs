//! Where a servo sits. Nothing else says which servo is which: neither ids nor positions in arrays.
//!
//! Order in arrays of eight: arms right, left (joints 1, 2, 3), then grippers right, left: the order of the robot's
//! joints ([`crate::joints`]), and its openings after them.

use std::{fmt, str::FromStr};

use crate::joints::Side;

/// Servos on the bus.
pub const SERVOS: usize = 8;

/// What a servo moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Part {
    /// Joint 1, 2 or 3 of an arm, counted from 0.
    Joint(u8),
    /// The jaws.
    Gripper,
}

/// A servo's place on the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Place {
    /// Which limb.
    pub side: Side,
    /// What it moves.
    pub part: Part,
}

impl Place {
    /// All places, in order.
    pub const ALL: [Self; SERVOS] = [
        Self::joint(Side::Right, 0),
        Self::joint(Side::Right, 1),
        Self::joint(Side::Right, 2),
        Self::joint(Side::Left, 0),
        Self::joint(Side::Left, 1),
        Self::joint(Side::Left, 2),
        Self { side: Side::Right, part: Part::Gripper },
        Self { side: Side::Left, part: Part::Gripper },
    ];

    const fn joint(side: Side, joint: u8) -> Self {
        Self { side, part: Part::Joint(joint) }
    }

    /// Place in arrays of eight.
    pub const fn index(self) -> usize {
        match self.part {
            Part::Joint(joint) => 3 * self.side.index() + joint as usize,
            Part::Gripper => 6 + self.side.index(),
        }
    }

    /// Place among the four servos of its limb.
    pub const fn in_limb(self) -> usize {
        match self.part {
            Part::Joint(joint) => joint as usize,
            Part::Gripper => 3,
        }
    }

    /// Whether it moves the jaws.
    pub fn is_gripper(self) -> bool {
        self.part == Part::Gripper
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let side = match self.side {
            Side::Right => "right",
            Side::Left => "left",
        };
        match self.part {
            Part::Joint(joint) => write!(f, "{side}-{}", joint + 1),
            Part::Gripper => write!(f, "{side}-gripper"),
        }
    }
}

/// A name that is no place.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no servo's place; they are right-1, right-2, right-3, right-gripper, left-1, left-2, left-3, left-gripper"
)]
pub struct NoPlace(String);

impl FromStr for Place {
    type Err = NoPlace;

    fn from_str(text: &str) -> Result<Self, NoPlace> {
        Self::ALL.into_iter().find(|place| place.to_string() == text).ok_or_else(|| NoPlace(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_place_has_an_index_and_a_name_of_its_own() {
        for (index, place) in Place::ALL.into_iter().enumerate() {
            assert_eq!(place.index(), index);
            assert_eq!(place.to_string().parse(), Ok(place));
        }
        assert!("right-4".parse::<Place>().is_err());
    }
}
