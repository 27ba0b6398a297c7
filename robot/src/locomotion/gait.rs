//! When which foot stands: a clock that all legs share, and for each leg where it is in its cycle.
//!
//! ```text
//! phase of a leg   0 ────────── duty ───────── 1
//!                    stance          swing
//! ```
//! The clock plans; the feet decide. A foot that feels the ground early stands from then on, one that misses it keeps
//! searching, and no foot lifts that the others could not do without.

use super::settings::{ContactEvents, GaitSettings};
use crate::{joints::Leg, wbc::ContactSet};

/// Where a leg is in its cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LegPhase {
    /// On the ground for so long, s.
    Stance {
        /// Since it landed.
        for_s: f64,
    },
    /// In the air.
    Swing {
        /// Share of the planned swing that is over; above 1 the foot is late.
        progress: f64,
    },
}

/// The clock and the legs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gait {
    pattern: GaitSettings,
    events: ContactEvents,
    /// 0 to 1.
    phase: f64,
    /// Cycles a second, now.
    frequency_hz: f64,
    /// All feet stand, the clock is stopped.
    halted: bool,
    legs: [LegPhase; 4],
    /// In the stance that the clock plans, each leg lifts once at most.
    due: [bool; 4],
}

impl Gait {
    /// Halted, on four feet.
    pub fn halted(pattern: GaitSettings, events: ContactEvents) -> Self {
        let standing = LegPhase::Stance { for_s: f64::INFINITY };
        Self {
            pattern,
            events,
            phase: 0.0,
            frequency_hz: pattern.frequency_hz,
            halted: true,
            legs: [standing; 4],
            due: [false; 4],
        }
    }

    /// Whether it stands on four feet without stepping.
    pub const fn is_halted(&self) -> bool {
        self.halted
    }

    /// Where a leg is in its cycle.
    pub const fn leg(&self, leg: Leg) -> LegPhase {
        self.legs[leg.index()]
    }

    /// Duration of a planned swing, s.
    pub fn swing_s(&self) -> f64 {
        (1.0 - self.pattern.duty) / self.frequency_hz
    }

    /// Duration of a planned stance, s.
    pub fn stance_s(&self) -> f64 {
        self.pattern.duty / self.frequency_hz
    }

    /// Steps faster when the robot is off its course by a velocity, m/s: feet that stand longer would be left behind.
    pub fn hurry(&mut self, off_course_m_s: f64) {
        let GaitSettings { frequency_hz, hurry_hz_s_m, fastest_hz, .. } = self.pattern;
        self.frequency_hz = (frequency_hz + hurry_hz_s_m * off_course_m_s.max(0.0)).min(fastest_hz);
    }

    /// One step of the clock, with the vertical forces of the feet, N. If it may halt no foot lifts any more, and it halts
    /// when all stand.
    pub fn step(&mut self, dt_s: f64, may_halt: bool, foot_force: &[f64; 4]) {
        let all_stand = self.legs.iter().all(|leg| matches!(leg, LegPhase::Stance { .. }));
        if may_halt && all_stand {
            self.halted = true;
        } else if self.halted && !may_halt {
            // Every leg's stance has just begun or is not over.
            (self.halted, self.phase) = (false, 0.0);
        }
        if !self.halted {
            self.phase = (self.phase + dt_s * self.frequency_hz).fract();
        }
        for leg in Leg::ALL {
            self.step_leg(leg, dt_s, may_halt, foot_force[leg.index()]);
        }
    }

    fn step_leg(&mut self, leg: Leg, dt_s: f64, may_halt: bool, force_n: f64) {
        let planned_stance = self.halted || self.local(leg) < self.pattern.duty;
        let touches = force_n > self.events.touch_n;
        let may_lift = !may_halt && self.may_lift(leg);
        let place = leg.index();
        if planned_stance {
            self.due[place] = true;
        }
        self.legs[place] = match self.legs[place] {
            LegPhase::Stance { .. } if !planned_stance && self.due[place] && may_lift => {
                self.due[place] = false;
                LegPhase::Swing { progress: 0.0 }
            }
            LegPhase::Stance { for_s } => LegPhase::Stance { for_s: for_s + dt_s },
            LegPhase::Swing { progress } if touches && progress > self.events.earliest_touch => {
                LegPhase::Stance { for_s: 0.0 }
            }
            LegPhase::Swing { progress } => LegPhase::Swing { progress: progress + dt_s / self.swing_s() },
        };
    }

    /// A foot may lift while two others stand.
    fn may_lift(&self, leg: Leg) -> bool {
        let stands = |other: &&Leg| **other != leg && matches!(self.leg(**other), LegPhase::Stance { .. });
        Leg::ALL.iter().filter(stands).count() >= 2
    }

    /// The leg's own phase, 0 to 1.
    fn local(&self, leg: Leg) -> f64 {
        (self.phase + self.pattern.offset[leg.index()]).fract()
    }

    /// The feet that stand, with the share of the load that each may take: a foot is loaded after it lands and unloaded
    /// before it lifts.
    pub fn contacts(&self) -> ContactSet {
        let mut contacts = ContactSet::NOTHING;
        for leg in Leg::ALL {
            if let LegPhase::Stance { for_s } = self.leg(leg) {
                let left_s = if self.halted {
                    f64::INFINITY
                } else {
                    (self.pattern.duty - self.local(leg)) / self.frequency_hz
                };
                let share =
                    (for_s.min(left_s.max(0.0)) / self.events.load_s).clamp(self.events.least_share, 1.0);
                contacts = contacts.with_share(leg, share);
            }
        }
        contacts
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::locomotion::LocomotionSettings;

    const DT_S: f64 = 0.0025;

    fn sut() -> Gait {
        let LocomotionSettings { gait, contact, .. } = LocomotionSettings::default();
        Gait::halted(gait, contact)
    }

    fn in_the_air(gait: &Gait) -> usize {
        Leg::ALL.iter().filter(|leg| matches!(gait.leg(**leg), LegPhase::Swing { .. })).count()
    }

    proptest! {
        #[test]
        fn whatever_the_feet_feel_two_stand_at_least(
            forces in prop::collection::vec(prop::array::uniform4(0.0..60.0f64), 1..400),
            off_course in 0.0..3.0f64,
        ) {
            let mut sut = sut();
            for force in &forces {
                sut.hurry(off_course);
                for _ in 0..5 {
                    sut.step(DT_S, false, force);
                    prop_assert!(in_the_air(&sut) <= 2);
                    prop_assert!(sut.contacts().legs().count() + in_the_air(&sut) == 4);
                }
            }
        }

        #[test]
        fn it_halts_on_four_feet_from_any_instant_and_begins_again(walks_s in 0.0..3.0f64) {
            let mut sut = sut();
            // A foot that was in the air for 0.2 s feels the ground.
            let step = |sut: &mut Gait, may_halt: bool| {
                let force = Leg::ALL.map(|leg| match sut.leg(leg) {
                    LegPhase::Swing { progress } if progress < 0.9 => 0.0,
                    _ => 33.0,
                });
                sut.step(DT_S, may_halt, &force);
            };
            for _ in 0..(walks_s / DT_S) as usize {
                step(&mut sut, false);
            }
            for _ in 0..200 {
                step(&mut sut, true);
            }
            prop_assert!(sut.is_halted());
            prop_assert_eq!(sut.contacts(), ContactSet::STANCE);
            let mut lifted = [false; 4];
            for _ in 0..400 {
                step(&mut sut, false);
                for leg in Leg::ALL {
                    lifted[leg.index()] |= matches!(sut.leg(leg), LegPhase::Swing { .. });
                }
            }
            prop_assert_eq!(lifted, [true; 4]);
        }
    }

    #[test]
    fn a_foot_that_misses_the_ground_searches_until_it_feels_it() {
        let mut sut = sut();
        for _ in 0..400 {
            sut.step(DT_S, false, &[0.0; 4]);
        }
        let late = Leg::ALL
            .iter()
            .find(|leg| matches!(sut.leg(**leg), LegPhase::Swing { progress } if progress > 1.0));
        let late = *late.unwrap();
        sut.step(DT_S, false, &[33.0; 4]);
        assert_eq!(sut.leg(late), LegPhase::Stance { for_s: 0.0 });
    }
}
