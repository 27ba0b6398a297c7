//! Every decoder is total (any bytes give a value or an error) and encoding loses nothing.

use locoman_protocol::messages::foxglove::{CameraCalibration, CompressedImage, FrameTransforms};
use locoman_protocol::messages::{
    ClockPing, ClockPong, Detections, Event, Header, Motions, OperatorCommand, Pose, Quaternion, RobotState,
    ShellPose, SimTruth, Stop, Timing, Tracking, Trajectory, Vector3, Velocity, Waypoint,
};
use locoman_protocol::{Topic, Wire, validate};
use proptest::prelude::*;
use prost::Message;
use std::collections::HashSet;

/// Decodes; what decodes must survive encoding (compared as bytes, for NaN is not equal to itself).
fn total<M: Message + Default>(bytes: &[u8]) -> Result<(), TestCaseError> {
    if let Ok(message) = M::decode(bytes) {
        let encoded = message.encode_to_vec();
        let again = M::decode(encoded.as_slice());
        prop_assert_eq!(again.map(|message| message.encode_to_vec()), Ok(encoded));
    }
    Ok(())
}

fn all_total(bytes: &[u8]) -> Result<(), TestCaseError> {
    total::<OperatorCommand>(bytes)?;
    total::<Stop>(bytes)?;
    total::<RobotState>(bytes)?;
    total::<SimTruth>(bytes)?;
    total::<Tracking>(bytes)?;
    total::<Detections>(bytes)?;
    total::<Motions>(bytes)?;
    total::<ClockPing>(bytes)?;
    total::<ClockPong>(bytes)?;
    total::<Event>(bytes)?;
    total::<CompressedImage>(bytes)?;
    total::<CameraCalibration>(bytes)?;
    total::<FrameTransforms>(bytes)
}

prop_compose! {
    fn poses()(p in prop::array::uniform3(any::<f64>()), q in prop::array::uniform4(any::<f64>())) -> Pose {
        Pose {
            position_m: Some(Vector3 { x: p[0], y: p[1], z: p[2] }),
            orientation: Some(Quaternion { w: q[0], x: q[1], y: q[2], z: q[3] }),
        }
    }
}

prop_compose! {
    fn headers()(source: u64, sequence: u64, capture_ns: u64, send_ns: u64) -> Header {
        Header { source, sequence, capture_ns, send_ns }
    }
}

prop_compose! {
    fn waypoints()(
        time_s in any::<f64>(),
        bodies in prop::array::uniform3(prop::option::of(poses())),
        right_opening in prop::option::of(any::<f64>()),
    ) -> Waypoint {
        let [torso, right_limb, left_limb] = bodies;
        Waypoint { time_s, torso, right_limb, left_limb, right_opening, left_opening: None }
    }
}

prop_compose! {
    fn commands()(
        header in prop::option::of(headers()),
        engagement: u64,
        device: i32,
        bodies in prop::array::uniform3(prop::option::of(poses())),
        openings in prop::array::uniform2(prop::option::of(any::<f64>())),
        mode_request_id: u64,
        mode: i32,
        waypoints in prop::option::of(prop::collection::vec(waypoints(), 0..4)),
        speeds in prop::option::of(prop::array::uniform3(any::<f64>())),
    ) -> OperatorCommand {
        let [torso, right_palm, left_palm] = bodies;
        let [right_opening, left_opening] = openings;
        OperatorCommand {
            header, engagement, device, torso, right_palm, left_palm, right_opening, left_opening,
            mode_request_id, mode, trajectory: waypoints.map(|waypoints| Trajectory { waypoints }),
            walk: speeds.map(|[forward_m_s, left_m_s, turn_rad_s]| Velocity { forward_m_s, left_m_s, turn_rad_s }),
        }
    }
}

prop_compose! {
    fn states()(
        header in prop::option::of(headers()),
        torso in prop::option::of(poses()),
        phase in ".{0,20}",
        reasons in prop::collection::vec(".{0,20}", 0..3),
        joint_position_rad in prop::collection::vec(any::<f64>(), 0..20),
        p99_ns: u64,
        engagement: u64,
    ) -> RobotState {
        let period = Some(Timing { p99_ns, ..Timing::default() });
        RobotState { header, torso, phase, reasons, joint_position_rad, period, engagement, ..RobotState::default() }
    }
}

prop_compose! {
    fn trackings()(
        header in prop::option::of(headers()),
        shell in ".{0,12}",
        pose in prop::option::of(poses()),
        covariance in prop::collection::vec(any::<f64>(), 0..36),
    ) -> Tracking {
        let shells = vec![ShellPose { shell, pose, covariance, ..ShellPose::default() }];
        Tracking { header, shells, ..Tracking::default() }
    }
}

proptest! {
    #[test]
    fn any_bytes_decode_or_fail(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        all_total(&bytes)?;
    }

    #[test]
    fn damaged_messages_decode_or_fail(
        command in commands(),
        state in states(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        cut in any::<prop::sample::Index>(),
    ) {
        for mut bytes in [command.encode_to_vec(), state.encode_to_vec()] {
            // Not empty, so that there is something to change.
            bytes.push(0);
            for &(place, value) in &changes {
                let place = place.index(bytes.len());
                bytes[place] = value;
            }
            bytes.truncate(cut.index(bytes.len()));
            all_total(&bytes)?;
            if let Ok(command) = OperatorCommand::decode(bytes.as_slice()) {
                let _ = validate(&command);
            }
        }
    }

    #[test]
    fn messages_survive_the_round_trip(command in commands(), state in states(), tracking in trackings()) {
        prop_assert_eq!(OperatorCommand::decode(command.encode_to_vec().as_slice()), Ok(command));
        prop_assert_eq!(RobotState::decode(state.encode_to_vec().as_slice()), Ok(state));
        prop_assert_eq!(Tracking::decode(tracking.encode_to_vec().as_slice()), Ok(tracking));
    }

    #[test]
    fn fields_of_a_newer_sender_are_skipped(command in commands(), value: u32) {
        let mut bytes = command.encode_to_vec();
        // Field 1000, varint.
        prost::encoding::uint32::encode(1000, &value, &mut bytes);
        prop_assert_eq!(OperatorCommand::decode(bytes.as_slice()), Ok(command));
    }

    #[test]
    fn any_command_is_judged(command in commands()) {
        let _ = validate(&command);
    }
}

#[test]
fn no_two_messages_share_a_key() {
    let topics: [Topic; 10] = [
        OperatorCommand::TOPIC,
        Stop::TOPIC,
        RobotState::TOPIC,
        SimTruth::TOPIC,
        Tracking::TOPIC,
        Detections::TOPIC,
        Motions::TOPIC,
        ClockPing::TOPIC,
        ClockPong::TOPIC,
        Event::TOPIC,
    ];
    let suffixes: HashSet<_> = topics.iter().map(|topic| topic.suffix).collect();
    assert_eq!(suffixes.len(), topics.len());
}
