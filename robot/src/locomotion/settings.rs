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
}

impl LocomotionSettings {
    /// The first key whose number makes no sense, and what it must be.
    pub fn flaw(&self) -> Option<(&'static str, &'static str)> {
        let Self { gait, contact, placement, swing, course, holding, trim } = self;
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let not_negative = |value: f64| value >= 0.0 && value.is_finite();
        let share = |value: f64| value > 0.0 && value < 1.0;
        let both = |vector: &Vector2<f64>| vector.iter().all(|value| positive(*value));
        let checks = [
            ("gait.frequency_hz", positive(gait.frequency_hz), "above 0 Hz"),
            ("gait.duty", share(gait.duty), "above 0, below 1"),
            ("gait.offset", gait.offset.iter().all(|offset| (0.0..1.0).contains(offset)), "0 to below 1"),
            ("gait.hurry_hz_s_m", not_negative(gait.hurry_hz_s_m), "at least 0"),
            ("gait.fastest_hz", gait.fastest_hz >= gait.frequency_hz, "at least gait.frequency_hz"),
            ("contact.touch_n", positive(contact.touch_n), "above 0 N"),
            ("contact.earliest_touch", share(contact.earliest_touch), "above 0, below 1"),
            ("contact.load_s", positive(contact.load_s), "above 0 s"),
            ("contact.least_share", share(contact.least_share), "above 0, below 1"),
            ("placement.stance_m", both(&placement.stance_m), "two numbers above 0 m"),
            ("placement.velocity_gain_s", not_negative(placement.velocity_gain_s), "at least 0 s"),
            ("placement.reach_m", both(&placement.reach_m), "two numbers above 0 m"),
            ("placement.apart_m", not_negative(placement.apart_m), "at least 0 m"),
            ("swing.height_m", positive(swing.height_m), "above 0 m"),
            ("swing.torso_m", positive(swing.torso_m), "above 0 m"),
            ("swing.landing_m_s", positive(swing.landing_m_s), "above 0 m/s"),
            ("swing.search_m", not_negative(swing.search_m), "at least 0 m"),
            ("course.speed_m_s", both(&course.speed_m_s), "two numbers above 0 m/s"),
            ("course.turn_rad_s", positive(course.turn_rad_s), "above 0 rad/s"),
            ("course.acceleration_m_s2", positive(course.acceleration_m_s2), "above 0 m/s2"),
            ("course.turn_acceleration_rad_s2", positive(course.turn_acceleration_rad_s2), "above 0 rad/s2"),
            ("course.leash_m", positive(course.leash_m), "above 0 m"),
            ("course.leash_rad", positive(course.leash_rad), "above 0 rad"),
            ("course.ground_s", positive(course.ground_s), "above 0 s"),
            ("course.balance_m", positive(course.balance_m), "above 0 m"),
            ("holding.frequency_hz", positive(holding.frequency_hz), "above 0 Hz"),
            ("holding.height_m", positive(holding.height_m), "above 0 m"),
            ("trim.rate", not_negative(trim.rate), "at least 0 1/s"),
            ("trim.most_m", not_negative(trim.most_m), "at least 0 m"),
            ("trim.most_rad", not_negative(trim.most_rad), "at least 0 rad"),
        ];
        checks.into_iter().find(|(_, sound, _)| !sound).map(|(key, _, expected)| (key, expected))
    }

    /// The same, with feet that stand elsewhere about the middle of the robot: forward and aside, m.
    #[must_use]
    pub fn standing_at(&self, stance_m: Vector2<f64>) -> Self {
        Self { placement: PlacementSettings { stance_m, ..self.placement }, ..*self }
    }

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
        }
    }
}
