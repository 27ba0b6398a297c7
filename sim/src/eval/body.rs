//! A body of the robot under evaluation: where the controller wants it, believes it, and where it is.

use locoman_robot::dynamics::Dynamics;
use locoman_robot::joints::Side;
use locoman_robot::model::Frame;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::lockstep::{Lockstep, ticks};
use crate::robot::Truth;

/// A body of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Body {
    /// Trunk.
    Torso,
    /// Gripper of a side.
    Gripper(Side),
    /// Front foot of a side: a point, whose orientation is the identity.
    Foot(Side),
}

impl Body {
    /// In figures.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Torso => "torso",
            Self::Gripper(_) => "gripper",
            Self::Foot(_) => "foot",
        }
    }

    /// Where the commander wants it in this tick, in the robot's world.
    pub fn reference(self, sut: &Lockstep) -> Isometry3<f64> {
        match self {
            Self::Torso => sut.snapshot().torso.target,
            Self::Gripper(side) => sut.snapshot().grippers[side.index()].target,
            Self::Foot(side) => sut.snapshot().feet[side.index()].target,
        }
    }

    /// Where the whole-body controller believes it, in the robot's world.
    pub fn estimate(self, dynamics: &Dynamics) -> Isometry3<f64> {
        let frame = match self {
            Self::Torso => Frame::Torso,
            Self::Gripper(side) => Frame::Gripper(side),
            Self::Foot(side) => Frame::Foot(side.leg()),
        };
        self.of(dynamics.frame(frame).world_from_frame)
    }

    /// Where it is, in the robot's world, which is there in the simulator's.
    pub fn truth(self, truth: &Truth, sim_from_world: &Isometry3<f64>) -> Isometry3<f64> {
        let sim_from_body = match self {
            Self::Torso => truth.world_from_torso,
            Self::Gripper(side) => truth.world_from_gripper[side.index()],
            Self::Foot(side) => Isometry3::from(truth.feet_in_world[side.leg().index()]),
        };
        self.of(sim_from_world.inv_mul(&sim_from_body))
    }

    fn of(self, pose: Isometry3<f64>) -> Isometry3<f64> {
        match self {
            Self::Foot(_) => Isometry3::from(pose.translation),
            _ => pose,
        }
    }
}

/// Rests for some time, and gives the simulator's pose of the robot's world: by the torso, which both know.
pub fn align(sut: &mut Lockstep, seconds: f64) -> anyhow::Result<Isometry3<f64>> {
    let mut mean: Option<(Isometry3<f64>, Vector3<f64>, Vector3<f64>)> = None;
    let count = ticks(seconds);
    for _ in 0..count {
        sut.tick()?;
        let estimate = Body::Torso.estimate(sut.controller().wbc().dynamics());
        let now = sut.truth().world_from_torso * estimate.inverse();
        let (first, moved, turned) = mean.get_or_insert((now, Vector3::zeros(), Vector3::zeros()));
        *moved += (now.translation.vector - first.translation.vector) / count as f64;
        *turned += (now.rotation * first.rotation.inverse()).scaled_axis() / count as f64;
    }
    let (first, moved, turned) = mean.unwrap_or_default();
    Ok(Isometry3::from_parts(
        (first.translation.vector + moved).into(),
        UnitQuaternion::from_scaled_axis(turned) * first.rotation,
    ))
}
