//! What a URDF has no place for: the rotor inertia of the drives.

use std::path::Path;

use serde::Deserialize;

use super::ModelError;
use crate::joints::{JointVector, Leg, Side};

/// `drives.toml`; the file says what each number means and where it comes from.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drives {
    /// Rotor inertia reflected through the gear, kg m².
    pub armature: Armature,
}

/// Reflected rotor inertia of each kind of joint, kg m².
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Armature {
    /// Hip roll.
    pub hip: f64,
    /// Thigh pitch.
    pub thigh: f64,
    /// Knee.
    pub calf: f64,
    /// The three joints of an arm.
    pub arm: [f64; 3],
}

impl Drives {
    /// Reads and checks the file.
    pub fn load(path: &Path) -> Result<Self, ModelError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ModelError::Read { file: path.to_owned(), source })?;
        let drives: Self = toml::from_str(&text)
            .map_err(|source| ModelError::Table { file: path.to_owned(), source: Box::new(source) })?;
        match drives.armature().iter().find(|value| !value.is_finite() || **value < 0.0) {
            None => Ok(drives),
            Some(value) => Err(ModelError::Element {
                file: path.to_owned(),
                element: "armature".to_owned(),
                reason: format!("{value} kg m2 is not an inertia; give a number of at least 0"),
            }),
        }
    }

    /// For each joint, kg m².
    pub fn armature(&self) -> JointVector {
        let mut armature = JointVector::zeros();
        for leg in Leg::ALL {
            let of_leg = [self.armature.hip, self.armature.thigh, self.armature.calf];
            armature.fixed_rows_mut::<3>(leg.first_joint()).copy_from_slice(&of_leg);
        }
        for side in Side::ALL {
            armature.fixed_rows_mut::<3>(side.first_arm_joint()).copy_from_slice(&self.armature.arm);
        }
        armature
    }
}
