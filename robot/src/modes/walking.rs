//! The robot walks as the operator says: where to, how high and tilted, and how its grippers are turned.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::{mode::Arms, scene::Scene, setpoint::Setpoint};
use crate::{
    commander::{Command, DrivenBody, Limits, PoseReference, SampleClock},
    joints::Side,
    kinematics::torso_from_frame,
    locomotion::{LocomotionSettings, Velocity, Walker},
    model::Frame,
    trajectory::Sample,
    wbc::PointReference,
};

/// What is driven while the robot walks, besides its torso's posture.
#[derive(Debug, Clone)]
pub struct Walking {
    walker: Walker,
    /// Those that hold something.
    arms: Option<Arms>,
    /// Where to.
    velocity: Velocity,
    /// How grippers right, left are turned.
    grippers: [DrivenBody; 2],
}

impl Walking {
    /// From where the robot stands; grippers as the desired joints hold them.
    pub fn begin(
        settings: &LocomotionSettings,
        limits: &Limits,
        arms: Option<Arms>,
        setpoint: &Setpoint,
        scene: &Scene<'_>,
    ) -> Self {
        let settings = if arms.is_some() { settings.for_holding() } else { *settings };
        let grippers = Side::ALL.map(|side| {
            let torso_from_gripper = torso_from_frame(scene.model, scene.desired, Frame::Gripper(side));
            let gripper = turned((setpoint.torso.pose() * torso_from_gripper).rotation);
            DrivenBody::new(PoseReference::hold(&gripper), limits.follower_rad_s, limits.gripper_rate)
        });
        Self { walker: Walker::new(settings, scene), arms, velocity: Velocity::default(), grippers }
    }

    /// A torso's reference about the course: what the operator moves.
    pub fn posture_of(&self, torso: &PoseReference) -> PoseReference {
        self.walker.posture_of(torso)
    }

    /// Steps on the spot, until the feet are in their places.
    pub const fn step_into_place(&mut self) {
        self.walker.step_into_place();
    }

    /// Whether it stands on four feet.
    pub const fn is_halted(&self) -> bool {
        self.walker.is_halted()
    }

    /// Goes there from now on.
    pub fn head(&mut self, velocity: Velocity) {
        self.velocity = velocity;
    }

    /// Marks the beginning of an engagement.
    pub fn engage(&mut self) {
        self.grippers.iter_mut().for_each(DrivenBody::engage);
    }

    /// Lets go: comes to rest.
    pub fn release(&mut self) {
        self.velocity = Velocity::default();
        self.grippers.iter_mut().for_each(DrivenBody::release);
    }

    /// A fresh sample of how grippers are to be turned.
    pub fn displace(&mut self, command: &Command, clock: &SampleClock, now_ns: u64) {
        for (gripper, palm) in self.grippers.iter_mut().zip(&command.palms) {
            gripper.displace(palm.map(|palm| turned(palm.rotation)).as_ref(), clock, now_ns);
        }
    }

    /// One step. `posture` is the torso's about its course.
    pub fn step(
        &mut self,
        posture: &PoseReference,
        played: Option<&Sample>,
        scene: &Scene<'_>,
        setpoint: &mut Setpoint,
    ) {
        setpoint.walk(&self.walker.step(&self.velocity, posture, scene), self.arms);
        for side in Side::ALL {
            let gripper = &mut self.grippers[side.index()];
            let turn = played.map(|sample| PoseReference {
                point: PointReference::hold(Vector3::zeros()),
                ..sample.limbs[side.index()]
            });
            gripper.advance_by(turn.as_ref(), scene.now_ns, scene.dt_s, |wanted| *wanted);
            setpoint.turn_gripper(side, gripper.reference().rotation);
        }
    }
}

/// A rotation as the pose of a body that is only turned.
fn turned(rotation: UnitQuaternion<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(Vector3::zeros().into(), rotation)
}
