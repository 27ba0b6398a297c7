//! Every message of the network from any bytes: nothing panics; the first byte says which message.

#![no_main]

use libfuzzer_sys::fuzz_target;
use locoman_protocol::messages::{
    ClockPing, ClockPong, Detections, Event, Motions, OperatorCommand, RobotState, SimTruth, Stop, Tracking,
};
use prost::Message;

/// Reads a message, and what it is written as once more.
fn survives<M: Message + Default>(bytes: &[u8]) {
    if let Ok(message) = M::decode(bytes) {
        let written = message.encode_to_vec();
        assert!(M::decode(written.as_slice()).is_ok());
    }
}

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, body)) = bytes.split_first() else { return };
    match kind % 10 {
        0 => survives::<OperatorCommand>(body),
        1 => survives::<RobotState>(body),
        2 => survives::<Detections>(body),
        3 => survives::<Motions>(body),
        4 => survives::<Tracking>(body),
        5 => survives::<SimTruth>(body),
        6 => survives::<Stop>(body),
        7 => survives::<ClockPing>(body),
        8 => survives::<ClockPong>(body),
        _ => survives::<Event>(body),
    }
});
