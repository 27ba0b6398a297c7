//! How far and how fast an operator may move the robot: `configs/robot/limits.toml`.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::command::Command;
use crate::{joints::Side, locomotion::Velocity};

/// A symmetric or lopsided range.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Lower end.
    pub min: f64,
    /// Upper end.
    pub max: f64,
}

impl Range {
    const fn around_zero(half: f64) -> Self {
        Self { min: -half, max: half }
    }

    /// Whether a value is inside.
    pub fn contains(&self, value: f64) -> bool {
        (self.min..=self.max).contains(&value)
    }

    /// The nearest value inside.
    pub fn clamp(&self, value: f64) -> f64 {
        value.max(self.min).min(self.max)
    }
}

/// Greatest speeds and accelerations of a body's target.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RateLimits {
    /// m/s.
    pub speed_m_s: f64,
    /// m/s².
    pub acceleration_m_s2: f64,
    /// rad/s.
    pub turn_rad_s: f64,
    /// rad/s².
    pub turn_acceleration_rad_s2: f64,
}

/// Range of the torso's target about its pose at the world's reset.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorsoRange {
    /// m.
    pub x: Range,
    /// m.
    pub y: Range,
    /// m.
    pub z: Range,
    /// rad.
    pub roll: Range,
    /// rad.
    pub pitch: Range,
    /// rad.
    pub yaw: Range,
}

impl TorsoRange {
    /// The nearest pose inside the range, taken coordinate by coordinate.
    pub fn clamp(&self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let p = pose.translation.vector;
        let p = Vector3::new(self.x.clamp(p.x), self.y.clamp(p.y), self.z.clamp(p.z));
        let (roll, pitch, yaw) = pose.rotation.euler_angles();
        let clamped = UnitQuaternion::from_euler_angles(
            self.roll.clamp(roll),
            self.pitch.clamp(pitch),
            self.yaw.clamp(yaw),
        );
        Isometry3::from_parts(p.into(), clamped)
    }
}

/// Range of a foot's or gripper's target about where it was when its mode began; orientation is free.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimbRange {
    /// m.
    pub x: Range,
    /// m, positive outwards: mirrored for the right side.
    pub outward: Range,
    /// m.
    pub z: Range,
}

impl LimbRange {
    /// The nearest position inside the box about `start`.
    pub fn clamp(&self, position: &Vector3<f64>, start: &Vector3<f64>, side: Side) -> Vector3<f64> {
        let outward = if side == Side::Left { 1.0 } else { -1.0 };
        let d = position - start;
        let y = outward * self.outward.clamp(outward * d.y);
        start + Vector3::new(self.x.clamp(d.x), y, self.z.clamp(d.z))
    }
}

/// What the operator may ask of a robot that walks.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WalkingLimits {
    /// The torso about its course: z is its height above the ground.
    pub torso: TorsoRange,
    /// Displacements of the torso along the ground that mean nothing, m.
    pub dead_zone_m: f64,
    /// The same for turning, rad.
    pub dead_zone_rad: f64,
    /// Speed for each metre beyond, 1/s.
    pub speed_per_m: f64,
    /// Turn rate for each radian beyond, 1/s.
    pub turn_per_rad: f64,
}

impl WalkingLimits {
    /// How a command asks to walk: by a velocity, or by how far the torso leaves its place, as a stick does.
    pub fn velocity(&self, command: &Command) -> Velocity {
        if let Some(walk) = command.walk {
            return walk;
        }
        let Some(torso) = &command.torso else { return Velocity::default() };
        let moved = torso.translation.vector.xy();
        let beyond = (moved.norm() - self.dead_zone_m).max(0.0);
        let (_, _, yaw) = torso.rotation.euler_angles();
        let turned = yaw - yaw.clamp(-self.dead_zone_rad, self.dead_zone_rad);
        Velocity {
            linear: moved.try_normalize(1e-9).unwrap_or_default() * (self.speed_per_m * beyond),
            turn: self.turn_per_rad * turned,
        }
    }
}

/// Joint angles within which leg and arm reach for a target.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReachRange {
    /// rad.
    pub hip: Range,
    /// rad.
    pub thigh: Range,
    /// rad.
    pub calf: Range,
    /// The arm's first joint, rad; the others have the model's range.
    pub arm_1: Range,
    /// Least distance of links, m.
    pub clearance_m: f64,
    /// Least height above the ground of a limb in the air and of the mounts of the arms, m.
    pub ground_m: f64,
}

impl ReachRange {
    /// Of hip, thigh and calf.
    pub const fn leg(&self) -> [Range; 3] {
        [self.hip, self.thigh, self.calf]
    }
}

/// Everything in `limits.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Torso on four feet.
    pub stance_torso: TorsoRange,
    /// Torso on three feet.
    pub gripper_torso: TorsoRange,
    /// A robot that walks.
    pub walking: WalkingLimits,
    /// Gripper.
    pub gripper: LimbRange,
    /// Grippers of a robot that sits upright.
    pub bimanual: LimbRange,
    /// Foot in the air.
    pub foot: LimbRange,
    /// Joints behind a gripper or a foot in the air.
    pub reach: ReachRange,
    /// Joints behind the grippers of a robot that sits upright.
    pub upright_reach: ReachRange,
    /// How fast the torso's target moves on four feet.
    pub stance_torso_rate: RateLimits,
    /// How fast the torso's target moves on three feet.
    pub gripper_torso_rate: RateLimits,
    /// How fast the target of a gripper or of a foot in the air moves.
    pub gripper_rate: RateLimits,
    /// How fast the jaws' target moves, full strokes per second.
    pub opening_per_s: f64,
    /// The centre of mass stays this far inside the feet's polygon, m.
    pub support_margin_m: f64,
    /// Natural frequency of the critically damped follower of the operator's motion, rad/s.
    pub follower_rad_s: f64,
}

impl Default for Limits {
    fn default() -> Self {
        let gripper_torso = TorsoRange {
            x: Range::around_zero(0.06),
            y: Range::around_zero(0.06),
            z: Range { min: -0.08, max: 0.04 },
            roll: Range::around_zero(0.3),
            pitch: Range::around_zero(0.3),
            yaw: Range::around_zero(0.4),
        };
        let reach = ReachRange {
            hip: Range::around_zero(0.83),
            thigh: Range { min: -0.4, max: 2.2 },
            calf: Range { min: -2.78, max: -0.95 },
            arm_1: Range { min: -2.2, max: 1.7 },
            clearance_m: 0.015,
            ground_m: 0.015,
        };
        Self {
            stance_torso: TorsoRange { z: Range { min: -0.12, max: 0.07 }, ..gripper_torso },
            gripper_torso,
            walking: WalkingLimits {
                torso: TorsoRange {
                    x: Range::around_zero(0.0),
                    y: Range::around_zero(0.0),
                    z: Range { min: 0.15, max: 0.35 },
                    yaw: Range::around_zero(0.0),
                    ..gripper_torso
                },
                dead_zone_m: 0.04,
                dead_zone_rad: 0.15,
                speed_per_m: 3.0,
                turn_per_rad: 2.0,
            },
            gripper: LimbRange {
                x: Range { min: -0.2, max: 0.22 },
                outward: Range { min: -0.15, max: 0.22 },
                z: Range { min: -0.15, max: 0.3 },
            },
            bimanual: LimbRange {
                x: Range { min: -0.35, max: 0.25 },
                outward: Range { min: -0.2, max: 0.3 },
                z: Range { min: -0.35, max: 0.65 },
            },
            foot: LimbRange {
                x: Range { min: -0.15, max: 0.15 },
                outward: Range { min: -0.1, max: 0.15 },
                z: Range { min: -0.08, max: 0.2 },
            },
            reach,
            upright_reach: ReachRange {
                thigh: Range { min: -0.65, max: 2.4 },
                calf: Range { min: -2.78, max: -0.92 },
                ..reach
            },
            stance_torso_rate: RateLimits {
                speed_m_s: 0.3,
                acceleration_m_s2: 1.5,
                turn_rad_s: 1.0,
                turn_acceleration_rad_s2: 5.0,
            },
            gripper_torso_rate: RateLimits {
                speed_m_s: 0.15,
                acceleration_m_s2: 0.5,
                turn_rad_s: 0.6,
                turn_acceleration_rad_s2: 2.0,
            },
            gripper_rate: RateLimits {
                speed_m_s: 0.5,
                acceleration_m_s2: 2.0,
                turn_rad_s: 1.5,
                turn_acceleration_rad_s2: 10.0,
            },
            opening_per_s: 4.0,
            support_margin_m: 0.02,
            follower_rad_s: 40.0,
        }
    }
}
