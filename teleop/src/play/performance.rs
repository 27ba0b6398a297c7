//! From any state of the robot to the end of a trajectory, step by step: stand, go to the mode, engage, play.
//!
//! Has no clock and no socket.

use locoman_protocol::messages::{Device, Mode, OperatorCommand, RobotState, Severity, Trajectory};
use locoman_protocol::trajectory::TrajectoryFile;

use crate::ids::Ids;

/// A request that led nowhere is repeated after this.
const RETRY_NS: u64 = 3_000_000_000;
/// Standing up and changing the mode take about 4 s each.
const ON_THE_WAY_NS: u64 = 60_000_000_000;
/// An engagement that the robot has not taken up after this was refused.
const ENGAGE_NS: u64 = 2_000_000_000;
/// The robot may hold for this long altogether before the performance is given up.
const HELD_NS: u64 = 30_000_000_000;
/// Rest at the last pose that counts in the score.
const REST_NS: u64 = 500_000_000;

/// How it ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// At the last pose.
    Played,
    /// Not there, and why.
    Failed(String),
}

/// Where it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    OnTheWay { since_ns: Option<u64>, requested_ns: Option<u64> },
    Playing { number: u64, since_ns: u64, engaged_at_ns: Option<u64> },
    Over,
}

/// One trajectory's way through the robot.
#[derive(Debug)]
pub struct Performance {
    mode: Mode,
    trajectory: Trajectory,
    duration_ns: u64,
    source: u64,
    ids: Ids,
    request: (u64, Mode),
    stage: Stage,
}

impl Performance {
    /// Of a file, by the station that sends as `source`.
    pub fn new(file: &TrajectoryFile, source: u64) -> Self {
        Self {
            mode: file.mode,
            trajectory: file.trajectory.clone(),
            duration_ns: (1e9 * file.duration_s()) as u64,
            source,
            ids: Ids::new(),
            request: (0, Mode::Unspecified),
            stage: Stage::OnTheWay { since_ns: None, requested_ns: None },
        }
    }

    /// Whether the robot plays it in this state.
    pub fn is_playing(&self, robot: &RobotState) -> bool {
        matches!(self.stage, Stage::Playing { number, .. } if self.is_ours(robot, number))
    }

    fn is_ours(&self, robot: &RobotState, number: u64) -> bool {
        robot.command_source == self.source && robot.engagement == number
    }

    /// What to send now; `robot` is none while it is silent.
    pub fn step(&mut self, now_ns: u64, robot: Option<&RobotState>) -> (OperatorCommand, Option<End>) {
        let end = match self.stage {
            Stage::OnTheWay { since_ns, requested_ns } => {
                self.go(now_ns, robot, since_ns.unwrap_or(now_ns), requested_ns)
            }
            Stage::Playing { number, since_ns, engaged_at_ns } => {
                self.watch(now_ns, robot, number, since_ns, engaged_at_ns)
            }
            Stage::Over => None,
        };
        let mut command = self.holding();
        if let (Stage::Playing { number, .. }, None) = (self.stage, &end) {
            command.engagement = number;
            command.device = Device::Trajectory.into();
            command.trajectory = Some(self.trajectory.clone());
        }
        (command, end)
    }

    /// Lets go for good.
    pub fn release(&mut self) -> OperatorCommand {
        self.stage = Stage::Over;
        self.holding()
    }

    fn holding(&self) -> OperatorCommand {
        let (mode_request_id, mode) = self.request;
        OperatorCommand { mode_request_id, mode: mode.into(), ..OperatorCommand::default() }
    }

    /// Brings the robot into the mode, then engages.
    fn go(
        &mut self,
        now_ns: u64,
        robot: Option<&RobotState>,
        since_ns: u64,
        mut requested_ns: Option<u64>,
    ) -> Option<End> {
        self.stage = Stage::OnTheWay { since_ns: Some(since_ns), requested_ns };
        if now_ns.saturating_sub(since_ns) > ON_THE_WAY_NS {
            let reason = match robot {
                None => "no robot answers; is `locoman-robot run` on, and --connect its address?".to_owned(),
                Some(robot) => format!(
                    "the robot has not reached {} in 60 s: {} {} {}",
                    self.mode.as_str_name(),
                    robot.phase,
                    robot.refusal,
                    robot.reasons.join(", ")
                ),
            };
            return Some(End::Failed(reason));
        }
        let robot = robot.filter(|robot| robot.mode() == robot.goal())?;
        if robot.severity() > Severity::Disengage {
            return None;
        }
        if robot.mode() == self.mode {
            // The robot must have heard us before: it takes up no engagement that is older than it knows us.
            if robot.command_source == self.source && robot.severity() < Severity::Hold {
                let number = self.ids.next_id();
                self.stage = Stage::Playing { number, since_ns: now_ns, engaged_at_ns: None };
            }
            return None;
        }
        if requested_ns.is_none_or(|at_ns| now_ns.saturating_sub(at_ns) > RETRY_NS) {
            // From lying down, a gripper is reached by way of standing.
            let next = if robot.mode() == Mode::Damped { Mode::Stance } else { self.mode };
            if self.request.1 != next {
                requested_ns = None;
            }
            if requested_ns.is_none_or(|at_ns| now_ns.saturating_sub(at_ns) > RETRY_NS) {
                self.request = (self.ids.next_id(), next);
                requested_ns = Some(now_ns);
            }
        }
        self.stage = Stage::OnTheWay { since_ns: Some(since_ns), requested_ns };
        None
    }

    /// Sees it through.
    fn watch(
        &mut self,
        now_ns: u64,
        robot: Option<&RobotState>,
        number: u64,
        since_ns: u64,
        engaged_at_ns: Option<u64>,
    ) -> Option<End> {
        let sampled_ns = |robot: &RobotState| robot.header.as_ref().map_or(0, |header| header.capture_ns);
        match (robot, engaged_at_ns) {
            (Some(robot), None) if self.is_ours(robot, number) => {
                self.stage =
                    Stage::Playing { number, since_ns: now_ns, engaged_at_ns: Some(sampled_ns(robot)) };
                None
            }
            (Some(robot), Some(at_ns)) if self.is_ours(robot, number) => {
                let played_ns = sampled_ns(robot).saturating_sub(at_ns);
                (played_ns >= self.duration_ns + REST_NS).then_some(End::Played)
            }
            // It holds: the trajectory stands still and goes on by itself, if the cause goes away.
            (Some(robot), Some(_)) if robot.severity() == Severity::Hold => self.patience(now_ns, since_ns),
            (Some(robot), Some(_)) => {
                let reasons = robot.reasons.join(", ");
                Some(End::Failed(format!("the robot has ended the engagement: {} {reasons}", robot.phase)))
            }
            (None, Some(_)) => self.patience(now_ns, since_ns),
            (_, None) if now_ns.saturating_sub(since_ns) > ENGAGE_NS => {
                let reasons = robot.map_or("it is silent".to_owned(), |robot| robot.reasons.join(", "));
                Some(End::Failed(format!("the robot does not engage: {reasons}")))
            }
            (_, None) => None,
        }
    }

    fn patience(&self, now_ns: u64, since_ns: u64) -> Option<End> {
        let limit_ns = self.duration_ns + HELD_NS;
        (now_ns.saturating_sub(since_ns) > limit_ns)
            .then(|| End::Failed("the robot has held for more than 30 s".into()))
    }
}

#[cfg(test)]
mod tests {
    use locoman_protocol::messages::Header;

    use super::*;

    const MS: u64 = 1_000_000;
    const US: u64 = 7;

    fn sut() -> Performance {
        let text = "mode = \"right_gripper\"\n[[pose]]\ntime_s = 1.0\nlimb = { xyz = [0.05, 0.0, 0.0] }\n";
        Performance::new(&TrajectoryFile::parse(text).unwrap(), US)
    }

    fn robot(mode: Mode, goal: Mode, engagement: u64, at_ns: u64) -> RobotState {
        RobotState {
            header: Some(Header { source: 2, sequence: 1, capture_ns: at_ns, send_ns: at_ns }),
            mode: mode.into(),
            goal: goal.into(),
            engagement,
            command_source: US,
            ..RobotState::default()
        }
    }

    #[test]
    fn a_lying_robot_stands_up_goes_to_the_mode_plays_and_is_let_go() {
        let mut sut = sut();
        let (command, _) = sut.step(MS, Some(&robot(Mode::Damped, Mode::Damped, 0, 0)));
        assert_eq!((command.mode(), command.engagement), (Mode::Stance, 0));
        let (command, _) = sut.step(2 * MS, Some(&robot(Mode::Damped, Mode::Stance, 0, 0)));
        assert_eq!(command.mode(), Mode::Stance);
        let (command, _) = sut.step(4_000 * MS, Some(&robot(Mode::Stance, Mode::Stance, 0, 0)));
        assert_eq!((command.mode(), command.engagement), (Mode::RightGripper, 0));
        let there = |engagement, at_ns| robot(Mode::RightGripper, Mode::RightGripper, engagement, at_ns);
        let (command, _) = sut.step(9_000 * MS, Some(&there(0, 0)));
        let number = command.engagement;
        assert!(number != 0 && command.trajectory.is_some() && command.device() == Device::Trajectory);
        assert!(sut.is_playing(&there(number, 0)) && !sut.is_playing(&there(0, 0)));
        for ms in [9_010, 9_800, 10_400] {
            let (command, end) = sut.step(ms * MS, Some(&there(number, ms * MS)));
            assert_eq!((command.engagement, end), (number, None), "{ms}");
        }
        let (command, end) = sut.step(10_520 * MS, Some(&there(number, 10_520 * MS)));
        assert_eq!((command.engagement, command.trajectory, end), (0, None, Some(End::Played)));
        assert_eq!(sut.release().engagement, 0);
    }

    #[test]
    fn a_hold_is_waited_for_and_a_lost_engagement_is_the_end() {
        let mut sut = sut();
        let there = |engagement, severity: Severity| RobotState {
            severity: severity.into(),
            ..robot(Mode::RightGripper, Mode::RightGripper, engagement, MS)
        };
        let number = sut.step(MS, Some(&there(0, Severity::None))).0.engagement;
        assert_eq!(sut.step(2 * MS, Some(&there(number, Severity::None))).1, None);
        let (command, end) = sut.step(3 * MS, Some(&there(0, Severity::Hold)));
        assert_eq!((command.engagement, end), (number, None));
        assert_eq!(sut.step(4 * MS, None).1, None);
        assert!(matches!(sut.step(5 * MS, Some(&there(0, Severity::Disengage))).1, Some(End::Failed(_))));
    }

    #[test]
    fn nobody_there_is_an_error_with_a_remedy() {
        let mut sut = sut();
        assert_eq!(sut.step(0, None).1, None);
        let Some(End::Failed(reason)) = sut.step(61_000 * MS, None).1 else { panic!("no end") };
        assert!(reason.contains("--connect"), "{reason}");
    }
}
