//! Where a foot should land.
//!
//! ```text
//! p = hip when it lands + ½ T_stance v̄ + k (v - v̄)
//! ```
//! (Raibert, "Legged robots that balance", 1986.) v is the velocity of the hip, v̄ what it should be. The middle term is
//! where a steady pace needs the foot; the last one brings a robot that was thrown off it back: with k = √(h / g), in one
//! step. The hip is the foot's place about the robot's centre of mass, not about its torso: with two feet on the ground the
//! robot tips about the line between them, and should as much one way as the other.

use nalgebra::{Rotation2, Vector2};

use super::settings::PlacementSettings;
use crate::joints::Leg;

/// How the robot moves, seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Of the middle of the robot, m.
    pub position: Vector2<f64>,
    /// Where it faces, rad.
    pub heading: f64,
    /// m/s.
    pub velocity: Vector2<f64>,
    /// What that should be, m/s.
    pub wanted: Vector2<f64>,
    /// rad/s.
    pub turn: f64,
}

/// Where a foot should land in `after_s`, to stand for `stance_s`; on its own side of the `neighbour` across.
pub fn landing(
    leg: Leg,
    motion: &Motion,
    [after_s, stance_s]: [f64; 2],
    neighbour: &Vector2<f64>,
    settings: &PlacementSettings,
) -> Vector2<f64> {
    let heading = Rotation2::new(motion.heading);
    let place = Rotation2::new(motion.heading + motion.turn * after_s) * place_of(leg, settings);
    let swept = motion.turn * Vector2::new(-place.y, place.x);
    let astray = motion.velocity - motion.wanted;
    let ahead =
        heading.inverse() * (0.5 * stance_s * (motion.wanted + swept) + settings.velocity_gain_s * astray);
    let reach = settings.reach_m;
    let ahead = Vector2::new(ahead.x.clamp(-reach.x, reach.x), ahead.y.clamp(-reach.y, reach.y));
    let middle = motion.position + motion.velocity * after_s;
    let mut spot = heading.inverse() * (place - *neighbour + middle) + ahead;
    let outward = place_of(leg, settings).y.signum();
    spot.y = outward * (outward * spot.y).max(settings.apart_m);
    neighbour + heading * spot
}

/// Where a foot stands about the middle of the robot.
fn place_of(leg: Leg, settings: &PlacementSettings) -> Vector2<f64> {
    let stance = settings.stance_m;
    match leg {
        Leg::FrontRight => Vector2::new(stance.x, -stance.y),
        Leg::FrontLeft => stance,
        Leg::RearRight => -stance,
        Leg::RearLeft => Vector2::new(-stance.x, stance.y),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::locomotion::LocomotionSettings;

    fn motion(velocity: Vector2<f64>, wanted: Vector2<f64>, heading: f64) -> Motion {
        Motion { position: Vector2::new(0.3, -0.2), heading, velocity, wanted, turn: 0.0 }
    }

    proptest! {
        #[test]
        fn at_a_steady_pace_the_body_passes_over_the_foot_in_the_middle_of_its_stance(
            x in -0.6..0.6f64, y in -0.05..0.05f64, heading in -3.0..3.0f64,
        ) {
            let settings = LocomotionSettings::default().placement;
            let velocity = Rotation2::new(heading) * Vector2::new(x, y);
            let motion = motion(velocity, velocity, heading);
            for leg in Leg::ALL {
                let far = motion.position + Rotation2::new(heading) * place_of(leg.across(), &settings);
                let spot = landing(leg, &motion, [0.1, 0.275], &far, &settings);
                let over = motion.position + velocity * (0.1 + 0.275 / 2.0);
                let place = Rotation2::new(-heading) * (spot - over);
                prop_assert!((place - place_of(leg, &settings)).norm() < 1e-9);
            }
        }

        #[test]
        fn feet_stay_on_their_sides_whatever_throws_the_robot(
            x in -4.0..4.0f64, y in -4.0..4.0f64, heading in -3.0..3.0f64,
        ) {
            let settings = LocomotionSettings::default().placement;
            let motion = motion(Vector2::new(x, y), Vector2::zeros(), heading);
            for leg in Leg::ALL {
                let far = motion.position + Rotation2::new(heading) * place_of(leg.across(), &settings);
                let spot = landing(leg, &motion, [0.1, 0.2], &far, &settings);
                let apart = Rotation2::new(-heading) * (spot - far);
                let outward = place_of(leg, &settings).y.signum();
                prop_assert!(outward * apart.y >= settings.apart_m - 1e-9);
            }
        }
    }
}
