//! Numbers of walking; `configs/robot/locomotion.toml` says what they mean and where they come from.

use nalgebra::Vector2;
use serde::Deserialize;

/// Everything in `locomotion.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LocomotionSettings {
    /// The gait.
    pub gait: GaitSettings,
    /// When feet land and are loaded.
    pub contact: ContactEvents,
    /// Where feet land.
    pub placement: PlacementSettings,
    /// How feet swing.
    pub swing: SwingSettings,
    /// How the torso goes along.
    pub course: CourseSettings,
    /// What is different while arms hold something.
    pub holding: HoldingSettings,
    /// What is learned of the torso's lean.
    pub trim: TrimSettings,
    /// Legs, N m/rad and N m s/rad.
    pub gains: WalkingGains,
}

impl LocomotionSettings {
    /// The same while arms hold something.
    #[must_use]
    pub fn for_holding(&self) -> Self {
        let HoldingSettings { frequency_hz, height_m } = self.holding;
        Self {
            gait: GaitSettings { frequency_hz, ..self.gait },
            swing: SwingSettings { height_m, ..self.swing },
            ..*self
        }
    }
}

/// What is different while arms hold something: the less a leg moves, the less its arm has to make up for.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HoldingSettings {
    /// Cycles a second.
    pub frequency_hz: f64,
    /// Clearance in the middle of the swing, m.
    pub height_m: f64,
}

/// A cyclic gait.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaitSettings {
    /// Cycles a second.
    pub frequency_hz: f64,
    /// Share of the cycle that a foot stands.
    pub duty: f64,
    /// By how much of a cycle each leg is ahead: FR, FL, RR, RL.
    pub offset: [f64; 4],
    /// Cycles a second that a robot which was thrown off its course makes more for each m/s of it.
    pub hurry_hz_s_m: f64,
    /// Most cycles a second.
    pub fastest_hz: f64,
}

/// When feet land and are loaded.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactEvents {
    /// Force that tells that a foot has landed, N.
    pub touch_n: f64,
    /// Share of the swing after which it may.
    pub earliest_touch: f64,
    /// Time in which a foot is loaded, and unloaded, s.
    pub load_s: f64,
    /// Least share of the load of a foot that stands.
    pub least_share: f64,
}

/// Where feet land.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlacementSettings {
    /// From the middle of the robot to a foot, forward and outward, m.
    pub stance_m: Vector2<f64>,
    /// By how far a foot lands ahead for each m/s that the torso is faster than it should be, s.
    pub velocity_gain_s: f64,
    /// Greatest distance from the foot's place, forward and sideways, m.
    pub reach_m: Vector2<f64>,
    /// Least distance aside of the neighbour's foot, m.
    pub apart_m: f64,
}

/// How feet swing.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SwingSettings {
    /// Clearance in the middle of the swing, m.
    pub height_m: f64,
    /// Under a torso at this height; lower ones have less, m.
    pub torso_m: f64,
    /// Speed at which a foot meets the ground, m/s.
    pub landing_m_s: f64,
    /// A foot that misses the ground searches so deep, m.
    pub search_m: f64,
}

impl SwingSettings {
    /// The same under a torso at another height: legs that are folded already cannot lift as high.
    #[must_use]
    pub fn under(&self, torso_m: f64) -> Self {
        let share = (torso_m / self.torso_m).clamp(LEAST_SWING, 1.0);
        Self { height_m: self.height_m * share, ..*self }
    }
}

/// Least share of the clearance that a swing has.
const LEAST_SWING: f64 = 0.3;

/// How the torso goes along.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CourseSettings {
    /// Greatest speed forward and sideways, m/s, and turning, rad/s.
    pub speed_m_s: Vector2<f64>,
    /// rad/s.
    pub turn_rad_s: f64,
    /// How fast it changes, m/s².
    pub acceleration_m_s2: f64,
    /// rad/s².
    pub turn_acceleration_rad_s2: f64,
    /// The course is never further ahead of the torso than this, m.
    pub leash_m: f64,
    /// The same for the heading, rad.
    pub leash_rad: f64,
    /// Time constant with which the ground under the feet is followed, s.
    pub ground_s: f64,
    /// The robot steps without being asked when its point of balance is so far from the middle of its feet, m.
    pub balance_m: f64,
}

/// What is learned of the torso's lean.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrimSettings {
    /// How fast, 1/s.
    pub rate: f64,
    /// Greatest offset of the height, m.
    pub most_m: f64,
    /// Greatest offset of the tilt, rad.
    pub most_rad: f64,
}

/// Joint gains of walking legs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WalkingGains {
    /// N m/rad.
    pub kp: f64,
    /// N m s/rad.
    pub kd: f64,
}

impl Default for LocomotionSettings {
    fn default() -> Self {
        Self {
            gait: GaitSettings {
                frequency_hz: 2.0,
                duty: 0.55,
                offset: [0.0, 0.5, 0.5, 0.0],
                hurry_hz_s_m: 3.0,
                fastest_hz: 3.0,
            },
            contact: ContactEvents { touch_n: 10.0, earliest_touch: 0.6, load_s: 0.02, least_share: 0.05 },
            placement: PlacementSettings {
                stance_m: Vector2::new(0.188, 0.18),
                velocity_gain_s: 0.2,
                reach_m: Vector2::new(0.35, 0.35),
                apart_m: 0.1,
            },
            swing: SwingSettings { height_m: 0.06, torso_m: 0.285, landing_m_s: 0.1, search_m: 0.06 },
            course: CourseSettings {
                speed_m_s: Vector2::new(0.8, 0.4),
                turn_rad_s: 1.2,
                acceleration_m_s2: 1.0,
                turn_acceleration_rad_s2: 3.0,
                leash_m: 0.05,
                leash_rad: 0.15,
                ground_s: 0.1,
                balance_m: 0.05,
            },
            holding: HoldingSettings { frequency_hz: 2.7, height_m: 0.02 },
            trim: TrimSettings { rate: 2.0, most_m: 0.03, most_rad: 0.15 },
            gains: WalkingGains { kp: 60.0, kd: 2.0 },
        }
    }
}
