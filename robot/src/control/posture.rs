//! What a robot that we meet looks like: down, on four feet, or on three.

use nalgebra::Vector3;

use crate::{
    estimator::{tilt, tilt_angle},
    joints::{Leg, Side},
    kinematics::FootKinematics,
    model::{GRAVITY, Model},
    modes::Start,
    plant::Sensors,
};

/// Share of the weight that the feet must carry to count as standing.
const CARRIED_SHARE: f64 = 0.7;
/// Torso's height above the feet that counts as standing, m: a folded robot has 0.1.
const STANDING_HEIGHT_M: f64 = 0.15;
/// Lean up to which a robot counts as standing, rad.
const STANDING_TILT_RAD: f64 = 0.4;
/// Share of the mean load below which a foot counts as not carrying.
const IDLE_SHARE: f64 = 0.15;
/// Height above the other feet from which a foot without load counts as in the air, m.
const IN_THE_AIR_M: f64 = 0.01;

/// Judges a sample.
pub fn judge(model: &Model, sensors: &Sensors) -> Start {
    let force: f64 = sensors.foot_force.iter().sum();
    if force < CARRIED_SHARE * model.mass() * GRAVITY || tilt_angle(&sensors.attitude) > STANDING_TILT_RAD {
        return Start::Down;
    }
    let level = tilt(&sensors.attitude);
    let height = |leg: Leg| -> f64 {
        let foot = FootKinematics::new(model, &sensors.position, leg);
        (level * foot.position()).dot(&Vector3::z())
    };
    let rear = 0.5 * (height(Leg::RearRight) + height(Leg::RearLeft));
    if -rear < STANDING_HEIGHT_M {
        return Start::Down;
    }
    let lifted = |side: &Side| {
        let leg = side.leg();
        sensors.foot_force[leg.index()] < IDLE_SHARE * force / 4.0 && height(leg) - rear > IN_THE_AIR_M
    };
    Side::ALL.into_iter().find(lifted).map_or(Start::Standing, Start::OnThree)
}
