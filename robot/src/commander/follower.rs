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

/// One vector that follows another.
fn step(error: &Vector3<f64>, velocity: &Vector3<f64>, omega: f64, speed: f64, limit: f64) -> Vector3<f64> {
    let distance = error.norm();
    let wanted_speed =
        (omega / 2.0 * distance).min(speed).min((2.0 * BRAKING_SHARE * limit * distance).sqrt());
    let wanted = if distance > 1e-12 { error * (wanted_speed / distance) } else { Vector3::zeros() };
    let acceleration = 2.0 * omega * (wanted - velocity);
    acceleration.cap_magnitude(limit)
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
        let RateLimits { speed_m_s, acceleration_m_s2, turn_rad_s, turn_acceleration_rad_s2 } = self.limits;
        let PoseReference { point, rotation } = &mut self.reference;
        let error = target.translation.vector - point.position;
        point.acceleration = step(&error, &point.velocity, self.omega, speed_m_s, acceleration_m_s2);
        point.velocity += point.acceleration * dt_s;
        point.position += point.velocity * dt_s;

        let error = (target.rotation * rotation.orientation.inverse()).scaled_axis();
        rotation.angular_acceleration =
            step(&error, &rotation.angular_velocity, self.omega, turn_rad_s, turn_acceleration_rad_s2);
        rotation.angular_velocity += rotation.angular_acceleration * dt_s;
        rotation.orientation =
            UnitQuaternion::from_scaled_axis(rotation.angular_velocity * dt_s) * rotation.orientation;
        rotation.orientation.renormalize();
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

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
