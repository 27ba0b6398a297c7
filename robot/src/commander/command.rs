//! An operator's command as the control loop takes it: checked, of fixed size, without allocation.

use locoman_protocol::{
    geometry::isometry,
    messages::{self, OperatorCommand},
};
use nalgebra::{Isometry3, Vector2};

use crate::{locomotion::Velocity, modes::Mode, trajectory::Trajectory};

/// One uninterrupted engagement of one sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EngagementId {
    /// The sending process.
    pub source: u64,
    /// Its number; never 0.
    pub number: u64,
}

/// One request for a mode, by its sender and number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RequestId {
    /// The sending process.
    pub source: u64,
    /// Its number.
    pub number: u64,
}

/// What the operator wants now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// The sending process.
    pub source: u64,
    /// Counts the source's commands.
    pub sequence: u64,
    /// When the operator moved so, on the sender's clock.
    pub capture_ns: u64,
    /// When it arrived, on ours.
    pub received_ns: u64,
    /// 0: hold.
    pub engagement: u64,
    /// Displacement of the torso since engagement.
    pub torso: Option<Isometry3<f64>>,
    /// Displacements of the palms right, left since engagement.
    pub palms: [Option<Isometry3<f64>>; 2],
    /// Openings of the grippers right, left.
    pub opening: [Option<f64>; 2],
    /// Number of the latest request for a mode; 0 for none.
    pub mode_request: u64,
    /// The mode of that request.
    pub mode: Option<Mode>,
    /// How to walk; without it the torso's displacement says so.
    pub walk: Option<Velocity>,
    /// What the engagement plays from its beginning, in place of the displacements.
    pub trajectory: Option<Trajectory>,
}

impl Command {
    /// Of a sender that asks for nothing.
    pub const fn idle(source: u64) -> Self {
        Self {
            source,
            sequence: 0,
            capture_ns: 0,
            received_ns: 0,
            engagement: 0,
            torso: None,
            palms: [None; 2],
            opening: [None; 2],
            mode_request: 0,
            mode: None,
            walk: None,
            trajectory: None,
        }
    }

    /// From a message that [`locoman_protocol::validate()`] accepted. Poses that are none count as absent.
    pub fn from_message(message: &OperatorCommand, received_ns: u64) -> Self {
        let pose = |pose: &Option<messages::Pose>| pose.as_ref().and_then(|pose| isometry(pose).ok());
        let header = message.header.unwrap_or_default();
        Self {
            source: header.source,
            sequence: header.sequence,
            capture_ns: header.capture_ns,
            received_ns,
            engagement: message.engagement,
            torso: pose(&message.torso),
            palms: [pose(&message.right_palm), pose(&message.left_palm)],
            opening: [message.right_opening, message.left_opening],
            mode_request: message.mode_request_id,
            mode: Mode::from_message(message.mode()),
            walk: message.walk.map(|walk| Velocity {
                linear: Vector2::new(walk.forward_m_s, walk.left_m_s),
                turn: walk.turn_rad_s,
            }),
            trajectory: message.trajectory.as_ref().and_then(Trajectory::from_message),
        }
    }

    /// Names the engagement, if there is one.
    pub fn engagement_id(&self) -> Option<EngagementId> {
        (self.engagement != 0).then_some(EngagementId { source: self.source, number: self.engagement })
    }
}
