//! What happens to a robot that nobody planned: pushes, loads, slippery ground, lost commands.
//!
//! ```text
//! push      a wrench on the torso or a gripper for a time     MuJoCo's `xfrc_applied`
//! load      a mass in a gripper until it is taken out         mass of a body that is welded to the hand
//! friction  of one foot or everything until changed           the contacts take that coefficient
//! silence   commands are lost for a time                      the last one stays in force, as on the Go1
//! ```
//! Each takes effect at the next step; [`SimRobot::reset`](super::SimRobot::reset) ends all of them.

use locoman_robot::joints::{Leg, Side};
use nalgebra::Vector3;

use super::SimRobotError;

/// What can be pushed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// The trunk, at its centre of mass.
    Torso,
    /// A gripper, at its grasp centre.
    Gripper(Side),
}

impl Target {
    /// Number of targets.
    pub const COUNT: usize = 3;

    /// 0 for the torso, then the grippers right and left.
    pub fn index(self) -> usize {
        match self {
            Self::Torso => 0,
            Self::Gripper(side) => 1 + side.index(),
        }
    }
}

/// A disturbance, from now on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbance {
    /// A constant wrench in world axes; takes the place of an earlier push on the same target.
    Push {
        /// Where it acts.
        target: Target,
        /// N.
        force_n: Vector3<f64>,
        /// N m.
        torque_nm: Vector3<f64>,
        /// s; at least one step of the physics.
        duration_s: f64,
    },
    /// A cube of 40 mm with its centre in the grasp centre, held fast; 0 takes it out.
    Load {
        /// The gripper.
        side: Side,
        /// kg.
        mass_kg: f64,
    },
    /// Coulomb friction between a foot, or everything, and the ground.
    Friction {
        /// The foot; none means everything.
        foot: Option<Leg>,
        /// Coefficient; rubber on ice has 0.05.
        coefficient: f64,
    },
    /// Commands sent during this time never arrive.
    Silence {
        /// s.
        duration_s: f64,
    },
}

impl Disturbance {
    /// A force on the torso's centre of mass.
    pub fn push_torso(force_n: Vector3<f64>, duration_s: f64) -> Self {
        Self::Push { target: Target::Torso, force_n, torque_nm: Vector3::zeros(), duration_s }
    }

    /// A force on a gripper's grasp centre.
    pub fn push_gripper(side: Side, force_n: Vector3<f64>, duration_s: f64) -> Self {
        Self::Push { target: Target::Gripper(side), force_n, torque_nm: Vector3::zeros(), duration_s }
    }

    /// Refuses what no world can do.
    pub fn check(&self) -> Result<(), SimRobotError> {
        let (what, value) = match *self {
            Self::Push { force_n, torque_nm, duration_s, .. } => {
                if !force_n.iter().chain(&torque_nm).all(|value| value.is_finite()) {
                    return Err(refused("a push", f64::NAN));
                }
                ("the duration of a push, s,", duration_s)
            }
            Self::Load { mass_kg, .. } => ("a load's mass, kg,", mass_kg),
            Self::Friction { coefficient, .. } => ("a friction coefficient", coefficient),
            Self::Silence { duration_s } => ("the duration of a silence, s,", duration_s),
        };
        if value.is_finite() && value >= 0.0 { Ok(()) } else { Err(refused(what, value)) }
    }
}

fn refused(what: &'static str, value: f64) -> SimRobotError {
    SimRobotError::Disturbance { what, value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_is_refused() {
        assert!(Disturbance::push_torso(Vector3::new(10.0, 0.0, 0.0), 0.1).check().is_ok());
        assert!(Disturbance::push_torso(Vector3::new(f64::NAN, 0.0, 0.0), 0.1).check().is_err());
        assert!(Disturbance::Load { side: Side::Left, mass_kg: -0.1 }.check().is_err());
        assert!(Disturbance::Friction { foot: None, coefficient: -1.0 }.check().is_err());
        assert!(Disturbance::Silence { duration_s: f64::INFINITY }.check().is_err());
    }
}
