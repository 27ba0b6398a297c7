//! Follows a target that arrives in samples, smoothly and within limits, and knows its own velocity and
//! acceleration: what the whole-body controller needs as feed-forward.
//!
//! Without limits it is the critically damped second-order filter ẍ = ω² e - 2 ω ẋ, so it delays slow motion
//! by a constant 2/ω. It is written as a cascade, ẍ = 2 ω (v_wanted - ẋ) with v_wanted = ω/2 e, in order to
//! limit both: v_wanted to the greatest speed and to √(a e) (from where it can still brake), ẍ to the
//! greatest acceleration a.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::{limits::RateLimits, reference::PoseReference};

/// Share of the greatest acceleration that braking plans with; the rest is for the filter's own lag.
const BRAKING_SHARE: f64 = 0.5;

/// Velocity at which to close an error, to rest where it is zero.
fn closing(error: &Vector3<f64>, omega: f64, limit: f64) -> Vector3<f64> {
    let distance = error.norm();
    let speed = (omega / 2.0 * distance).min((2.0 * BRAKING_SHARE * limit * distance).sqrt());
    if distance > 1e-12 { error * (speed / distance) } else { Vector3::zeros() }
}

/// ẍ = 2 ω (v_wanted - ẋ), limited.
fn acceleration(
    wanted: &Vector3<f64>,
    velocity: &Vector3<f64>,
    omega: f64,
    speed: f64,
    limit: f64,
) -> Vector3<f64> {
    (2.0 * omega * (wanted.cap_magnitude(speed) - velocity)).cap_magnitude(limit)
}

/// What a motion that knows where it goes asks of a follower.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lead {
    /// Where the motion is now.
    pub motion: PoseReference,
    /// How far to go along, from 0 to 1; for the rest, the target is followed.
    pub share: f64,
}

/// A pose that follows a target pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseFollower {
    reference: PoseReference,
    omega: f64,
    limits: RateLimits,
}

impl PoseFollower {
    /// Starts as the reference moves.
    pub fn new(reference: PoseReference, omega: f64, limits: RateLimits) -> Self {
        Self { reference, omega, limits }
    }

    /// Where it is and how it moves.
    pub fn reference(&self) -> &PoseReference {
        &self.reference
    }

    /// Goes on from there, as that moves.
    pub fn place(&mut self, reference: PoseReference) {
        self.reference = reference;
    }

    /// The target at which the follower comes to rest without turning back: ahead by ẋ/ω, or by the braking
    /// distance if that is longer.
    pub fn stopping_pose(&self) -> Isometry3<f64> {
        let PoseReference { point, rotation } = &self.reference;
        let ahead = |velocity: &Vector3<f64>, limit: f64| {
            let time_s = (1.0 / self.omega).max(velocity.norm() / (2.0 * BRAKING_SHARE * limit));
            velocity * time_s
        };
        let way = ahead(&point.velocity, self.limits.acceleration_m_s2);
        let turn = ahead(&rotation.angular_velocity, self.limits.turn_acceleration_rad_s2);
        Isometry3::from_parts(
            (point.position + way).into(),
            UnitQuaternion::from_scaled_axis(turn) * rotation.orientation,
        )
    }

    /// Moves one step towards the target.
    pub fn follow(&mut self, target: &Isometry3<f64>, dt_s: f64) {
        self.follow_led(target, None, dt_s);
    }

    /// Moves one step: along with the lead by its share, towards the target for the rest.
    ///
    /// v_wanted = λ (ẋ_l + ẍ_l / 2ω + ω/2 (x_l - x)) + (1 - λ) ω/2 (x_t - x): on the lead's way, and λ = 1, the
    /// acceleration is ẍ_l.
    pub fn follow_led(&mut self, target: &Isometry3<f64>, lead: Option<&Lead>, dt_s: f64) {
        self.move_on(dt_s);
        let RateLimits { speed_m_s, acceleration_m_s2, turn_rad_s, turn_acceleration_rad_s2 } = self.limits;
        let omega = self.omega;
        let PoseReference { point, rotation } = &mut self.reference;
        let error = target.translation.vector - point.position;
        let turn = (target.rotation * rotation.orientation.inverse()).scaled_axis();
        let mut wanted = closing(&error, omega, acceleration_m_s2);
        let mut wanted_turn = closing(&turn, omega, turn_acceleration_rad_s2);
        if let Some(Lead { motion, share }) = lead {
            let (on, by) = (&motion.point, &motion.rotation);
            let error = on.position - point.position;
            let turn = (by.orientation * rotation.orientation.inverse()).scaled_axis();
            let along = on.velocity + on.acceleration / (2.0 * omega);
            let turning = by.angular_velocity + by.angular_acceleration / (2.0 * omega);
            wanted = wanted.lerp(&(along + closing(&error, omega, acceleration_m_s2)), *share);
            wanted_turn =
                wanted_turn.lerp(&(turning + closing(&turn, omega, turn_acceleration_rad_s2)), *share);
        }
        point.acceleration = acceleration(&wanted, &point.velocity, omega, speed_m_s, acceleration_m_s2);
        rotation.angular_acceleration = acceleration(
            &wanted_turn,
            &rotation.angular_velocity,
            omega,
            turn_rad_s,
            turn_acceleration_rad_s2,
        );
    }

    /// By one step, at the acceleration of the last one.
    fn move_on(&mut self, dt_s: f64) {
        let PoseReference { point, rotation } = &mut self.reference;
        point.position += (point.velocity + point.acceleration * (dt_s / 2.0)) * dt_s;
        point.velocity += point.acceleration * dt_s;
        let turn = (rotation.angular_velocity + rotation.angular_acceleration * (dt_s / 2.0)) * dt_s;
        rotation.orientation = UnitQuaternion::from_scaled_axis(turn) * rotation.orientation;
        rotation.orientation.renormalize();
        rotation.angular_velocity += rotation.angular_acceleration * dt_s;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::trajectory::Segment;

    const DT_S: f64 = 0.0025;
    const LIMITS: RateLimits = RateLimits {
        speed_m_s: 0.5,
        acceleration_m_s2: 2.0,
        turn_rad_s: 1.5,
        turn_acceleration_rad_s2: 10.0,
    };

    fn sut() -> PoseFollower {
        PoseFollower::new(PoseReference::hold(&Isometry3::identity()), 30.0, LIMITS)
    }

    proptest! {
        #[test]
        fn any_jump_of_the_target_is_followed_within_limits_and_without_much_overshoot(
            to in prop::array::uniform3(-0.5..0.5f64), turn in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let mut sut = sut();
            let target = Isometry3::new(to.into(), turn.into());
            let distance = target.translation.vector.norm();
            let mut farthest: f64 = 0.0;
            for _ in 0..2000 {
                sut.follow(&target, DT_S);
                let PoseReference { point, rotation } = sut.reference();
                prop_assert!(point.velocity.norm() <= LIMITS.speed_m_s * 1.01);
                prop_assert!(point.acceleration.norm() <= LIMITS.acceleration_m_s2 * 1.0001);
                prop_assert!(rotation.angular_velocity.norm() <= LIMITS.turn_rad_s * 1.01);
                farthest = farthest.max(point.position.norm());
            }
            let error = sut.reference().pose().inverse() * target;
            prop_assert!(error.translation.vector.norm() < 1e-6);
            prop_assert!(error.rotation.angle() < 1e-6);
            prop_assert!(farthest < distance + 0.005, "{} of {}", farthest, distance);
        }

        #[test]
        fn stopping_does_not_turn_back(speed in 0.01..0.3f64) {
            let mut sut = sut();
            let mut x = 0.0;
            for _ in 0..200 {
                x += speed * DT_S;
                sut.follow(&Isometry3::translation(x, 0.0, 0.0), DT_S);
            }
            let stop = sut.stopping_pose();
            let mut last = sut.reference().point.position.x;
            for _ in 0..400 {
                sut.follow(&stop, DT_S);
                let now = sut.reference().point.position.x;
                prop_assert!(now >= last - 1e-5, "{} after {}", now, last);
                last = now;
            }
        }
    }

    proptest! {
        #[test]
        fn a_lead_within_the_limits_is_followed_exactly(
            to in prop::array::uniform3(-0.1..0.1f64), turn in prop::array::uniform3(-0.5..0.5f64),
        ) {
            let mut sut = sut();
            let segment = Segment::new(&Isometry3::identity(), &Isometry3::new(to.into(), turn.into()), 2.0);
            for tick in 0..1000 {
                let motion = segment.sample(f64::from(tick) * DT_S);
                // Whatever the target is: with all of the share it does not count.
                sut.follow_led(&Isometry3::identity(), Some(&Lead { motion, share: 1.0 }), DT_S);
                let PoseReference { point, rotation } = sut.reference();
                prop_assert!((point.position - motion.point.position).norm() < 1e-5);
                prop_assert!((point.velocity - motion.point.velocity).norm() < 1e-3);
                prop_assert!((point.acceleration - motion.point.acceleration).norm() < 1e-2);
                prop_assert!(rotation.orientation.angle_to(&motion.rotation.orientation) < 1e-5);
                let turning = rotation.angular_velocity - motion.rotation.angular_velocity;
                prop_assert!(turning.norm() < 5e-3);
            }
        }
    }

    #[test]
    fn slow_motion_is_delayed_by_two_over_omega() {
        let mut sut = sut();
        let mut worst: f64 = 0.0;
        for tick in 0..4000 {
            let position = |t: f64| 0.05 * (1.5 * t).sin();
            let t = f64::from(tick) * DT_S;
            sut.follow(&Isometry3::translation(position(t), 0.0, 0.0), DT_S);
            if t > 2.0 {
                worst = worst.max((sut.reference().point.position.x - position(t - 2.0 / 30.0)).abs());
            }
        }
        assert!(worst < 4e-4, "{worst}");
    }
}
