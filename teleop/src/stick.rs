//! Joystick, gamepad and keyboard: deflections become speeds, speeds add up to displacements.
//!
//! The result is the same [`Motion`] that the tracker's mapping gives, so the robot does not know who
//! drives. Rates and limits are those of `configs/teleop.toml`.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::config::Stick;
use crate::motion::{Body, Motion};

/// What a held dead-man lets move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Drive {
    /// The sticks or keys of the device itself.
    #[default]
    Sticks,
    /// The tracked operator: the device is only the dead-man.
    Tracker,
}

/// What the sticks of a device move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// The robot's torso.
    #[default]
    Torso,
    /// The foot or gripper of the mode that the robot is in; without one, the torso.
    Effector,
}

/// The state of a device in a person's hands.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Hand {
    /// The dead-man is held.
    pub held: bool,
    /// What it lets move.
    pub drive: Drive,
    /// What the sticks move.
    pub target: Target,
    /// x forward, y left, z up: -1 to 1.
    pub linear: [f64; 3],
    /// Roll, pitch, yaw: -1 to 1.
    pub angular: [f64; 3],
    /// Opens (1) or closes (-1) the gripper.
    pub opening: f64,
}

/// Displacements that sticks have added up since engagement.
#[derive(Debug, Clone)]
pub struct StickMotion {
    config: Stick,
    torso: Isometry3<f64>,
    effectors: [Isometry3<f64>; 2],
    openings: [f64; 2],
}

impl StickMotion {
    /// Starts an engagement at zero; the openings move from where the robot's grippers are.
    pub fn engage(config: &Stick, openings: [f64; 2]) -> Self {
        Self {
            config: *config,
            torso: Isometry3::identity(),
            effectors: [Isometry3::identity(); 2],
            openings: openings.map(|opening| if opening.is_finite() { opening.clamp(0.0, 1.0) } else { 0.0 }),
        }
    }

    /// Moves on by `dt_s`. `side` (0 right, 1 left) is the one that the robot manipulates with now, by foot or
    /// gripper; of a foot's motion the robot takes the translation. A robot that `walks` goes as the sticks for the torso's
    /// x, y and yaw say.
    pub fn advance(&mut self, hand: &Hand, side: Option<usize>, walks: bool, dt_s: f64) -> Motion {
        let linear = Vector3::from(hand.linear.map(|v| self.deflection(v)));
        let angular = Vector3::from(hand.angular.map(|v| self.deflection(v)));
        let c = &self.config;
        let mut walk = walks.then_some([0.0; 3]);
        match side.filter(|_| hand.target == Target::Effector) {
            Some(side) => {
                let pose =
                    moved(&self.effectors[side], linear * c.gripper_m_s, angular * c.gripper_rad_s, dt_s);
                self.effectors[side] = within(&pose, c.gripper_limit_m, c.gripper_limit_rad);
            }
            None if walks => {
                let (along, turn) = (linear.xy() * c.walk_m_s, angular.z * c.walk_rad_s);
                walk = Some([along.x, along.y, turn]);
                let rise = Vector3::new(0.0, 0.0, linear.z * c.torso_z_m_s);
                let tilt = Vector3::new(angular.x, angular.y, 0.0) * c.torso_rad_s;
                self.torso = torso_within(&moved(&self.torso, rise, tilt, dt_s), c);
            }
            None => {
                let speed = Vector3::new(c.torso_xy_m_s, c.torso_xy_m_s, c.torso_z_m_s);
                let pose = moved(&self.torso, linear.component_mul(&speed), angular * c.torso_rad_s, dt_s);
                self.torso = torso_within(&pose, c);
            }
        }
        let mut motion = Motion { bodies: [Some(self.torso), None, None], openings: [None; 2], walk };
        if let Some(side) = side {
            let step = self.deflection(hand.opening) * self.config.opening_per_s * dt_s;
            self.openings[side] = (self.openings[side] + step).clamp(0.0, 1.0);
            motion.openings[side] = Some(self.openings[side]);
            let body = [Body::RightPalm, Body::LeftPalm][side];
            motion.bodies[body as usize] = Some(self.effectors[side]);
        }
        motion
    }

    /// Zero inside the dead band, and for anything that is not a number; never beyond 1.
    fn deflection(&self, value: f64) -> f64 {
        if value.is_finite() && value.abs() >= self.config.deadband { value.clamp(-1.0, 1.0) } else { 0.0 }
    }
}

fn moved(pose: &Isometry3<f64>, velocity: Vector3<f64>, rate: Vector3<f64>, dt_s: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::from(pose.translation.vector + velocity * dt_s),
        UnitQuaternion::from_scaled_axis(rate * dt_s) * pose.rotation,
    )
}

/// Shortens translation and rotation to their limits, keeping their directions.
fn within(pose: &Isometry3<f64>, limit_m: f64, limit_rad: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::from(pose.translation.vector.cap_magnitude(limit_m)),
        UnitQuaternion::from_scaled_axis(pose.rotation.scaled_axis().cap_magnitude(limit_rad)),
    )
}

fn torso_within(pose: &Isometry3<f64>, config: &Stick) -> Isometry3<f64> {
    let (xy, z) = (config.torso_xy_limit_m, config.torso_z_limit_m);
    let (tilt, yaw) = (config.torso_tilt_limit_rad, config.torso_yaw_limit_rad);
    let t = pose.translation.vector;
    let (roll, pitch, turn) = pose.rotation.euler_angles();
    Isometry3::from_parts(
        Translation3::new(t.x.clamp(-xy, xy), t.y.clamp(-xy, xy), t.z.clamp(-z, z)),
        UnitQuaternion::from_euler_angles(
            roll.clamp(-tilt, tilt),
            pitch.clamp(-tilt, tilt),
            turn.clamp(-yaw, yaw),
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn forward(target: Target) -> Hand {
        Hand { held: true, target, linear: [1.0, 0.0, 0.0], ..Hand::default() }
    }

    #[test]
    fn full_stick_for_a_second_moves_by_the_configured_speed() {
        let config = Stick::default();
        let mut sut = StickMotion::engage(&config, [0.5; 2]);
        let mut motion = Motion::default();
        for _ in 0..100 {
            motion = sut.advance(&forward(Target::Effector), Some(0), false, 0.01);
        }
        assert!((motion.body(Body::RightPalm).unwrap().translation.x - config.gripper_m_s).abs() < 1e-9);
        assert_eq!(motion.body(Body::Torso), Some(&Isometry3::identity()));
        assert_eq!(motion.body(Body::LeftPalm), None);
        assert_eq!(motion.openings, [Some(0.5), None]);
    }

    #[test]
    fn on_four_feet_the_sticks_move_the_torso() {
        let mut sut = StickMotion::engage(&Stick::default(), [0.0; 2]);
        let motion = sut.advance(&forward(Target::Effector), None, false, 0.1);
        assert!(motion.body(Body::Torso).unwrap().translation.x > 0.0);
        assert_eq!(motion.body(Body::RightPalm), None);
    }

    #[test]
    fn a_robot_that_walks_goes_as_the_sticks_say_and_stops_when_they_are_let_go() {
        let config = Stick::default();
        let mut sut = StickMotion::engage(&config, [0.0; 2]);
        let turning = Hand { angular: [0.0, 0.0, -1.0], ..forward(Target::Torso) };
        let motion = sut.advance(&turning, None, true, 0.1);
        assert_eq!(motion.walk, Some([config.walk_m_s, 0.0, -config.walk_rad_s]));
        assert_eq!(motion.body(Body::Torso), Some(&Isometry3::identity()));
        let rest = Hand { held: true, ..Hand::default() };
        assert_eq!(sut.advance(&rest, None, true, 0.1).walk, Some([0.0; 3]));
        // The sticks turn a gripper: the robot stays where it is.
        let motion = sut.advance(&forward(Target::Effector), Some(0), true, 0.1);
        assert_eq!(motion.walk, Some([0.0; 3]));
    }

    proptest! {
        #[test]
        fn whatever_a_device_reports_the_displacement_is_finite_and_within_its_limits(
            linear in prop::array::uniform3(any::<f64>()), angular in prop::array::uniform3(any::<f64>()),
            opening in any::<f64>(), steps in 1..400usize, side in prop::option::of(0..2usize), walks: bool,
        ) {
            let config = Stick::default();
            let hand = Hand { held: true, target: Target::Effector, linear, angular, opening, ..Hand::default() };
            let mut sut = StickMotion::engage(&config, [f64::NAN, 2.0]);
            for _ in 0..steps {
                let motion = sut.advance(&hand, side, walks, 0.1);
                let torso = motion.body(Body::Torso).unwrap().translation.vector;
                prop_assert!(torso.xy().amax() <= config.torso_xy_limit_m && torso.z.abs() <= config.torso_z_limit_m);
                for pose in motion.bodies.iter().flatten() {
                    prop_assert!(pose.translation.vector.norm() <= config.gripper_limit_m + 1e-9);
                    prop_assert!(pose.rotation.angle().is_finite());
                }
                let fastest = config.walk_m_s.max(config.walk_rad_s);
                prop_assert!(motion.walk.is_some() == walks);
                prop_assert!(motion.walk.iter().flatten().all(|speed| speed.abs() <= fastest));
                prop_assert!(motion.openings.iter().flatten().all(|o| (0.0..=1.0).contains(o)));
            }
        }

        #[test]
        fn a_stick_at_rest_moves_nothing(v in prop::array::uniform3(-0.0999..0.0999f64)) {
            let mut sut = StickMotion::engage(&Stick::default(), [0.0; 2]);
            let motion = sut.advance(&Hand { held: true, linear: v, angular: v, ..Hand::default() }, Some(1), false, 1.0);
            prop_assert_eq!(motion.body(Body::Torso), Some(&Isometry3::identity()));
            prop_assert_eq!(motion.body(Body::LeftPalm), Some(&Isometry3::identity()));
        }
    }
}
