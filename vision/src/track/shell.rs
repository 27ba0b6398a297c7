//! The life of one shell: found, followed, predicted, lost, found again.

use nalgebra::Isometry3;

use super::TrackerSettings;
use super::filter::{Judgement, Motion};
use super::update::{ShellUpdate, Verdict};
use crate::camera::Camera;
use crate::pose::{self, Observation, Solution};
use crate::shells::Shell;

/// What is known of one shell.
#[derive(Debug, Default)]
pub(super) struct ShellTracker {
    /// As of the last measurement.
    motion: Option<Motion>,
    /// Measurements in a row that the filter took for jumps.
    jumps: u32,
}

impl ShellTracker {
    /// The motion as of the last measurement.
    pub fn motion(&self) -> Option<&Motion> {
        self.motion.as_ref()
    }

    /// The motion at an instant, if the last measurement is recent enough.
    pub fn motion_at(&self, time_ns: u64, settings: &TrackerSettings) -> Option<Motion> {
        let motion = self.motion.as_ref()?;
        let recent = time_ns.abs_diff(motion.time_ns) <= settings.horizon_ns;
        recent.then(|| motion.predicted(time_ns, &settings.filter))
    }

    /// What is known at an instant without a measurement at it.
    pub fn at(&self, time_ns: u64, settings: &TrackerSettings) -> ShellUpdate {
        match self.motion_at(time_ns, settings) {
            None => ShellUpdate::lost(),
            Some(motion) => described(&motion, Verdict::Predicted),
        }
    }

    /// Takes in what was seen at an instant; also which observations the pose rests on.
    pub fn update(
        &mut self,
        time_ns: u64,
        shell: &Shell,
        cameras: &[Camera],
        observations: &[Observation],
        settings: &TrackerSettings,
    ) -> (ShellUpdate, Vec<bool>) {
        let predicted = self.motion_at(time_ns, settings);
        let guess: Option<&Isometry3<f64>> = predicted.as_ref().map(|motion| &motion.world_from_shell);
        let unused = vec![false; observations.len()];
        let solution = pose::solve(shell, cameras, observations, guess, &settings.solver)
            .filter(|solution| solution.rms_px <= settings.max_rms_px);
        let Some(solution) = solution else {
            return (self.at(time_ns, settings), unused);
        };
        let Some(motion) = self.believe(time_ns, predicted, &solution, settings) else {
            return (self.at(time_ns, settings), unused);
        };
        let update = ShellUpdate {
            rms_px: solution.rms_px,
            tags: solution.tags,
            cameras: solution.cameras,
            ..described(&motion, Verdict::Tracked)
        };
        self.motion = Some(motion);
        (update, solution.used)
    }

    /// The motion after a measurement; `None` if it is taken for a jump.
    fn believe(
        &mut self,
        time_ns: u64,
        predicted: Option<Motion>,
        solution: &Solution,
        settings: &TrackerSettings,
    ) -> Option<Motion> {
        let Solution { world_from_shell, covariance, .. } = solution;
        if let Some(mut motion) = predicted {
            if motion.correct(world_from_shell, covariance, &settings.filter) == Judgement::Accepted {
                self.jumps = 0;
                return Some(motion);
            }
            self.jumps += 1;
            if self.jumps < settings.jumps_to_restart {
                return None;
            }
        }
        self.jumps = 0;
        Some(Motion::begin(time_ns, world_from_shell, covariance, &settings.filter))
    }
}

fn described(motion: &Motion, verdict: Verdict) -> ShellUpdate {
    ShellUpdate {
        verdict,
        world_from_shell: Some(motion.world_from_shell),
        covariance: motion.pose_covariance(),
        velocity_m_s: motion.velocity_m_s,
        rate_rad_s: motion.rate_rad_s,
        rms_px: 0.0,
        tags: 0,
        cameras: 0,
    }
}
