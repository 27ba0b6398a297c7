//! What the control loop tells everybody else, once each step: of fixed size, made without allocation.

use nalgebra::Isometry3;

use super::timing::Percentiles;
use crate::{
    joints::JointVector,
    modes::{Mode, Phase, Refusal},
    supervisor::Assessment,
};

/// A body in the world: where it is and where it should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyState {
    /// By the estimator.
    pub pose: Isometry3<f64>,
    /// Reference of this step; the pose itself where there is none.
    pub target: Isometry3<f64>,
}

/// The command that a step acted on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CommandTrace {
    /// The sending process; 0 for none.
    pub source: u64,
    /// Its number.
    pub sequence: u64,
    /// When the operator moved so.
    pub capture_ns: u64,
    /// When it arrived.
    pub received_ns: u64,
    /// When a control step first used it.
    pub applied_ns: u64,
}

/// State of the robot after a control step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snapshot {
    /// When the sensors were sampled.
    pub time_ns: u64,
    /// Last mode that was reached.
    pub mode: Mode,
    /// What the robot is doing.
    pub phase: Phase,
    /// Where it is going.
    pub goal: Mode,
    /// Number of the last mode request that was looked at.
    pub acknowledged_request: u64,
    /// Why it was refused.
    pub refusal: Option<Refusal>,
    /// The engagement that moves the robot; 0 for none.
    pub engagement: u64,
    /// What the supervisor says.
    pub assessment: Assessment,
    /// Measured, rad.
    pub joint_position: JointVector,
    /// Measured, rad/s.
    pub joint_velocity: JointVector,
    /// Measured, N m.
    pub joint_torque: JointVector,
    /// Measured.
    pub opening: [f64; 2],
    /// Measured, N.
    pub foot_force: [f64; 4],
    /// How often the world was set anew.
    pub world_resets: u64,
    /// How often a standing foot was found to slip.
    pub slips: u64,
    /// Torso.
    pub torso: BodyState,
    /// Grippers right, left.
    pub grippers: [BodyState; 2],
    /// Centres of the front feet right, left, without orientation.
    pub feet: [BodyState; 2],
    /// The command acted on.
    pub command: CommandTrace,
    /// Time from one sample to the next, over the last second.
    pub period: Percentiles,
    /// Time of a control step, over the last second.
    pub compute: Percentiles,
    /// Steps without contact forces.
    pub force_fallbacks: u64,
}

impl Snapshot {
    /// Before the first sample.
    pub fn nothing_known() -> Self {
        let nowhere = BodyState { pose: Isometry3::identity(), target: Isometry3::identity() };
        Self {
            time_ns: 0,
            mode: Mode::Damped,
            phase: Phase::Damped,
            goal: Mode::Damped,
            acknowledged_request: 0,
            refusal: None,
            engagement: 0,
            assessment: Assessment::default(),
            joint_position: JointVector::zeros(),
            joint_velocity: JointVector::zeros(),
            joint_torque: JointVector::zeros(),
            opening: [0.0; 2],
            foot_force: [0.0; 4],
            world_resets: 0,
            slips: 0,
            torso: nowhere,
            grippers: [nowhere; 2],
            feet: [nowhere; 2],
            command: CommandTrace::default(),
            period: Percentiles::default(),
            compute: Percentiles::default(),
            force_fallbacks: 0,
        }
    }
}
