//! From the tracker's report to what may move the robot: a shell counts while it is tracked, and for a
//! short time while it is predicted. Its pose is taken to the time at which it is used: what capture, detection and
//! sending take is not seen as delay, as long as the motion goes on.

use locoman_protocol::geometry;
use locoman_protocol::messages::{self, Verdict};
use locoman_vision::shells::ShellSet;
use locoman_vision::track::{FilterSettings, Motion, Motions};
use nalgebra::Isometry3;

/// The five shells that an operator wears.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Shell {
    Torso,
    RightPalm,
    LeftPalm,
    RightThumb,
    LeftThumb,
}

impl Shell {
    /// All, in the order of arrays of five.
    pub const ALL: [Self; 5] =
        [Self::Torso, Self::RightPalm, Self::LeftPalm, Self::RightThumb, Self::LeftThumb];

    /// Its name in shells files, recordings and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Torso => "torso",
            Self::RightPalm => "right_palm",
            Self::LeftPalm => "left_palm",
            Self::RightThumb => "right_thumb",
            Self::LeftThumb => "left_thumb",
        }
    }

    /// The shell of that name; other bodies may carry tags too, and move nothing.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|shell| shell.name() == name)
    }
}

/// Where the usable shells were at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Observation {
    /// When the cameras exposed, on this machine's monotonic clock.
    pub capture_ns: u64,
    /// `world_from_shell` in the order of [`Shell::ALL`]; `None`: not usable.
    pub world_from_shell: [Option<Isometry3<f64>>; 5],
}

impl Observation {
    /// `world_from_shell` of one shell.
    pub fn shell(&self, shell: Shell) -> Option<&Isometry3<f64>> {
        self.world_from_shell[shell as usize].as_ref()
    }

    /// Whether every shell is usable.
    pub fn complete(&self) -> bool {
        self.world_from_shell.iter().all(Option::is_some)
    }
}

/// The last word of the tracker, with what is needed to take it to a later time.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracked {
    /// At the time of capture.
    pub observation: Observation,
    /// How each shell moved when it was measured last; in the order of [`Shell::ALL`].
    motions: [Option<Motion>; 5],
}

impl Tracked {
    /// `motions` is in the order of `shells`.
    pub fn new(observation: Observation, motions: &Motions, shells: &ShellSet) -> Self {
        let motion = |shell: Shell| {
            let index = shells.shells.iter().position(|known| known.name == shell.name())?;
            motions.latest().get(index)?.clone()
        };
        Self { observation, motions: Shell::ALL.map(motion) }
    }

    /// Where the usable shells are at a time, at most `ahead_max_ns` after the capture: beyond that a prediction would
    /// be more noise than knowledge, and the poses stay.
    ///
    /// The capture time stays too: it tells how old the knowledge is.
    pub fn at(&self, now_ns: u64, ahead_max_ns: u64, filter: &FilterSettings) -> Observation {
        let capture_ns = self.observation.capture_ns;
        let time_ns = now_ns.clamp(capture_ns, capture_ns.saturating_add(ahead_max_ns));
        let mut observation = self.observation;
        for (pose, motion) in observation.world_from_shell.iter_mut().zip(&self.motions) {
            if let (Some(pose), Some(motion)) = (pose, motion) {
                *pose = motion.predicted(time_ns, filter).world_from_shell;
            }
        }
        observation
    }
}

/// Remembers when each shell was last measured.
#[derive(Debug)]
pub struct Observer {
    predicted_max_ns: u64,
    measured_ns: [Option<u64>; 5],
}

impl Observer {
    /// A prediction stands in for a measurement for at most `predicted_max_ms`.
    pub fn new(predicted_max_ms: u64) -> Self {
        Self { predicted_max_ns: predicted_max_ms * 1_000_000, measured_ns: [None; 5] }
    }

    /// Judges one report of the tracker.
    pub fn observe(&mut self, tracking: &messages::Tracking) -> Observation {
        let capture_ns = tracking.header.as_ref().map_or(0, |header| header.capture_ns);
        let mut observation = Observation { capture_ns, ..Observation::default() };
        for report in &tracking.shells {
            let Some(shell) = Shell::from_name(&report.shell) else { continue };
            let index = shell as usize;
            let usable = match report.verdict() {
                Verdict::Tracked => {
                    self.measured_ns[index] = Some(capture_ns);
                    true
                }
                Verdict::Predicted => self.measured_ns[index]
                    .is_some_and(|at| capture_ns.saturating_sub(at) <= self.predicted_max_ns),
                Verdict::Lost | Verdict::Unspecified => false,
            };
            let pose = report.pose.as_ref().and_then(|pose| geometry::isometry(pose).ok());
            observation.world_from_shell[index] = pose.filter(|_| usable);
        }
        observation
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use locoman_protocol::messages::{Header, ShellPose, Tracking};
    use locoman_vision::pose::{Matrix18, State};
    use nalgebra::Vector3;

    fn report(capture_ms: u64, verdict: Verdict) -> Tracking {
        Tracking {
            header: Some(Header { capture_ns: capture_ms * 1_000_000, ..Header::default() }),
            shells: vec![ShellPose {
                shell: "right_palm".into(),
                verdict: verdict.into(),
                pose: Some(geometry::pose(&Isometry3::translation(1.0, 2.0, 3.0))),
                ..ShellPose::default()
            }],
            ..Tracking::default()
        }
    }

    #[test]
    fn a_prediction_counts_for_a_short_time_only() {
        let mut sut = Observer::new(100);
        let seen = |o: Observation| o.shell(Shell::RightPalm).is_some();
        assert!(!seen(sut.observe(&report(1000, Verdict::Predicted))), "never measured");
        assert!(seen(sut.observe(&report(1010, Verdict::Tracked))));
        assert!(seen(sut.observe(&report(1110, Verdict::Predicted))));
        assert!(!seen(sut.observe(&report(1111, Verdict::Predicted))));
        assert!(!seen(sut.observe(&report(1112, Verdict::Lost))));
        assert!(seen(sut.observe(&report(1113, Verdict::Tracked))));
    }

    #[test]
    fn a_moving_shell_is_taken_to_the_time_of_use_but_not_far() {
        let (filter, names) = (FilterSettings::default(), ["torso", "right_palm"]);
        let capture_ns = 660_000_000;
        let state = State {
            world_from_shell: Isometry3::translation(0.2, 0.0, 1.0),
            velocity_m_s: Vector3::new(0.3, 0.0, 0.0),
            ..State::still(Isometry3::identity())
        };
        let motion = Motion::begin(capture_ns, &state, &(Matrix18::identity() * 1e-8));
        let shells = ShellSet {
            family: "tag36h11".into(),
            shells: names
                .map(|name| locoman_vision::shells::Shell { name: name.into(), tags: vec![] })
                .into(),
        };
        let mut observation = Observation { capture_ns, ..Observation::default() };
        observation.world_from_shell[Shell::RightPalm as usize] = Some(motion.world_from_shell);
        let sut = Tracked::new(
            observation,
            &Motions::new(vec![None, Some(motion)], Vec::new(), 250_000_000),
            &shells,
        );
        let x = |now_ns| {
            let seen = sut.at(now_ns, 60_000_000, &filter);
            assert_eq!((seen.capture_ns, seen.shell(Shell::Torso)), (capture_ns, None));
            seen.shell(Shell::RightPalm).unwrap().translation.x
        };
        let start = x(capture_ns);
        assert!((x(capture_ns + 40_000_000) - start - 0.012).abs() < 1e-4);
        assert_eq!(x(capture_ns + 60_000_000), x(capture_ns + 400_000_000));
        assert_eq!(x(capture_ns - 1), start);
    }

    #[test]
    fn a_pose_that_is_no_pose_is_not_used() {
        let mut sut = Observer::new(100);
        let mut broken = report(1000, Verdict::Tracked);
        if let Some(orientation) = broken.shells[0].pose.as_mut().and_then(|p| p.orientation.as_mut()) {
            orientation.w = f64::NAN;
        }
        assert_eq!(sut.observe(&broken).shell(Shell::RightPalm), None);
    }
}
