//! `configs/robot/servos.toml`, which says what each number means and where it comes from.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use serde::Deserialize;

use super::{
    ServoError,
    place::{Place, SERVOS},
    registers::{COUNTS_PER_TURN, FULL_PWM, P_UNIT, WATCHDOG_MAX_STEPS, WATCHDOG_STEP_MS, baud_code},
    wire::MAX_ID,
};
use crate::joints::Side;

/// The port that is looked for by itself.
pub const AUTO_PORT: &str = "auto";

/// Everything in `servos.toml`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoSettings {
    /// Path of the serial port, or [`AUTO_PORT`].
    pub port: String,
    /// Bits a second.
    pub baud: u32,
    /// Cycles a second.
    pub rate_hz: f64,
    /// Longest wait for an answer beyond its time on the line, ms.
    pub reply_slack_ms: f64,
    /// How a cycle reads.
    pub read: ReadKind,
    /// In every so many cycles one servo's health is asked for.
    pub health_every: u32,
    /// A servo that hears nothing for so long stops, ms.
    pub watchdog_ms: u32,
    /// So many answers lost in a row make a servo missing.
    pub missing_after: u32,
    /// Goals move no faster, rad/s.
    pub max_speed_rad_s: f64,
    /// Those of a servo that has just been taken hold of, rad/s.
    pub catch_up_rad_s: f64,
    /// When a servo is told of.
    pub watch: Watch,
    /// What a motor can do.
    pub motor: Motor,
    /// Gains and limits of the position loop.
    pub gains: Gains,
    /// The jaws.
    pub gripper: Gripper,
    /// The right limb.
    pub right: Limb,
    /// The left limb.
    pub left: Limb,
}

/// How a cycle reads all servos.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ReadKind {
    /// In one answer if all servos know it.
    Auto,
    /// In one answer.
    Fast,
    /// In one answer each.
    Classic,
}

/// When the driver tells of a servo.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Watch {
    /// °C.
    pub warm_c: f64,
    /// V.
    pub min_voltage_v: f64,
    /// V.
    pub max_voltage_v: f64,
}

/// A servo's motor behind its gear.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Torque at standstill with the whole supply, N m.
    pub stall_torque_n_m: f64,
    /// The current then, A.
    pub stall_current_a: f64,
    /// Speed without load, rad/s.
    pub no_load_speed_rad_s: f64,
}

/// Gains and limits, for each of a limb's four servos.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// Register "position P gain".
    pub p: [u16; 4],
    /// Register "position D gain".
    pub d: [u16; 4],
    /// The most current, A.
    pub current_a: [f64; 4],
    /// The servo's own limit of speed, rad/s; 0 for none.
    pub profile_speed_rad_s: f64,
    /// Its own limit of acceleration, rad/s²; 0 for none.
    pub profile_acceleration_rad_s2: f64,
}

/// The jaws.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gripper {
    /// Angle at opening 0, rad.
    pub closed_rad: f64,
    /// Angle at opening 1, rad.
    pub open_rad: f64,
    /// How far the goal may be ahead of the jaws, rad.
    pub lead_rad: f64,
}

/// A limb's four servos: joints 1, 2, 3, gripper.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limb {
    /// Their ids.
    pub ids: [u8; 4],
    /// 1 if the servo's positive turn is the joint's, -1 if not.
    pub sign: [i8; 4],
    /// The joint's least angle, rad.
    pub min_rad: [f64; 4],
    /// The joint's greatest angle, rad.
    pub max_rad: [f64; 4],
}

impl Default for ServoSettings {
    fn default() -> Self {
        let right = Limb {
            ids: [1, 2, 3, 4],
            sign: [-1, 1, -1, 1],
            min_rad: [-3.19, -2.4, -3.15, -0.08],
            max_rad: [1.74, 0.6, 3.15, 0.8],
        };
        let left = Limb {
            ids: [5, 6, 7, 8],
            sign: [1, 1, -1, 1],
            min_rad: [-3.19, -0.6, -3.15, -0.08],
            max_rad: [1.74, 2.4, 3.15, 0.8],
        };
        Self {
            port: AUTO_PORT.to_owned(),
            baud: 1_000_000,
            rate_hz: 200.0,
            reply_slack_ms: 3.0,
            read: ReadKind::Auto,
            health_every: 2,
            watchdog_ms: 100,
            missing_after: 10,
            max_speed_rad_s: 6.8,
            catch_up_rad_s: 1.0,
            watch: Watch { warm_c: 60.0, min_voltage_v: 9.5, max_voltage_v: 12.6 },
            motor: Motor { stall_torque_n_m: 0.92, stall_current_a: 0.80, no_load_speed_rad_s: 6.8 },
            gains: Gains {
                p: [1024, 768, 768, 768],
                d: [1040, 640, 640, 1600],
                current_a: [0.9, 0.9, 0.9, 0.4],
                profile_speed_rad_s: 7.5,
                profile_acceleration_rad_s2: 0.0,
            },
            gripper: Gripper { closed_rad: 0.02, open_rad: 0.7, lead_rad: 0.2 },
            right,
            left,
        }
    }
}

impl ServoSettings {
    /// Reads and checks `robot/servos.toml` of a configuration folder.
    pub fn load(configs: &Path) -> Result<Self, ServoError> {
        let file = configs.join("robot/servos.toml");
        let text = std::fs::read_to_string(&file)
            .map_err(|source| ServoError::Read { file: file.clone(), source })?;
        let settings: Self = toml::from_str(&text)
            .map_err(|source| ServoError::Parse { file: file.clone(), source: Box::new(source) })?;
        match settings.flaw() {
            None => Ok(settings),
            Some((key, expected)) => Err(ServoError::Value { file, key, expected }),
        }
    }

    /// The limb of a side.
    pub fn limb(&self, side: Side) -> &Limb {
        match side {
            Side::Right => &self.right,
            Side::Left => &self.left,
        }
    }

    /// A servo's id.
    pub fn id(&self, place: Place) -> u8 {
        self.limb(place.side).ids[place.in_limb()]
    }

    /// All ids, in the order of places.
    pub fn ids(&self) -> [u8; SERVOS] {
        Place::ALL.map(|place| self.id(place))
    }

    /// Least and greatest angle of a joint, rad.
    pub fn range_rad(&self, place: Place) -> [f64; 2] {
        let limb = self.limb(place.side);
        [limb.min_rad[place.in_limb()], limb.max_rad[place.in_limb()]]
    }

    /// The most current of a servo, A.
    pub fn current_a(&self, place: Place) -> f64 {
        self.gains.current_a[place.in_limb()]
    }

    /// Stiffness of a servo's position loop, N m/rad: `P / 128` steps of PWM a count, 885 steps for the stall torque.
    pub fn stiffness_n_m_rad(&self, place: Place) -> f64 {
        let pwm_per_count = f64::from(self.gains.p[place.in_limb()]) / P_UNIT;
        pwm_per_count * f64::from(COUNTS_PER_TURN) / std::f64::consts::TAU * self.motor.stall_torque_n_m
            / FULL_PWM
    }

    /// What the motor's own voltage costs in torque, N m s/rad.
    pub fn back_emf_n_m_s(&self) -> f64 {
        self.motor.stall_torque_n_m / self.motor.no_load_speed_rad_s
    }

    /// N m for an ampere.
    pub fn torque_constant(&self) -> f64 {
        self.motor.stall_torque_n_m / self.motor.stall_current_a
    }

    /// Duration of a cycle.
    pub fn period(&self) -> Duration {
        Duration::from_secs_f64(1.0 / self.rate_hz)
    }

    /// Longest wait for an answer beyond its time on the line.
    pub fn reply_slack(&self) -> Duration {
        Duration::from_secs_f64(self.reply_slack_ms / 1000.0)
    }

    /// The first setting that makes no sense, and what it must be.
    fn flaw(&self) -> Option<(&'static str, &'static str)> {
        let within = |value: f64, min: f64, max: f64| (min..=max).contains(&value);
        let watchdog = WATCHDOG_STEP_MS..=WATCHDOG_STEP_MS * WATCHDOG_MAX_STEPS;
        let mut ids = self.ids().to_vec();
        ids.sort_unstable();
        ids.dedup();
        let limbs = [&self.right, &self.left];
        let ordered = |limb: &&Limb| {
            limb.min_rad.iter().zip(&limb.max_rad).all(|(min, max)| min < max && max - min < 7.0)
        };
        let checks = [
            (
                baud_code(self.baud).is_some_and(|code| code > 0),
                "baud",
                "57600, 115200, 1000000, 2000000, 3000000 or 4000000",
            ),
            (within(self.rate_hz, 50.0, 400.0), "rate_hz", "between 50 and 400"),
            (within(self.reply_slack_ms, 1.0, 100.0), "reply_slack_ms", "between 1 and 100"),
            ((1..=100).contains(&self.health_every), "health_every", "between 1 and 100"),
            (
                watchdog.contains(&self.watchdog_ms) && self.watchdog_ms.is_multiple_of(WATCHDOG_STEP_MS),
                "watchdog_ms",
                "between 20 and 2540 in steps of 20",
            ),
            ((2..=1000).contains(&self.missing_after), "missing_after", "between 2 and 1000"),
            (within(self.max_speed_rad_s, 0.1, 7.0), "max_speed_rad_s", "between 0.1 and 7"),
            (within(self.catch_up_rad_s, 0.05, 7.0), "catch_up_rad_s", "between 0.05 and 7"),
            (within(self.watch.warm_c, 30.0, 70.0), "watch.warm_c", "between 30 and 70"),
            (
                within(self.watch.min_voltage_v, 5.5, 14.0)
                    && within(self.watch.max_voltage_v, self.watch.min_voltage_v, 14.0),
                "watch.min_voltage_v",
                "at least 5.5 and below watch.max_voltage_v, which is at most 14",
            ),
            (self.motor.stall_torque_n_m > 0.0, "motor.stall_torque_n_m", "above 0"),
            (self.motor.stall_current_a > 0.0, "motor.stall_current_a", "above 0"),
            (self.motor.no_load_speed_rad_s > 0.0, "motor.no_load_speed_rad_s", "above 0"),
            (self.gains.p.iter().all(|p| (1..=16_383).contains(p)), "gains.p", "between 1 and 16383"),
            (self.gains.d.iter().all(|d| *d <= 16_383), "gains.d", "at most 16383"),
            (
                self.gains.current_a.iter().all(|a| within(*a, 0.0, 0.91)),
                "gains.current_a",
                "between 0 and 0.91",
            ),
            (
                within(self.gains.profile_speed_rad_s, 0.0, 700.0),
                "gains.profile_speed_rad_s",
                "between 0 and 700",
            ),
            (
                within(self.gains.profile_acceleration_rad_s2, 0.0, 10_000.0),
                "gains.profile_acceleration_rad_s2",
                "between 0 and 10000",
            ),
            (self.gripper.closed_rad < self.gripper.open_rad, "gripper.closed_rad", "below gripper.open_rad"),
            (within(self.gripper.lead_rad, 0.01, 1.0), "gripper.lead_rad", "between 0.01 and 1"),
            (
                ids.len() == SERVOS && ids.iter().all(|id| *id <= MAX_ID),
                "right.ids, left.ids",
                "eight different ids up to 252",
            ),
            (
                limbs.iter().all(|limb| limb.sign.iter().all(|sign| sign.abs() == 1)),
                "right.sign, left.sign",
                "1 or -1",
            ),
            (
                limbs.iter().all(ordered),
                "min_rad, max_rad of right or left",
                "in order, less than 7 rad apart",
            ),
        ];
        checks.iter().find(|(good, ..)| !good).map(|(_, key, expected)| (*key, *expected))
    }
}

/// Where the user's zero angles are kept by default: `$XDG_CONFIG_HOME/locoman/servo_zeros.toml`.
pub fn default_zeros_file() -> PathBuf {
    let base = std::env::var_os("XDG_CONFIG_HOME")
        .map(PathBuf::from)
        .or_else(|| std::env::var_os("HOME").map(|home| Path::new(&home).join(".config")));
    base.unwrap_or_default().join("locoman/servo_zeros.toml")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documented_defaults_are_the_compiled_ones() {
        let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
        assert_eq!(ServoSettings::load(&configs).unwrap(), ServoSettings::default());
    }

    #[test]
    fn a_setting_without_sense_is_named() {
        let mut sut = ServoSettings::default();
        sut.left.ids[2] = 4;
        assert_eq!(sut.flaw().unwrap().0, "right.ids, left.ids");
        sut = ServoSettings { rate_hz: f64::NAN, ..ServoSettings::default() };
        assert_eq!(sut.flaw().unwrap().0, "rate_hz");
    }
}
