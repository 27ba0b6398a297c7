//! How well a robot followed: its own target against its own estimate, as the paper measures.

use std::fmt;

use locoman_protocol::geometry::isometry;
use locoman_protocol::messages::{Mode, Pose, RobotState};

/// Errors of one body.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BodyScore {
    count: u32,
    sum_mm: f64,
    sum_rad: f64,
    worst_mm: f64,
    worst_rad: f64,
}

impl BodyScore {
    fn add(&mut self, target: &Option<Pose>, estimate: &Option<Pose>) {
        let pose = |pose: &Option<Pose>| pose.as_ref().and_then(|pose| isometry(pose).ok());
        let (Some(target), Some(estimate)) = (pose(target), pose(estimate)) else { return };
        let mm = 1e3 * (target.translation.vector - estimate.translation.vector).norm();
        let rad = target.rotation.angle_to(&estimate.rotation);
        self.count += 1;
        self.sum_mm += mm;
        self.sum_rad += rad;
        self.worst_mm = self.worst_mm.max(mm);
        self.worst_rad = self.worst_rad.max(rad);
    }

    /// States that were looked at.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Mean distance, mm.
    pub fn mean_mm(&self) -> f64 {
        self.sum_mm / f64::from(self.count)
    }

    /// Mean angle, rad.
    pub fn mean_rad(&self) -> f64 {
        self.sum_rad / f64::from(self.count)
    }

    /// Greatest distance, mm.
    pub fn worst_mm(&self) -> f64 {
        self.worst_mm
    }
}

impl fmt::Display for BodyScore {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.2} mm, {:.4} rad mean; {:.2} mm, {:.4} rad worst; {} states",
            self.mean_mm(),
            self.mean_rad(),
            self.worst_mm,
            self.worst_rad,
            self.count
        )
    }
}

/// Errors of the bodies that a mode moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    mode: Mode,
    /// Torso.
    pub torso: BodyScore,
    /// Gripper or foot.
    pub limb: BodyScore,
}

impl Score {
    /// Of nothing yet.
    pub fn new(mode: Mode) -> Self {
        Self { mode, torso: BodyScore::default(), limb: BodyScore::default() }
    }

    /// Takes in a state in which the trajectory is played.
    pub fn add(&mut self, state: &RobotState) {
        self.torso.add(&state.torso_target, &state.torso);
        match self.mode {
            Mode::RightGripper => self.limb.add(&state.right_gripper_target, &state.right_gripper),
            Mode::LeftGripper => self.limb.add(&state.left_gripper_target, &state.left_gripper),
            Mode::RightFoot => self.limb.add(&state.right_foot_target, &state.right_foot),
            Mode::LeftFoot => self.limb.add(&state.left_foot_target, &state.left_foot),
            _ => {}
        }
    }
}

impl fmt::Display for Score {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "target against the robot's estimate, same instant:")?;
        write!(f, "  torso    {}", self.torso)?;
        if self.limb.count > 0 {
            write!(f, "\n  limb     {}", self.limb)?;
        }
        Ok(())
    }
}
