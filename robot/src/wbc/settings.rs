//! The controller's numbers; `configs/robot/wbc.toml` says what each means and where it comes from.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use serde::Deserialize;

use super::ObjectiveKind;

/// Feedback of one kind of objective, and the limits of what it may ask for.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// K_p^acc for each axis, 1/s².
    pub kp: Vector3<f64>,
    /// K_d^acc for each axis, 1/s.
    pub kd: Vector3<f64>,
    /// Greatest error that is acted on, m or rad.
    pub max_error: f64,
    /// Greatest commanded acceleration, m/s² or rad/s².
    pub max_acceleration: f64,
    /// Singular values of the projected Jacobian below this are damped, m/rad or 1.
    pub damping_start: f64,
    /// Share of the error that the joints' positions take up at once; the rest is left to accelerations. Below 1 for a
    /// torso that two feet cannot move as they like.
    #[serde(default = "whole")]
    pub step_share: f64,
}

impl Gains {
    /// The same without feedback: neither joints' positions nor accelerations are asked for because of an error.
    pub(super) fn feed_forward(&self) -> Self {
        Self { kp: Vector3::zeros(), kd: Vector3::zeros(), step_share: 0.0, ..*self }
    }
}

const fn whole() -> f64 {
    1.0
}

/// Gains of every kind of objective.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectiveGains {
    /// Torso position.
    pub torso_position: Gains,
    /// Torso orientation.
    pub torso_orientation: Gains,
    /// Foot position.
    pub foot_position: Gains,
    /// Gripper position.
    pub gripper_position: Gains,
    /// Gripper orientation.
    pub gripper_orientation: Gains,
    /// Posture of a leg.
    pub leg_posture: Gains,
    /// Posture of an arm.
    pub arm_posture: Gains,
}

impl ObjectiveGains {
    /// Those of one kind.
    pub fn of(&self, kind: ObjectiveKind) -> &Gains {
        match kind {
            ObjectiveKind::TorsoPosition => &self.torso_position,
            ObjectiveKind::TorsoOrientation => &self.torso_orientation,
            ObjectiveKind::FootPosition(_) => &self.foot_position,
            ObjectiveKind::GripperPosition(_) => &self.gripper_position,
            ObjectiveKind::GripperOrientation(_) => &self.gripper_orientation,
            ObjectiveKind::LegPosture(_) => &self.leg_posture,
            ObjectiveKind::ArmPosture(_) => &self.arm_posture,
        }
    }
}

/// The contact-force problem.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactForceSettings {
    /// µ of the friction pyramid.
    pub friction: f64,
    /// Least vertical force of a foot in contact, in body weights.
    pub min_vertical: f64,
    /// Greatest vertical force of a foot in full contact, in body weights.
    pub max_vertical: f64,
    /// Q_1: weight of the forces, 1/N².
    pub force_weight: f64,
    /// Q_2: weights of δ_t, the torso's linear (3) and angular (3) acceleration that is given up.
    pub slack_weight: [f64; 6],
    /// Steps in a row without forces that make a fault.
    pub failures_to_fault: u32,
}

/// What is different while the robot walks.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WalkingSettings {
    /// Torso position.
    pub torso_position: Gains,
    /// Torso orientation.
    pub torso_orientation: Gains,
    /// Feet in the air.
    pub foot_position: Gains,
}

/// How joints, limbs and links come to a stop.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StopSettings {
    /// α: what is left to a limit decays at this rate, 1/s.
    pub rate: f64,
    /// a: braking from higher speeds, rad/s² (m/s² for heights).
    pub braking: f64,
    /// Greatest acceleration that a limit asks for, rad/s².
    pub max_acceleration: f64,
    /// Share of the model's joint velocities that is used.
    pub speed_share: f64,
    /// A desired joint position is at most the way of this time, at what is left to that speed, away from where the joint
    /// is, s.
    pub step_time_s: f64,
    /// Links stay so far apart, m.
    pub collision_margin: f64,
    /// Links of a limb in the air stay so far above what the other feet stand on, m.
    pub ground_clearance: f64,
}

impl Default for StopSettings {
    fn default() -> Self {
        Self {
            rate: 15.0,
            braking: 40.0,
            max_acceleration: 100.0,
            speed_share: 0.6,
            step_time_s: 0.015,
            collision_margin: 0.01,
            ground_clearance: 0.01,
        }
    }
}

/// Everything in `wbc.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WbcSettings {
    /// Feedback of the objectives.
    pub objectives: ObjectiveGains,
    /// Contact forces.
    pub contact: ContactForceSettings,
    /// What is different while the robot walks.
    pub walking: WalkingSettings,
    /// How everything comes to a stop.
    pub stops: StopSettings,
    /// Joints stop this far before the ends of their ranges, rad.
    pub joint_margin: f64,
    /// Greatest joint acceleration asked for by the objectives together, rad/s².
    pub max_joint_acceleration: f64,
}

/// Why settings were refused.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The file could not be read.
    #[error("cannot read {file}: {source}; is `--configs` the folder `configs` of this project?")]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is not what it should be.
    #[error("{file}: {source}")]
    Parse {
        /// The file.
        file: PathBuf,
        /// What the parser said, with the line.
        source: Box<toml::de::Error>,
    },
    /// A number that makes no sense.
    #[error("{file}: `{key}` must be {expected}")]
    Value {
        /// The file.
        file: PathBuf,
        /// The key, or its table.
        key: &'static str,
        /// What it must be.
        expected: &'static str,
    },
}

impl Default for WbcSettings {
    fn default() -> Self {
        let gains = |kp: f64, kd: f64, max_error: f64, max_acceleration: f64, damping_start: f64| Gains {
            kp: Vector3::repeat(kp),
            kd: Vector3::repeat(kd),
            max_error,
            max_acceleration,
            damping_start,
            step_share: 1.0,
        };
        Self {
            objectives: ObjectiveGains {
                torso_position: gains(100.0, 10.0, 0.05, 10.0, 0.05),
                torso_orientation: gains(100.0, 10.0, 0.3, 10.0, 0.05),
                foot_position: gains(100.0, 10.0, 0.05, 20.0, 0.02),
                gripper_position: gains(100.0, 10.0, 0.05, 20.0, 0.02),
                gripper_orientation: gains(100.0, 10.0, 0.3, 30.0, 0.05),
                leg_posture: gains(100.0, 10.0, 0.3, 30.0, 0.05),
                arm_posture: gains(100.0, 10.0, 0.3, 30.0, 0.05),
            },
            contact: ContactForceSettings {
                friction: 0.6,
                min_vertical: 0.01,
                max_vertical: 1.5,
                force_weight: 1e-5,
                slack_weight: [20.0, 20.0, 5.0, 1.0, 1.0, 0.2],
                failures_to_fault: 3,
            },
            walking: WalkingSettings {
                torso_position: Gains {
                    kd: Vector3::new(20.0, 20.0, 10.0),
                    step_share: 0.5,
                    ..gains(100.0, 0.0, 0.05, 20.0, 0.05)
                },
                torso_orientation: Gains {
                    kp: Vector3::new(200.0, 200.0, 100.0),
                    kd: Vector3::new(20.0, 20.0, 10.0),
                    step_share: 0.5,
                    ..gains(0.0, 0.0, 0.3, 50.0, 0.05)
                },
                foot_position: gains(100.0, 10.0, 0.05, 100.0, 0.02),
            },
            stops: StopSettings::default(),
            joint_margin: 0.01,
            max_joint_acceleration: 200.0,
        }
    }
}

impl WbcSettings {
    /// Reads `wbc.toml`.
    pub fn load(path: &Path) -> Result<Self, SettingsError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| SettingsError::Read { file: path.to_owned(), source })?;
        let settings: Self = toml::from_str(&text)
            .map_err(|source| SettingsError::Parse { file: path.to_owned(), source: Box::new(source) })?;
        match settings.flaw() {
            None => Ok(settings),
            Some((key, expected)) => Err(SettingsError::Value { file: path.to_owned(), key, expected }),
        }
    }

    /// The gains of one kind of objective of a robot that stands or walks.
    pub fn gains(&self, kind: ObjectiveKind, walks: bool) -> &Gains {
        match kind {
            ObjectiveKind::TorsoPosition if walks => &self.walking.torso_position,
            ObjectiveKind::TorsoOrientation if walks => &self.walking.torso_orientation,
            ObjectiveKind::FootPosition(_) if walks => &self.walking.foot_position,
            _ => self.objectives.of(kind),
        }
    }

    /// The first key whose number makes no sense, and what it must be.
    fn flaw(&self) -> Option<(&'static str, &'static str)> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let objectives = &self.objectives;
        let tables = [
            ("objectives.torso_position", &objectives.torso_position),
            ("objectives.torso_orientation", &objectives.torso_orientation),
            ("objectives.foot_position", &objectives.foot_position),
            ("objectives.gripper_position", &objectives.gripper_position),
            ("objectives.gripper_orientation", &objectives.gripper_orientation),
            ("objectives.leg_posture", &objectives.leg_posture),
            ("objectives.arm_posture", &objectives.arm_posture),
            ("walking.torso_position", &self.walking.torso_position),
            ("walking.torso_orientation", &self.walking.torso_orientation),
            ("walking.foot_position", &self.walking.foot_position),
        ];
        for (table, gains) in tables {
            if !gains.kp.iter().chain(&gains.kd).all(|gain| *gain >= 0.0 && gain.is_finite()) {
                return Some((table, "given gains kp and kd of at least 0"));
            }
            if ![gains.max_error, gains.max_acceleration, gains.damping_start].into_iter().all(positive) {
                return Some((table, "given max_error, max_acceleration and damping_start above 0"));
            }
            if !(0.0..=1.0).contains(&gains.step_share) {
                return Some((table, "given a step_share of 0 to 1"));
            }
        }
        let contact = &self.contact;
        let least = contact.min_vertical;
        let stops = &self.stops;
        let checks = [
            ("stops.rate", positive(stops.rate), "above 0 1/s"),
            ("stops.braking", positive(stops.braking), "above 0 rad/s2"),
            ("stops.max_acceleration", positive(stops.max_acceleration), "above 0 rad/s2"),
            ("stops.speed_share", stops.speed_share > 0.0 && stops.speed_share <= 1.0, "above 0, at most 1"),
            ("stops.step_time_s", positive(stops.step_time_s), "above 0 s"),
            ("stops.collision_margin", (0.0..0.05).contains(&stops.collision_margin), "0 to 0.05 m"),
            (
                "stops.ground_clearance",
                (0.0..0.1).contains(&stops.ground_clearance),
                "at least 0 and below 0.1 m",
            ),
            ("max_joint_acceleration", positive(self.max_joint_acceleration), "above 0 rad/s2"),
            ("joint_margin", (0.0..0.2).contains(&self.joint_margin), "at least 0 and below 0.2 rad"),
            ("contact.friction", positive(contact.friction), "above 0"),
            ("contact.min_vertical", least >= 0.0 && least.is_finite(), "at least 0 body weights"),
            ("contact.max_vertical", contact.max_vertical > least, "above contact.min_vertical"),
            ("contact.force_weight", positive(contact.force_weight), "above 0"),
            ("contact.slack_weight", contact.slack_weight.into_iter().all(positive), "six numbers above 0"),
            ("contact.failures_to_fault", contact.failures_to_fault > 0, "at least 1"),
        ];
        checks.into_iter().find(|(_, sound, _)| !sound).map(|(key, _, expected)| (key, expected))
    }
}
