//! What stands on the ground, and how much of the load each point may take.

use crate::{
    joints::{Leg, Side},
    model::Frame,
};

/// A point of the robot that may stand on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ContactPoint {
    /// A foot.
    Foot(Leg),
    /// The knee of the rear leg of this side, when the robot kneels.
    Knee(Side),
}

impl ContactPoint {
    /// How many there are.
    pub const COUNT: usize = 6;

    /// All of them, in the order of [`Self::index`].
    pub const ALL: [Self; Self::COUNT] = [
        Self::Foot(Leg::FrontRight),
        Self::Foot(Leg::FrontLeft),
        Self::Foot(Leg::RearRight),
        Self::Foot(Leg::RearLeft),
        Self::Knee(Side::Right),
        Self::Knee(Side::Left),
    ];

    /// Place in arrays of [`Self::COUNT`].
    pub const fn index(self) -> usize {
        match self {
            Self::Foot(leg) => leg.index(),
            Self::Knee(side) => 4 + side.index(),
        }
    }

    /// The leg that carries what it bears.
    pub const fn leg(self) -> Leg {
        match self {
            Self::Foot(leg) => leg,
            Self::Knee(side) => side.rear_leg(),
        }
    }

    /// Its frame.
    pub const fn frame(self) -> Frame {
        match self {
            Self::Foot(leg) => Frame::Foot(leg),
            Self::Knee(side) => Frame::Knee(side),
        }
    }
}

/// For each point its share of the greatest contact force: 0 in the air, 1 in full contact.
///
/// A foot is taken as a contact as soon as its share is above 0, so a foot is unloaded before it lifts, and
/// loaded after it lands, by ramping its share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactSet {
    share: [f64; ContactPoint::COUNT],
}

impl ContactSet {
    /// All four feet in full contact.
    pub const STANCE: Self = Self { share: [1.0, 1.0, 1.0, 1.0, 0.0, 0.0] };

    /// Feet and knees of the rear legs in full contact.
    pub const KNEELING: Self = Self { share: [0.0, 0.0, 1.0, 1.0, 1.0, 1.0] };

    /// All feet, and the knees.
    pub const EVERYTHING: Self = Self { share: [1.0; ContactPoint::COUNT] };

    /// Nothing.
    pub const NOTHING: Self = Self { share: [0.0; ContactPoint::COUNT] };

    /// These points in full contact.
    pub fn of(points: &[ContactPoint]) -> Self {
        points.iter().fold(Self::NOTHING, |contacts, point| contacts.with(*point, 1.0))
    }

    /// All feet but one in full contact.
    pub fn without(leg: Leg) -> Self {
        Self::STANCE.with_share(leg, 0.0)
    }

    /// The same, with another share for one foot; limited to 0 to 1, and 0 if it is not a number.
    #[must_use]
    pub fn with_share(self, leg: Leg, share: f64) -> Self {
        self.with(ContactPoint::Foot(leg), share)
    }

    /// The same, with another share for one point; limited to 0 to 1, and 0 if it is not a number.
    #[must_use]
    pub fn with(mut self, point: ContactPoint, share: f64) -> Self {
        self.share[point.index()] = if share > 0.0 { share.min(1.0) } else { 0.0 };
        self
    }

    /// Share of the greatest contact force that a foot may take.
    pub fn share(&self, leg: Leg) -> f64 {
        self.share_of(ContactPoint::Foot(leg))
    }

    /// Share of the greatest contact force that a point may take.
    pub fn share_of(&self, point: ContactPoint) -> f64 {
        self.share[point.index()]
    }

    /// Whether a foot stands on the ground.
    pub fn contains(&self, leg: Leg) -> bool {
        self.share(leg) > 0.0
    }

    /// Whether a knee is on the ground.
    pub fn kneels(&self) -> bool {
        Side::ALL.into_iter().any(|side| self.share_of(ContactPoint::Knee(side)) > 0.0)
    }

    /// The legs whose feet stand on the ground, in order.
    pub fn legs(&self) -> impl Iterator<Item = Leg> + '_ {
        Leg::ALL.into_iter().filter(|leg| self.contains(*leg))
    }

    /// What stands on the ground, in order.
    pub fn points(&self) -> impl Iterator<Item = ContactPoint> + '_ {
        ContactPoint::ALL.into_iter().filter(|point| self.share_of(*point) > 0.0)
    }
}
