//! The snapshot of a control step.

use nalgebra::Isometry3;

use super::{
    controller::Controller,
    snapshot::{BodyState, Snapshot},
};
use crate::{
    dynamics::State,
    joints::Side,
    kinematics::torso_from_frame,
    model::Frame,
    plant::Sensors,
    supervisor::{Assessment, Severity},
};

impl Controller {
    /// Writes down what the step did.
    pub(super) fn report(&mut self, sensors: &Sensors, state: &State, assessment: Assessment) {
        let setpoint = self.choreography.setpoint();
        let balanced = self.machine.phase().is_balanced();
        let torso = state.world_from_torso;
        let torso_target = if balanced { setpoint.torso.pose() } else { torso };
        let gripper = |side: Side| {
            let frame = Frame::Gripper(side);
            let pose = torso * torso_from_frame(&self.config.model, &sensors.position, frame);
            let target = match setpoint.gripper(side) {
                Some(reference) if balanced => reference.pose(),
                _ if balanced => {
                    let held = torso_target * torso_from_frame(&self.config.model, &self.desired, frame);
                    let turned = setpoint.gripper_rotation(side).map(|rotation| rotation.orientation);
                    Isometry3::from_parts(held.translation, turned.unwrap_or(held.rotation))
                }
                _ => pose,
            };
            BodyState { pose, target }
        };
        let foot = |side: Side| {
            let point = |torso: &Isometry3<f64>, joints| {
                let foot = torso * torso_from_frame(&self.config.model, joints, Frame::Foot(side.leg()));
                Isometry3::from(foot.translation)
            };
            let pose = point(&torso, &sensors.position);
            let target = match setpoint.foot(side.leg()) {
                Some(reference) if balanced => Isometry3::from(reference.position),
                _ if balanced => point(&torso_target, &self.desired),
                _ => pose,
            };
            BodyState { pose, target }
        };
        let holding = assessment.severity >= Severity::Hold;
        self.snapshot = Snapshot {
            time_ns: sensors.time_ns,
            mode: self.machine.mode(),
            phase: self.machine.phase(),
            goal: self.machine.goal(),
            acknowledged_request: self.requests.acknowledged(),
            refusal: self.refusal,
            engagement: if holding { 0 } else { self.engagement.number() },
            assessment,
            joint_position: sensors.position,
            joint_velocity: sensors.velocity,
            joint_torque: sensors.torque,
            opening: sensors.opening,
            foot_force: sensors.foot_force,
            world_resets: self.estimator.resets(),
            slips: self.estimator.slips(),
            torso: BodyState { pose: torso, target: torso_target },
            grippers: Side::ALL.map(gripper),
            feet: Side::ALL.map(foot),
            command: self.trace,
            period: self.snapshot.period,
            compute: self.snapshot.compute,
            force_fallbacks: self.output.status.force_failures,
        };
    }
}
