//! The state message of a snapshot.

use locoman_protocol::messages::{self, Pose, RobotState};

use crate::{
    control::{Percentiles, Snapshot},
    joints::JointVector,
    supervisor::Severity,
};

/// Fills in the message; its header is the sender's.
pub fn message(snapshot: &Snapshot, commands_accepted: u64, commands_rejected: u64) -> RobotState {
    let [right, left] = &snapshot.grippers;
    let [right_foot, left_foot] = &snapshot.feet;
    let pose = |pose| Some(Pose::from(pose));
    RobotState {
        header: None,
        mode: snapshot.mode.to_message().into(),
        phase: snapshot.phase.text().to_owned(),
        goal: snapshot.goal.to_message().into(),
        acknowledged_mode_request: snapshot.acknowledged_request,
        refusal: snapshot.refusal.map_or(String::new(), |refusal| refusal.text().to_owned()),
        engagement: snapshot.engagement,
        severity: severity(snapshot.assessment.severity).into(),
        reasons: snapshot.assessment.reasons.iter().map(|reason| reason.text().to_owned()).collect(),
        joint_position_rad: joints(&snapshot.joint_position),
        joint_velocity_rad_s: joints(&snapshot.joint_velocity),
        joint_torque_nm: joints(&snapshot.joint_torque),
        right_opening: snapshot.opening[0],
        left_opening: snapshot.opening[1],
        foot_force_n: snapshot.foot_force.to_vec(),
        world_resets: snapshot.world_resets,
        torso: pose(&snapshot.torso.pose),
        torso_target: pose(&snapshot.torso.target),
        right_gripper: pose(&right.pose),
        right_gripper_target: pose(&right.target),
        left_gripper: pose(&left.pose),
        left_gripper_target: pose(&left.target),
        right_foot: pose(&right_foot.pose),
        right_foot_target: pose(&right_foot.target),
        left_foot: pose(&left_foot.pose),
        left_foot_target: pose(&left_foot.target),
        command_source: snapshot.command.source,
        command_sequence: snapshot.command.sequence,
        command_capture_ns: snapshot.command.capture_ns,
        command_received_ns: snapshot.command.received_ns,
        command_applied_ns: snapshot.command.applied_ns,
        commands_accepted,
        commands_rejected,
        period: Some(timing(&snapshot.period)),
        compute: Some(timing(&snapshot.compute)),
        force_fallbacks: snapshot.force_fallbacks,
    }
}

fn joints(vector: &JointVector) -> Vec<f64> {
    vector.as_slice().to_vec()
}

fn timing(percentiles: &Percentiles) -> messages::Timing {
    let Percentiles { p50_ns, p99_ns, worst_ns, count } = *percentiles;
    messages::Timing { p50_ns, p99_ns, worst_ns, count }
}

fn severity(severity: Severity) -> messages::Severity {
    match severity {
        Severity::None => messages::Severity::None,
        Severity::Warn => messages::Severity::Warn,
        Severity::Hold => messages::Severity::Hold,
        Severity::Disengage => messages::Severity::Disengage,
        Severity::Stand => messages::Severity::Stand,
        Severity::LieDown => messages::Severity::LieDown,
        Severity::Damp => messages::Severity::Damp,
    }
}
