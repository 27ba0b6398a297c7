//! Datagrams from the Go1's line: nothing panics; a command that is taken in is one that could have been sent.

#![no_main]

use libfuzzer_sys::fuzz_target;
use locoman_robot::go1::{LowCommand, LowState};

fuzz_target!(|bytes: &[u8]| {
    let _ = LowCommand::decode(bytes);
    if let Ok((state, _)) = LowState::decode(bytes) {
        let _ = state.remote();
    }
});
