//! Engaging without a person: for replays, which have no hand on a dead-man.
//!
//! A pure function of time, robot and tracker: stand up if need be, ask for the mode once the robot stands
//! and the operator is seen, engage when the mode has arrived. A person who takes over in any way switches
//! it off; only a person switches it on again.

use locoman_protocol::messages::{Mode, Severity};

use crate::observe::{Observation, Shell};
use crate::robot_view::RobotView;

/// The operator must have been seen for this long.
const SEEN_NS: u64 = 500_000_000;
/// A request that led nowhere is repeated after this.
const RETRY_NS: u64 = 3_000_000_000;
/// After a disengagement by the robot, the pause before the next attempt.
const PAUSE_NS: u64 = 1_000_000_000;

/// What to do now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Nothing yet.
    Wait,
    /// Ask the robot for a mode.
    Request(Mode),
    /// Engage, or stay engaged.
    Engage,
}

/// Brings the robot into a mode and engages.
#[derive(Debug)]
pub struct Auto {
    mode: Mode,
    enabled: bool,
    seen_since_ns: Option<u64>,
    requested_ns: Option<u64>,
    not_before_ns: u64,
}

impl Auto {
    /// Enabled, heading for `mode`.
    pub fn new(mode: Mode) -> Self {
        Self { mode, enabled: true, seen_since_ns: None, requested_ns: None, not_before_ns: 0 }
    }

    /// Whether it acts.
    pub fn enabled(&self) -> bool {
        self.enabled
    }

    /// A person took over (`false`) or gave it back (`true`).
    pub fn enable(&mut self, enabled: bool) {
        self.enabled = enabled;
        self.requested_ns = None;
    }

    /// The robot ended the engagement: pause before the next.
    pub fn disengaged(&mut self, now_ns: u64) {
        self.not_before_ns = now_ns + PAUSE_NS;
    }

    /// One step. `robot` is `None` while it is silent; once `engaged`, shells out of sight do not end it.
    pub fn step(
        &mut self,
        now_ns: u64,
        robot: Option<&RobotView>,
        seen: Option<&Observation>,
        engaged: bool,
    ) -> Step {
        let seen_for_ns = self.seen_for_ns(now_ns, seen);
        let Some(robot) = robot else {
            self.requested_ns = None;
            return Step::Wait;
        };
        if !self.enabled || now_ns < self.not_before_ns || robot.severity > Severity::Disengage {
            return Step::Wait;
        }
        if robot.in_mode(self.mode) {
            return if engaged || seen_for_ns.is_some() { Step::Engage } else { Step::Wait };
        }
        if robot.mode != robot.goal {
            return Step::Wait;
        }
        match robot.mode {
            Mode::Stance if seen_for_ns.is_some_and(|ns| ns >= SEEN_NS) => self.request(now_ns, self.mode),
            Mode::Stance => Step::Wait,
            _ => self.request(now_ns, Mode::Stance),
        }
    }

    fn request(&mut self, now_ns: u64, mode: Mode) -> Step {
        if self.requested_ns.is_some_and(|at| now_ns < at + RETRY_NS) {
            return Step::Wait;
        }
        self.requested_ns = Some(now_ns);
        Step::Request(mode)
    }

    /// For how long torso and palms have been seen without a break.
    fn seen_for_ns(&mut self, now_ns: u64, seen: Option<&Observation>) -> Option<u64> {
        let all = seen.is_some_and(|seen| {
            [Shell::Torso, Shell::RightPalm, Shell::LeftPalm].iter().all(|&shell| seen.shell(shell).is_some())
        });
        self.seen_since_ns = all.then(|| self.seen_since_ns.unwrap_or(now_ns));
        self.seen_since_ns.map(|since| now_ns.saturating_sub(since))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;

    const MS: u64 = 1_000_000;

    fn robot(mode: Mode, goal: Mode) -> RobotView {
        RobotView { received_ns: 0, source: 1, mode, goal, severity: Severity::None, openings: [0.0; 2] }
    }

    fn seen() -> Observation {
        Observation { capture_ns: 1, world_from_shell: [Some(Isometry3::identity()); 5] }
    }

    #[test]
    fn the_story_of_a_replay() {
        let mut sut = Auto::new(Mode::RightGripper);
        assert_eq!(sut.step(0, None, Some(&seen()), false), Step::Wait, "no robot yet");
        let lying = robot(Mode::Damped, Mode::Damped);
        assert_eq!(sut.step(100 * MS, Some(&lying), None, false), Step::Request(Mode::Stance));
        assert_eq!(sut.step(200 * MS, Some(&lying), None, false), Step::Wait, "asked already");
        let rising = robot(Mode::Damped, Mode::Stance);
        assert_eq!(sut.step(5000 * MS, Some(&rising), None, false), Step::Wait);
        let standing = robot(Mode::Stance, Mode::Stance);
        assert_eq!(sut.step(6000 * MS, Some(&standing), None, false), Step::Wait, "nobody seen");
        assert_eq!(
            sut.step(6100 * MS, Some(&standing), Some(&seen()), false),
            Step::Wait,
            "seen too briefly"
        );
        assert_eq!(
            sut.step(6600 * MS, Some(&standing), Some(&seen()), false),
            Step::Request(Mode::RightGripper)
        );
        let lifting = robot(Mode::Stance, Mode::RightGripper);
        assert_eq!(sut.step(7000 * MS, Some(&lifting), Some(&seen()), false), Step::Wait);
        let ready = robot(Mode::RightGripper, Mode::RightGripper);
        assert_eq!(sut.step(9000 * MS, Some(&ready), Some(&seen()), false), Step::Engage);
        sut.enable(false);
        assert_eq!(sut.step(9100 * MS, Some(&ready), Some(&seen()), false), Step::Wait, "a person took over");
        sut.enable(true);
        assert_eq!(sut.step(9200 * MS, Some(&ready), Some(&seen()), false), Step::Engage);
        sut.disengaged(9300 * MS);
        assert_eq!(sut.step(9400 * MS, Some(&ready), Some(&seen()), false), Step::Wait, "the robot let go");
        assert_eq!(sut.step(10_400 * MS, Some(&ready), Some(&seen()), false), Step::Engage);
    }

    #[test]
    fn a_refused_request_is_repeated_but_not_hammered() {
        let mut sut = Auto::new(Mode::LeftGripper);
        let standing = robot(Mode::Stance, Mode::Stance);
        let mut requests = 0;
        for ms in (0..10_000).step_by(16) {
            if sut.step(ms * MS, Some(&standing), Some(&seen()), false) == Step::Request(Mode::LeftGripper) {
                requests += 1;
            }
        }
        assert_eq!(requests, 4);
    }
}
