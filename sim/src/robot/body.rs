//! The robot as it was built: the controller's model with what that model has wrong.

use std::f64::consts::TAU;

use locoman_robot::model::{Model, RigidBody};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::profile::BodyErrors;

/// Keeps these draws apart from the sensors' noise of the same seed.
const STREAM: u64 = 1;

/// The robot of a seed.
///
/// The mass and inertia of every link, arms included, are those of the model times `1 + e`, `e` uniform within
/// ± `mass_share`. The centre of mass of the whole robot is off by `com_m` in a direction drawn uniformly from
/// the sphere; the trunk, which holds battery, computers and cables, brings it about.
pub fn built(model: &Model, errors: &BodyErrors, seed: u64) -> Model {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(STREAM);
    let factor = 1.0 + errors.mass_share * (2.0 * random.random::<f64>() - 1.0);
    let (height, turn) = (2.0 * random.random::<f64>() - 1.0, TAU * random.random::<f64>());
    let around = (1.0 - height * height).sqrt();
    let direction = Vector3::new(around * turn.cos(), around * turn.sin(), height);

    let mut robot = model.clone();
    for joint in &mut robot.joints {
        joint.body = scaled(&joint.body, factor);
    }
    robot.torso = scaled(&robot.torso, factor);
    robot.torso.com += direction * (errors.com_m * model.mass() / model.torso.mass);
    robot
}

/// A wrong mass is not a wrong shape: the inertia scales with it.
fn scaled(body: &RigidBody, factor: f64) -> RigidBody {
    RigidBody { mass: factor * body.mass, com: body.com, inertia: factor * body.inertia }
}
