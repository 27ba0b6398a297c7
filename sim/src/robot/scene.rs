//! `configs/scenes/robot.toml`: the physics, the drives and the imperfections of the stand-in robot.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::SimRobotError;
use super::profile::Profile;

/// The file within the configuration folder.
pub const SCENE_FILE: &str = "scenes/robot.toml";

/// The whole scene file. Every key is explained in the file itself.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Integration and contacts.
    pub physics: Physics,
    /// The legs' drives.
    pub leg: LegDrive,
    /// The arms' servos.
    pub arm: ArmServo,
    /// The jaws and their servo.
    pub gripper: Gripper,
    /// Named starting postures.
    pub posture: BTreeMap<String, Posture>,
    /// Named sets of imperfections.
    pub profile: BTreeMap<String, Profile>,
}

/// Integration and contacts.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Physics {
    /// One MuJoCo step, s.
    pub timestep_s: f64,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// Time constant of a contact, s.
    pub contact_time_s: f64,
    /// MuJoCo's `impratio`.
    pub friction_stiffness_ratio: f64,
}

/// The legs' drives: hip, thigh, calf.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LegDrive {
    /// Torque limits, N m.
    pub torque_limit_nm: [f64; 3],
    /// Speeds at which no torque is left, rad/s.
    pub no_load_speed_rad_s: [f64; 3],
    /// Share of the no-load speed up to which the full torque is available.
    pub full_torque_speed_share: f64,
}

/// The arms' servos: joints 1 to 3.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmServo {
    /// Stall torque, N m.
    pub torque_limit_nm: f64,
    /// No-load speed, rad/s.
    pub no_load_speed_rad_s: f64,
    /// Current at stall, A.
    pub stall_current_a: f64,
    /// Goal current, which limits the motor's, A.
    pub current_limit_a: f64,
    /// Register PWM Limit.
    pub pwm_limit: f64,
    /// Registers Position P Gain.
    pub p_gain: [f64; 3],
    /// Registers Position D Gain.
    pub d_gain: [f64; 3],
}

/// The jaws and their servo.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gripper {
    /// Jaw angle at opening 0, rad.
    pub closed_rad: f64,
    /// Jaw angle at opening 1, rad.
    pub open_rad: f64,
    /// Position gain, N m/rad.
    pub kp: f64,
    /// Velocity gain, N m s/rad.
    pub kd: f64,
    /// Stall torque, N m.
    pub torque_limit_nm: f64,
    /// No-load speed, rad/s.
    pub no_load_speed_rad_s: f64,
    /// Largest distance of the goal from the measured angle, rad.
    pub lead_rad: f64,
    /// Mass of one jaw, kg.
    pub jaw_mass_kg: f64,
    /// Reflected inertia at one jaw, kg m2.
    pub jaw_armature: f64,
}

/// A starting posture.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Posture {
    /// Height of the trunk's origin above the ground when released, m.
    pub trunk_height_m: f64,
    /// Hip, thigh, calf of every leg, rad.
    pub leg: [f64; 3],
    /// Right arm, rad.
    pub right_arm: [f64; 3],
    /// Left arm, rad.
    pub left_arm: [f64; 3],
    /// Whether the joints are held while it settles; damped otherwise.
    pub held: bool,
    /// Time to settle before time zero, s.
    pub settle_s: f64,
}

impl Scene {
    /// Reads the scene of a configuration folder.
    pub fn load(configs: &Path) -> Result<Self, SimRobotError> {
        let path = configs.join(SCENE_FILE);
        let text = std::fs::read_to_string(&path)
            .map_err(|reason| SimRobotError::Read { path: path.clone(), reason })?;
        let scene: Self = toml::from_str(&text)
            .map_err(|reason| SimRobotError::Scene { path: path.clone(), reason: Box::new(reason) })?;
        scene.check().map_err(|problem| SimRobotError::Value { path, problem })?;
        Ok(scene)
    }

    /// The profile of this name.
    pub fn profile(&self, name: &str) -> Result<&Profile, SimRobotError> {
        named(&self.profile, "profile", name)
    }

    /// The posture of this name.
    pub fn posture(&self, name: &str) -> Result<&Posture, SimRobotError> {
        named(&self.posture, "posture", name)
    }

    fn check(&self) -> Result<(), String> {
        let physics = &self.physics;
        if !(1e-5..=2.5e-3).contains(&physics.timestep_s) {
            return Err(format!(
                "physics.timestep_s = {} is not within 0.00001 to 0.0025",
                physics.timestep_s
            ));
        }
        let steps = super::EXCHANGE_S / physics.timestep_s;
        if (steps - steps.round()).abs() > 1e-9 {
            return Err(format!(
                "physics.timestep_s = {} does not divide the exchange of 0.0025 s",
                physics.timestep_s
            ));
        }
        if physics.contact_time_s < 2.0 * physics.timestep_s {
            return Err(format!(
                "physics.contact_time_s = {} is below two steps of {} s: contacts would be unstable",
                physics.contact_time_s, physics.timestep_s
            ));
        }
        for (name, profile) in &self.profile {
            if let Some(problem) = profile.problem(physics.timestep_s) {
                return Err(format!("profile.{name}.{problem}"));
            }
        }
        Ok(())
    }
}

fn named<'a, T>(
    all: &'a BTreeMap<String, T>,
    what: &'static str,
    name: &str,
) -> Result<&'a T, SimRobotError> {
    all.get(name).ok_or_else(|| SimRobotError::Unknown {
        what,
        name: name.to_owned(),
        known: all.keys().cloned().collect::<Vec<_>>().join(", "),
    })
}
