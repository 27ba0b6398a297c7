//! Bytes from the servos' line, cut anywhere: nothing panics, and what is found as a packet is one.

#![no_main]

use libfuzzer_sys::fuzz_target;
use locoman_robot::servo::wire::{
    BROADCAST, MAX_PACKET_BYTES, Packet, Request, Scanner, Status, fast, packet::STATUS,
};

fuzz_target!(|bytes: &[u8]| {
    let mut scanner = Scanner::default();
    let cut = bytes.first().map_or(0, |first| usize::from(*first) % bytes.len());
    let mut packets = Vec::new();
    for piece in [&bytes[..cut], &bytes[cut..]] {
        scanner.push(piece);
        packets.extend(std::iter::from_fn(|| scanner.next_packet()));
    }
    for packet in packets {
        let _ = (Request::of_packet(&packet), Status::of_packet(&packet));
        // The answer to a fast read is the one packet that is read without stuffing; what came unstuffed may become too
        // long when it is written as it should be.
        let fast_answer = packet.id == BROADCAST && packet.instruction == STATUS;
        let written = packet.to_bytes();
        assert!(fast_answer || written.len() > MAX_PACKET_BYTES || Packet::read(&written) == Ok(packet));
    }
    for length in [1, 4, 10] {
        let _ = fast::read(bytes, length);
    }
});
