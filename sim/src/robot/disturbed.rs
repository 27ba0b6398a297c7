//! How disturbances reach MuJoCo: applied wrenches, and models that differ from the calm one in a mass or a
//! coefficient.

use std::sync::Arc;

use locoman_robot::joints::{Leg, Side};
use mujoco_rs::prelude::MjModel;
use nalgebra::Vector3;

use super::SimRobotError;
use super::disturbance::Target;
use super::world::{World, address, mujoco};

impl World {
    /// A wrench on a target in world axes until changed, N and N m.
    pub fn set_push(&mut self, target: Target, force: Vector3<f64>, torque: Vector3<f64>) {
        // MuJoCo applies it at the body's centre of mass: the trunk's own, and the grasp centre.
        let body = match target {
            Target::Torso => self.trunk,
            Target::Gripper(side) => self.grasps[side.index()],
        };
        self.data.xfrc_applied_mut()[body] = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
    }

    /// A cube of 40 mm in a gripper.
    pub fn set_load(&mut self, side: Side, mass_kg: f64) -> Result<(), SimRobotError> {
        /// Edge of the cube, m.
        const EDGE: f64 = 0.04;
        let grasp = self.grasps[side.index()];
        let mut model = self.data.model().clone();
        let more = mass_kg - model.body_mass()[grasp];
        model.body_mass_mut()[grasp] = mass_kg;
        model.body_inertia_mut()[grasp] = [mass_kg * EDGE * EDGE / 6.0; 3];
        let mut body = grasp;
        while body != 0 {
            model.body_subtreemass_mut()[body] += more;
            body = address(model.body_parentid()[body]);
        }
        self.disturbed(model)
    }

    /// Friction coefficient between a foot and the ground.
    pub fn set_friction(&mut self, foot: Leg, coefficient: f64) -> Result<(), SimRobotError> {
        let mut model = self.data.model().clone();
        model.geom_friction_mut()[self.foot_geoms[foot.index()]][0] = coefficient;
        self.disturbed(model)
    }

    /// Friction coefficient of everything on the ground.
    pub fn set_friction_everywhere(&mut self, coefficient: f64) -> Result<(), SimRobotError> {
        let mut model = self.data.model().clone();
        model.geom_friction_mut().iter_mut().for_each(|friction| friction[0] = coefficient);
        self.disturbed(model)
    }

    /// Ends all disturbances.
    pub fn calm(&mut self) -> Result<(), SimRobotError> {
        self.data.xfrc_applied_mut().fill([0.0; 6]);
        self.data.try_swap_model(Arc::clone(&self.calm)).map_err(mujoco)?;
        Ok(())
    }

    fn disturbed(&mut self, model: MjModel) -> Result<(), SimRobotError> {
        self.data.try_swap_model(Arc::new(model)).map_err(mujoco)?;
        Ok(())
    }
}
