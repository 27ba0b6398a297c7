//! A session as the station recorded it.

use std::path::Path;

use locoman_protocol::messages::{Header, OperatorCommand, Pose, RobotState, SimTruth, Tracking};
use locoman_protocol::recording::{Reader, RecordingError};
use locoman_protocol::{Wire, geometry};
use nalgebra::Isometry3;

use super::track::Track;

/// The messages of a session, each kind in the order in which it was recorded.
#[derive(Debug, Clone, Default)]
pub struct Session {
    /// What the operator commanded.
    pub commands: Vec<OperatorCommand>,
    /// What the robot said.
    pub states: Vec<RobotState>,
    /// What was really going on in the simulator.
    pub truths: Vec<SimTruth>,
    /// What the tracker saw.
    pub trackings: Vec<Tracking>,
}

impl Session {
    /// Reads a recording.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let mut session = Self::default();
        for recorded in Reader::open(path)? {
            let recorded = recorded?;
            let is = |name: String| recorded.topic() == name;
            if is(OperatorCommand::TOPIC.recording_name()) {
                session.commands.push(recorded.decode()?);
            } else if is(RobotState::TOPIC.recording_name()) {
                session.states.push(recorded.decode()?);
            } else if is(SimTruth::TOPIC.recording_name()) {
                session.truths.push(recorded.decode()?);
            } else if is(Tracking::TOPIC.recording_name()) {
                session.trackings.push(recorded.decode()?);
            }
        }
        Ok(session)
    }

    /// The true pose of a body over time.
    pub fn truth(&self, body: impl Fn(&SimTruth) -> &Option<Pose>) -> Track {
        let sample = |truth: &SimTruth| Some((capture_ns(&truth.header), isometry(body(truth))?));
        Track::new(self.truths.iter().filter_map(sample).collect())
    }
}

/// When the sensor was exposed or the state sampled; 0 for none.
pub fn capture_ns(header: &Option<Header>) -> u64 {
    header.as_ref().map_or(0, |header| header.capture_ns)
}

/// When it was sent; 0 for none.
pub fn send_ns(header: &Option<Header>) -> u64 {
    header.as_ref().map_or(0, |header| header.send_ns)
}

/// A pose, if there is one and it is one.
pub fn isometry(pose: &Option<Pose>) -> Option<Isometry3<f64>> {
    geometry::isometry(pose.as_ref()?).ok()
}
