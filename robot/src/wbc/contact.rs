//! Which feet stand on the ground, and how much of the load each may take.

use crate::joints::Leg;

/// For each leg its share of the greatest contact force: 0 in the air, 1 in full contact.
///
/// A foot is taken as a contact as soon as its share is above 0, so a foot is unloaded before it lifts, and
/// loaded after it lands, by ramping its share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactSet {
    share: [f64; 4],
}

impl ContactSet {
    /// All four feet in full contact.
    pub const STANCE: Self = Self { share: [1.0; 4] };

    /// These feet in full contact.
    pub fn of(legs: &[Leg]) -> Self {
        legs.iter().fold(Self { share: [0.0; 4] }, |contacts, leg| contacts.with_share(*leg, 1.0))
    }

    /// All feet but one in full contact.
    pub fn without(leg: Leg) -> Self {
        Self::STANCE.with_share(leg, 0.0)
    }

    /// The same, with another share for one leg; limited to 0 to 1, and 0 if it is not a number.
    #[must_use]
    pub fn with_share(mut self, leg: Leg, share: f64) -> Self {
        self.share[leg.index()] = if share > 0.0 { share.min(1.0) } else { 0.0 };
        self
    }

    /// Share of the greatest contact force that a foot may take.
    pub fn share(&self, leg: Leg) -> f64 {
        self.share[leg.index()]
    }

    /// Whether a foot stands on the ground.
    pub fn contains(&self, leg: Leg) -> bool {
        self.share(leg) > 0.0
    }

    /// The legs that stand on the ground, in order.
    pub fn legs(&self) -> impl Iterator<Item = Leg> + '_ {
        Leg::ALL.into_iter().filter(|leg| self.contains(*leg))
    }

    /// Which feet stand on the ground, a bit for each leg.
    pub fn pattern(&self) -> usize {
        self.legs().fold(0, |pattern, leg| pattern | 1 << leg.index())
    }
}
