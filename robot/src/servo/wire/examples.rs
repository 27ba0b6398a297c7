//! The manual's example packets, byte for byte: what it prints is what is written and read here.
//!
//! Sources: "DYNAMIXEL Protocol 2.0" of the maker's manual (instruction and status packets, fast sync read);
//! DynamixelSDK 2ded684d for the two with stuffing; those of eight servos were made with the SDK too.

use super::{
    HEADER, Instruction, Refusal, Request, Status, fast,
    instruction::{self, Span},
    packet::Packet,
    timing,
};

fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

fn written(write: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = Vec::new();
    write(&mut out);
    out
}

/// What is written, what the manual prints, and what a servo reads from it.
fn requests() -> Vec<(Vec<u8>, &'static str, Request)> {
    let write_now = |address, data: &[u8]| Request::Write { address, data: data.to_vec(), registered: false };
    let writes = |address, data: &[u8]| {
        (
            written(|out| instruction::write_registers(1, Instruction::Write, address, data, out)),
            write_now(address, data),
        )
    };
    let sync_read = |kind, span, ids: &[u8]| {
        (
            written(|out| instruction::sync_read(kind, span, ids, out)),
            Request::SyncRead { span, ids: ids.to_vec(), fast: kind == Instruction::FastSyncRead },
        )
    };
    let all = [1, 2, 3, 4, 5, 6, 7, 8];
    let goals = |data: &[(u8, [u8; 4])]| {
        let span = Span::new(116, 4);
        let read = data.iter().map(|(id, bytes)| (*id, bytes.to_vec())).collect();
        (written(|out| instruction::sync_write(116, data, out)), Request::SyncWrite { span, data: read })
    };
    let plain = |kind| written(|out| instruction::plain(1, kind, out));
    let with = |(bytes, request): (Vec<u8>, Request), printed| (bytes, printed, request);
    let stuffed = [(1, [0xFF, 0xFF, 0xFD, 0xFF]), (2, [0xFF, 0xFF, 0xFD, 0x00])];
    vec![
        (plain(Instruction::Ping), "FF FF FD 00 01 03 00 01 19 4E", Request::Ping),
        (plain(Instruction::Reboot), "FF FF FD 00 01 03 00 08 2F 4E", Request::Reboot),
        (
            written(|out| instruction::read(1, Span::new(132, 4), out)),
            "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15",
            Request::Read(Span::new(132, 4)),
        ),
        with(writes(116, &[0, 2, 0, 0]), "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89"),
        with(writes(64, &[1]), "FF FF FD 00 01 06 00 03 40 00 01 DB 66"),
        with(writes(64, &[0]), "FF FF FD 00 01 06 00 03 40 00 00 DE E6"),
        with(writes(11, &[5]), "FF FF FD 00 01 06 00 03 0B 00 05 5C E3"),
        with(writes(98, &[10]), "FF FF FD 00 01 06 00 03 62 00 0A 4A E4"),
        with(writes(116, &[0xFF, 0xFF, 0xFD, 0]), "FF FF FD 00 01 0A 00 03 74 00 FF FF FD FD 00 21 E7"),
        with(
            sync_read(Instruction::SyncRead, Span::new(132, 4), &[1, 2]),
            "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA",
        ),
        with(
            sync_read(Instruction::SyncRead, Span::new(126, 10), &all),
            "FF FF FD 00 FE 0F 00 82 7E 00 0A 00 01 02 03 04 05 06 07 08 66 A2",
        ),
        with(
            sync_read(Instruction::SyncRead, Span::new(128, 8), &all),
            "FF FF FD 00 FE 0F 00 82 80 00 08 00 01 02 03 04 05 06 07 08 9B 48",
        ),
        with(
            sync_read(Instruction::FastSyncRead, Span::new(126, 10), &all),
            "FF FF FD 00 FE 0F 00 8A 7E 00 0A 00 01 02 03 04 05 06 07 08 6F DE",
        ),
        with(
            sync_read(Instruction::FastSyncRead, Span::new(132, 4), &[3, 7, 4]),
            "FF FF FD 00 FE 0A 00 8A 84 00 04 00 03 07 04 20 F2",
        ),
        with(
            goals(&[(1, [150, 0, 0, 0]), (2, [170, 0, 0, 0])]),
            "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87",
        ),
        with(
            goals(&stuffed),
            "FF FF FD 00 FE 13 00 83 74 00 04 00 01 FF FF FD FD FF 02 FF FF FD FD 00 F0 BA",
        ),
        with(
            goals(&all.map(|id| (id, 2048i32.to_le_bytes()))),
            "FF FF FD 00 FE 2F 00 83 74 00 04 00 01 00 08 00 00 02 00 08 00 00 03 00 08 00 00 04 00 08 00 00 05 00 08 00 00 \
             06 00 08 00 00 07 00 08 00 00 08 00 08 00 00 22 8B",
        ),
    ]
}

#[test]
fn requests_are_written_as_the_manual_prints_them_and_read_by_a_servo() {
    for (bytes, printed, request) in requests() {
        assert_eq!(bytes, hex(printed), "{request:?}");
        assert_eq!(Request::of_packet(&Packet::read(&hex(printed)).unwrap()), Some(request));
    }
}

#[test]
fn requests_that_only_others_make_are_read_by_a_servo() {
    let read = "FF FF FD 00 FE 0D 00 92 01 90 00 02 00 02 92 00 01 00 1A 05";
    let reads = vec![(1, Span::new(144, 2)), (2, Span::new(146, 1))];
    assert_eq!(Request::of_packet(&Packet::read(&hex(read)).unwrap()), Some(Request::BulkRead(reads)));
    let write = "FF FF FD 00 FE 10 00 93 01 20 00 02 00 A0 00 02 1F 00 01 00 50 B7 68";
    let writes = vec![(1, 32, vec![0xA0, 0x00]), (2, 31, vec![0x50])];
    assert_eq!(Request::of_packet(&Packet::read(&hex(write)).unwrap()), Some(Request::BulkWrite(writes)));
}

#[test]
fn answers_are_as_the_manual_prints_them() {
    let done = |id, data: &[u8]| Status { data: data.to_vec(), ..Status::done(id) };
    let refused = |bits| Status::of_error_bits(1, bits, vec![]);
    let answers = [
        ("FF FF FD 00 01 07 00 55 00 06 04 26 65 5D", done(1, &[0x06, 0x04, 38])),
        ("FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0", done(1, &[166, 0, 0, 0])),
        ("FF FF FD 00 02 08 00 55 00 1F 08 00 00 BA BE", done(2, &2079i32.to_le_bytes())),
        ("FF FF FD 00 01 04 00 55 00 A1 0C", done(1, &[])),
        ("FF FF FD 00 01 04 00 55 02 AE 8C", refused(0x02)),
        ("FF FF FD 00 01 04 00 55 87 B3 0F", refused(0x87)),
    ];
    for (printed, status) in answers {
        assert_eq!(written(|out| status.write(out)), hex(printed));
        assert_eq!(Status::of_packet(&Packet::read(&hex(printed)).unwrap()), Some(status));
    }
    assert_eq!(refused(0x87).refusal, Some(Refusal::Access));
    assert!(refused(0x87).alert);
}

#[test]
fn the_one_answer_to_a_fast_read_is_as_the_manual_prints_it() {
    let printed = hex(
        "FF FF FD 00 FE 19 00 55 00 03 A6 00 00 00 84 08 00 07 1F 08 00 00 16 CA 00 04 FF 03 00 00 D1 9E",
    );
    let expected = [(3, 166i32), (7, 2079), (4, 1023)]
        .map(|(id, count)| Status { data: count.to_le_bytes().to_vec(), ..Status::done(id) });
    assert_eq!(written(|out| fast::write(&expected, 3, 4, out)), printed);
    assert_eq!(fast::read(&printed, 4), expected);
    assert_eq!(printed.len(), fast::answer_bytes(3, 4));
    // One that is missing or damaged costs those behind it, not those before.
    assert_eq!(fast::read(&printed[..printed.len() - 3], 4), expected[..2]);
    let mut damaged = printed;
    damaged[19] ^= 1;
    assert_eq!(fast::read(&damaged, 4), expected[..1]);
}

#[test]
fn computed_lengths_are_those_of_the_packets() {
    let ids = [1, 2, 3, 4, 5, 6, 7, 8];
    let write = written(|out| instruction::sync_write(116, &ids.map(|id| (id, [0; 4])), out));
    assert_eq!(write.len(), timing::sync_write_bytes(8, 4));
    let read = written(|out| instruction::sync_read(Instruction::SyncRead, Span::new(126, 10), &ids, out));
    assert_eq!(read.len(), timing::sync_read_request_bytes(8));
    let answer = written(|out| Status { data: vec![0; 10], ..Status::done(1) }.write(out));
    assert_eq!(answer.len(), timing::status_bytes(10));
    let blocks = ids.map(|id| Status { data: vec![0; 10], ..Status::done(id) });
    assert_eq!(written(|out| fast::write(&blocks, 8, 10, out)).len(), fast::answer_bytes(8, 10));
    assert!(write.starts_with(&HEADER));
}

#[test]
fn a_cycle_of_eight_servos_fits_the_line() {
    let cycle_ms = |baud, fast| timing::bytes_ns(timing::cycle_bytes(8, 4, 10, fast), baud) as f64 * 1e-6;
    assert!((cycle_ms(1_000_000, false) - 2.44).abs() < 1e-9);
    assert!((cycle_ms(1_000_000, true) - 1.96).abs() < 1e-9);
    assert!((cycle_ms(2_000_000, false) - 1.22).abs() < 1e-9);
    assert!(cycle_ms(1_000_000, false) < 2.5 && cycle_ms(2_000_000, false) < 1.3);
}
