//! Between a joint's angle and its servo's counts.
//!
//! `count = zero + sign · angle · 4096 / 2π + 4096 · turns`; the turns are those that put the joint into its range.

use std::f64::consts::{PI, TAU};

use super::{
    registers::{MAX_GOAL, RAD_PER_COUNT},
    zeros::Zero,
};

/// How far outside its range a joint may stand before its zero is not believed, rad: soft stops and backlash.
const OUTSIDE_RAD: f64 = 0.15;

/// One servo's way between angles and counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Angles {
    sign: f64,
    /// Count at angle 0, in the turn that counts.
    zero: f64,
    range_rad: [f64; 2],
}

impl Angles {
    /// Within the turn in which the zero was found.
    pub fn new(zero: Zero, range_rad: [f64; 2]) -> Self {
        Self { sign: f64::from(zero.sign), zero: f64::from(zero.count), range_rad }
    }

    /// In the turn in which this count is nearest to the middle of the joint's range; the angle as an error if even
    /// there it is outside.
    pub fn resolved(self, count: i32) -> Result<Self, f64> {
        let middle = f64::midpoint(self.range_rad[0], self.range_rad[1]);
        let turns = ((self.angle_rad(count) - middle + PI) / TAU).floor();
        let resolved = Self { zero: self.zero + self.sign * turns * TAU / RAD_PER_COUNT, ..self };
        let angle_rad = resolved.angle_rad(count);
        let [min, max] = self.range_rad;
        if (min - OUTSIDE_RAD..=max + OUTSIDE_RAD).contains(&angle_rad) {
            Ok(resolved)
        } else {
            Err(angle_rad)
        }
    }

    /// A joint's angle, rad.
    pub fn angle_rad(&self, count: i32) -> f64 {
        self.sign * (f64::from(count) - self.zero) * RAD_PER_COUNT
    }

    /// The count of an angle, whatever the joint's range; the servo's own limit is kept.
    pub fn count(&self, angle_rad: f64) -> i32 {
        let count = self.zero + self.sign * angle_rad / RAD_PER_COUNT;
        // A number that is none becomes 0.
        (count.round() as i32).clamp(-MAX_GOAL, MAX_GOAL)
    }

    /// The servo's turning direction as the joint sees it: 1 or -1.
    pub fn sign(&self) -> f64 {
        self.sign
    }

    /// Least and greatest angle of the joint, rad.
    pub fn range_rad(&self) -> [f64; 2] {
        self.range_rad
    }

    /// The nearest angle that the joint can take, rad.
    pub fn within_range(&self, angle_rad: f64) -> f64 {
        angle_rad.clamp(self.range_rad[0], self.range_rad[1])
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::servo::{Place, ServoSettings};

    proptest! {
        #[test]
        fn the_turn_is_found_however_the_encoder_was_switched_on(
            place in prop::sample::select(Place::ALL.to_vec()),
            sign in prop::sample::select(vec![-1i8, 1]),
            zero in 0..4096i32,
            share in 0.0..1.0f64,
        ) {
            let [min, max] = ServoSettings::default().range_rad(place);
            let sut = Angles::new(Zero { id: 1, sign, count: zero }, [min, max]);
            // The range of joint 3 is a little more than a turn: at its very ends the turn is open.
            let room = (max - min - TAU).max(0.0) / 2.0 + 2.0 * RAD_PER_COUNT;
            let angle = min + room + share * (max - min - 2.0 * room);
            let switched_on = sut.count(angle).rem_euclid(4096);
            let resolved = sut.resolved(switched_on).unwrap();
            prop_assert!((resolved.angle_rad(switched_on) - angle).abs() < RAD_PER_COUNT);
            prop_assert_eq!(resolved.count(resolved.angle_rad(switched_on)), switched_on);
        }
    }

    #[test]
    fn a_joint_outside_its_range_is_not_believed() {
        let sut = Angles::new(Zero { id: 4, sign: 1, count: 0 }, [-0.08, 0.8]);
        assert!(sut.resolved(sut.count(1.5)).is_err());
        assert!(sut.resolved(sut.count(0.9)).is_ok());
    }
}
