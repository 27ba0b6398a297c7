//! How well the robot follows its operator, judged by the simulator's truth.
//!
//! While an engagement lasts, the operator's displacement `(d, R)` since engagement acts on the robot's own
//! target at the beginning, its anchor `(p_a, R_a)`: what was commanded is `(p_a + d, R R_a)` in the robot's
//! world. If an engagement resumes after a change of modes, the displacement counts from then. The robot's
//! world is tied to the simulator's at the first state after the estimator's reset,
//! `sim_from_world = sim_from_torso torso_from_world`: from there on, whatever the estimator loses shows up.
//!
//! One delay, the same for everything, is taken out: the one at which the gripper's mean error is smallest.

use std::collections::HashMap;

use locoman_protocol::messages::{Mode, OperatorCommand, Pose, RobotState, SimTruth};
use nalgebra::Isometry3;

use super::session::{Session, capture_ns, isometry, send_ns};
use super::track::Track;

/// The delays that are tried.
const MAX_DELAY_NS: u64 = 500_000_000;
const DELAY_STEP_NS: u64 = 2_000_000;

/// A body that follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Body {
    /// The torso, in every mode.
    Torso,
    /// The right gripper, in its own mode.
    RightGripper,
    /// The left gripper, in its own mode.
    LeftGripper,
    /// The right front foot, in its own mode.
    RightFoot,
    /// The left front foot, in its own mode.
    LeftFoot,
}

impl Body {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Torso, Self::RightGripper, Self::LeftGripper, Self::RightFoot, Self::LeftFoot];

    fn displacement(self, command: &OperatorCommand) -> &Option<Pose> {
        match self {
            Self::Torso => &command.torso,
            Self::RightGripper | Self::RightFoot => &command.right_palm,
            Self::LeftGripper | Self::LeftFoot => &command.left_palm,
        }
    }

    fn target(self, state: &RobotState) -> &Option<Pose> {
        match self {
            Self::Torso => &state.torso_target,
            Self::RightGripper => &state.right_gripper_target,
            Self::LeftGripper => &state.left_gripper_target,
            Self::RightFoot => &state.right_foot_target,
            Self::LeftFoot => &state.left_foot_target,
        }
    }

    fn estimate(self, state: &RobotState) -> &Option<Pose> {
        match self {
            Self::Torso => &state.torso,
            Self::RightGripper => &state.right_gripper,
            Self::LeftGripper => &state.left_gripper,
            Self::RightFoot => &state.right_foot,
            Self::LeftFoot => &state.left_foot,
        }
    }

    fn truth(self, truth: &SimTruth) -> &Option<Pose> {
        match self {
            Self::Torso => &truth.torso,
            Self::RightGripper => &truth.right_gripper,
            Self::LeftGripper => &truth.left_gripper,
            Self::RightFoot => &truth.right_foot,
            Self::LeftFoot => &truth.left_foot,
        }
    }

    fn moves_in(self, mode: Mode) -> bool {
        match self {
            Self::Torso => !matches!(mode, Mode::Unspecified | Mode::Damped | Mode::LieDown),
            Self::RightGripper => mode == Mode::RightGripper,
            Self::LeftGripper => mode == Mode::LeftGripper,
            Self::RightFoot => mode == Mode::RightFoot,
            Self::LeftFoot => mode == Mode::LeftFoot,
        }
    }
}

/// Where a body should be at an instant, in the simulator's world.
#[derive(Debug, Clone, Copy)]
struct Expected {
    body: Body,
    time_ns: u64,
    /// Nothing is compared after this: the robot has let go.
    until_ns: u64,
    pose: Isometry3<f64>,
}

/// Distance and angle between two poses of one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Error {
    /// m.
    pub position: f64,
    /// rad.
    pub rotation: f64,
}

/// Errors of one body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Errors {
    /// Distances, m.
    pub position: Vec<f64>,
    /// Angles, rad.
    pub rotation: Vec<f64>,
}

/// What came out.
#[derive(Debug, Clone, Default)]
pub struct Following {
    /// The delay that was taken out, s.
    pub delay_s: f64,
    /// Command against truth, delay taken out: torso, grippers (both as one), feet (both as one; of their angles
    /// nothing is known).
    pub commanded: [Errors; 3],
    /// The robot's smoothed target against the truth of the same instant.
    pub target: [Errors; 3],
    /// The robot's own estimate against the truth of the same instant.
    pub estimate: [Errors; 3],
    /// Time during which somebody moved the robot, s.
    pub engaged_s: f64,
}

/// A stretch of time in which one engagement moves the robot in one mode and one world.
struct Segment<'a> {
    mode: Mode,
    begin_ns: u64,
    end_ns: u64,
    sim_from_world: Isometry3<f64>,
    /// The state that holds the anchors.
    anchor: &'a RobotState,
    first: &'a RobotState,
    resumed: bool,
}

/// Judges a session.
pub fn judge(session: &Session) -> Following {
    let truths = Body::ALL.map(|body| session.truth(|truth| body.truth(truth)));
    let worlds = worlds(session, &truths[0]);
    let segments = segments(session, &worlds);
    let expected: Vec<Expected> =
        segments.iter().flat_map(|segment| expectations(session, segment)).collect();
    let delay_ns = best_delay(&expected, &truths);

    let mut following = Following { delay_s: delay_ns as f64 * 1e-9, ..Following::default() };
    for wanted in &expected {
        if let Some(error) = error_after(wanted, &truths, delay_ns) {
            following.commanded[group(wanted.body)].push(error);
        }
    }
    for segment in &segments {
        following.engaged_s += (segment.end_ns - segment.begin_ns) as f64 * 1e-9;
        for state in &session.states {
            let time_ns = capture_ns(&state.header);
            if !(segment.begin_ns..=segment.end_ns).contains(&time_ns) {
                continue;
            }
            for body in Body::ALL.into_iter().filter(|body| body.moves_in(segment.mode)) {
                let Some(truth) = truths[body as usize].at(time_ns) else { continue };
                let against =
                    |pose: &Option<Pose>| Some(between(&(segment.sim_from_world * isometry(pose)?), &truth));
                if let Some(error) = against(body.target(state)) {
                    following.target[group(body)].push(error);
                }
                if let Some(error) = against(body.estimate(state)) {
                    following.estimate[group(body)].push(error);
                }
            }
        }
    }
    following
}

/// Index in arrays of torso, grippers and feet.
fn group(body: Body) -> usize {
    match body {
        Body::Torso => 0,
        Body::RightGripper | Body::LeftGripper => 1,
        Body::RightFoot | Body::LeftFoot => 2,
    }
}

impl Errors {
    fn push(&mut self, error: Error) {
        self.position.push(error.position);
        self.rotation.push(error.rotation);
    }
}

fn between(a: &Isometry3<f64>, b: &Isometry3<f64>) -> Error {
    Error {
        position: (a.translation.vector - b.translation.vector).norm(),
        rotation: a.rotation.angle_to(&b.rotation),
    }
}

/// The simulator's pose of each of the robot's worlds, by the count of resets.
fn worlds(session: &Session, torso: &Track) -> HashMap<u64, Isometry3<f64>> {
    let mut worlds = HashMap::new();
    for state in &session.states {
        if worlds.contains_key(&state.world_resets) {
            continue;
        }
        let sim_from_torso = torso.at(capture_ns(&state.header));
        if let (Some(sim_from_torso), Some(world_from_torso)) = (sim_from_torso, isometry(&state.torso)) {
            worlds.insert(state.world_resets, sim_from_torso * world_from_torso.inverse());
        }
    }
    worlds
}

fn segments<'a>(session: &'a Session, worlds: &HashMap<u64, Isometry3<f64>>) -> Vec<Segment<'a>> {
    let key = |state: &RobotState| (state.command_source, state.engagement, state.mode, state.world_resets);
    let mut segments: Vec<Segment<'a>> = Vec::new();
    let mut begun = std::collections::HashSet::new();
    let mut before: Option<&RobotState> = None;
    for run in session.states.chunk_by(|a, b| key(a) == key(b) && (a.mode == a.goal) == (b.mode == b.goal)) {
        let [first, .., last] = run else {
            before = run.first();
            continue;
        };
        let previous = before.replace(last);
        if first.engagement == 0 || first.mode != first.goal {
            continue;
        }
        let Some(&sim_from_world) = worlds.get(&first.world_resets) else { continue };
        // While it was held, the target was the anchor itself; a moment after it has moved by next to nothing.
        let held = previous.filter(|state| {
            state.engagement == 0
                && state.mode == first.mode
                && state.goal == state.mode
                && state.world_resets == first.world_resets
        });
        segments.push(Segment {
            mode: first.mode(),
            begin_ns: capture_ns(&first.header),
            end_ns: capture_ns(&last.header),
            sim_from_world,
            anchor: held.unwrap_or(first),
            first,
            resumed: !begun.insert((first.command_source, first.engagement)),
        });
    }
    segments
}

/// What the commands of a segment ask for, one for each instant at which the operator was seen.
fn expectations(session: &Session, segment: &Segment<'_>) -> Vec<Expected> {
    let source = segment.first.command_source;
    let of_segment = |command: &&OperatorCommand| {
        let header = command.header.as_ref();
        header.is_some_and(|header| header.source == source) && command.engagement == segment.first.engagement
    };
    let mut expected = Vec::new();
    for body in Body::ALL.into_iter().filter(|body| body.moves_in(segment.mode)) {
        let Some(anchor) = isometry(body.target(segment.anchor)) else { continue };
        let origin = origin(session, segment, body);
        let mut last_ns = 0;
        for command in session.commands.iter().filter(of_segment) {
            let Some(displacement) = isometry(body.displacement(command)) else { continue };
            // A command that repeats an older observation says nothing new about the operator.
            let time_ns = match capture_ns(&command.header) {
                0 => send_ns(&command.header),
                seen_ns => seen_ns,
            };
            if time_ns <= last_ns || send_ns(&command.header) < segment.begin_ns {
                continue;
            }
            last_ns = time_ns;
            let pose = Isometry3::from_parts(
                (anchor.translation.vector + displacement.translation.vector - origin.translation.vector)
                    .into(),
                displacement.rotation * origin.rotation.inverse() * anchor.rotation,
            );
            expected.push(Expected {
                body,
                time_ns,
                until_ns: segment.end_ns,
                pose: segment.sim_from_world * pose,
            });
        }
    }
    expected
}

/// The displacement from which a segment counts: none at a new engagement, the present one at a resumed one.
fn origin(session: &Session, segment: &Segment<'_>, body: Body) -> Isometry3<f64> {
    if !segment.resumed {
        return Isometry3::identity();
    }
    let applied = session.commands.iter().find(|command| {
        let header = command.header.as_ref();
        header.is_some_and(|header| {
            header.source == segment.first.command_source && header.sequence == segment.first.command_sequence
        })
    });
    applied.and_then(|command| isometry(body.displacement(command))).unwrap_or_else(Isometry3::identity)
}

fn error_after(wanted: &Expected, truths: &[Track; Body::ALL.len()], delay_ns: u64) -> Option<Error> {
    let time_ns = wanted.time_ns + delay_ns;
    if time_ns > wanted.until_ns {
        return None;
    }
    Some(between(&wanted.pose, &truths[wanted.body as usize].at(time_ns)?))
}

/// The delay at which the limbs' mean position error is smallest; the torso's if no limb moved.
fn best_delay(expected: &[Expected], truths: &[Track; Body::ALL.len()]) -> u64 {
    let limb_moves = expected.iter().any(|wanted| wanted.body != Body::Torso);
    let counts = |wanted: &&Expected| (wanted.body != Body::Torso) == limb_moves;
    let mean = |delay_ns: u64| {
        let errors =
            expected.iter().filter(counts).filter_map(|wanted| error_after(wanted, truths, delay_ns));
        let (sum, count) = errors.fold((0.0, 0u32), |(sum, count), error| (sum + error.position, count + 1));
        if count == 0 { f64::INFINITY } else { sum / f64::from(count) }
    };
    let delays = (0..=MAX_DELAY_NS / DELAY_STEP_NS).map(|step| step * DELAY_STEP_NS);
    delays
        .map(|delay_ns| (delay_ns, mean(delay_ns)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(0, |(delay, _)| delay)
}
