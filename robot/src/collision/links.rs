//! Which links there are, and which of them can meet.

use serde::Deserialize;

use crate::joints::Leg;

/// A kind of link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// The torso.
    Trunk,
    /// What the hip joint turns.
    Hip,
    /// The motor at the upper end of the thigh.
    Motor,
    /// The rest of the thigh, with the knee.
    Thigh,
    /// The calf with its foot.
    Calf,
    /// What holds the arm on a front calf.
    Mount,
    /// What the arm's first joint turns.
    Forearm,
    /// What the arm's second joint turns.
    Wrist,
    /// What the arm's third joint turns.
    Gripper,
}

impl Part {
    /// All parts.
    pub const ALL: [Self; 9] = [
        Self::Trunk,
        Self::Hip,
        Self::Motor,
        Self::Thigh,
        Self::Calf,
        Self::Mount,
        Self::Forearm,
        Self::Wrist,
        Self::Gripper,
    ];

    /// Whether an arm's joints turn it.
    pub const fn is_of_arm(self) -> bool {
        matches!(self, Self::Forearm | Self::Wrist | Self::Gripper)
    }

    /// Whether only front limbs have it.
    const fn is_front_only(self) -> bool {
        matches!(self, Self::Mount | Self::Forearm | Self::Wrist | Self::Gripper)
    }

    /// How many joints lie between it and the torso.
    const fn depth(self) -> usize {
        match self {
            Self::Trunk => 0,
            Self::Hip => 1,
            Self::Motor | Self::Thigh => 2,
            Self::Calf | Self::Mount => 3,
            Self::Forearm => 4,
            Self::Wrist => 5,
            Self::Gripper => 6,
        }
    }
}

/// A link of this robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Link {
    /// What it is.
    pub part: Part,
    /// The limb that it belongs to; nothing for the trunk.
    pub leg: Option<Leg>,
}

impl Link {
    /// All links of a kind.
    pub fn all(part: Part) -> impl Iterator<Item = Self> {
        let trunk = (part == Part::Trunk).then_some(Self { part, leg: None });
        let limbs = Leg::ALL
            .into_iter()
            .filter(move |leg| part != Part::Trunk && (!part.is_front_only() || leg.side().is_some()));
        trunk.into_iter().chain(limbs.map(move |leg| Self { part, leg: Some(leg) }))
    }

    /// The joint that turns it; nothing for the trunk.
    pub fn joint(self) -> Option<usize> {
        let leg = self.leg?;
        match self.part.depth() {
            0 => None,
            depth @ 1..=3 => Some(leg.first_joint() + depth - 1),
            depth => leg.side().map(|side| side.first_arm_joint() + depth - 4),
        }
    }

    /// Whether it belongs to the left half of the robot.
    pub(super) fn is_left(self) -> bool {
        matches!(self.leg, Some(Leg::FrontLeft | Leg::RearLeft))
    }
}

/// As the file names it.
impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Trunk => "trunk",
            Self::Hip => "hip",
            Self::Motor => "motor",
            Self::Thigh => "thigh",
            Self::Calf => "calf",
            Self::Mount => "mount",
            Self::Forearm => "forearm",
            Self::Wrist => "wrist",
            Self::Gripper => "gripper",
        })
    }
}

impl std::fmt::Display for Link {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let leg = match self.leg {
            None => return self.part.fmt(f),
            Some(Leg::FrontRight) => "front right",
            Some(Leg::FrontLeft) => "front left",
            Some(Leg::RearRight) => "rear right",
            Some(Leg::RearLeft) => "rear left",
        };
        write!(f, "{leg} {}", self.part)
    }
}

/// Whether two links are to be kept apart.
///
/// What moves is a front limb beyond its hip. Left out are neighbours, links with one joint's range between
/// them (which keeps them apart), and what never comes nearer than 1 cm within the joints' ranges; a test
/// samples those. Rear legs always stand: they are obstacles for the front limbs, not for each other.
pub(super) fn can_meet(first: Link, second: Link) -> bool {
    [(first, second), (second, first)].into_iter().any(|(moving, other)| {
        let is_front = moving.leg.is_some_and(|leg| leg.side().is_some());
        is_front && meets(moving, other)
    })
}

fn meets(moving: Link, other: Link) -> bool {
    use Part::{Calf, Forearm, Gripper, Hip, Motor, Mount, Thigh, Trunk, Wrist};
    let (part, met) = (moving.part, other.part);
    let Some(leg) = other.leg else { return matches!(part, Thigh | Calf | Mount | Wrist | Gripper) };
    let beyond_knee = matches!(part, Calf | Mount | Forearm | Wrist | Gripper);
    if moving.leg == other.leg {
        return match met {
            Trunk => false,
            Hip => part == Gripper,
            Motor | Thigh => matches!(part, Forearm | Wrist | Gripper),
            Calf => matches!(part, Wrist | Gripper),
            Mount | Forearm | Wrist | Gripper => false,
        };
    }
    if leg.side().is_some() {
        return (beyond_knee || part == Thigh) && met != Hip || part == Motor && met == Thigh;
    }
    beyond_knee && (met == Calf || other.is_left() == moving.is_left())
}
