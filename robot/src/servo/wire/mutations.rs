//! A million damaged packets: nothing panics, and nothing is taken in whose checksum is wrong.

use super::{HEADER, Request, Scanner, Status, crc, fast, packet::Packet};

/// Packets altogether, half of them through the scanner.
const PACKETS: u64 = 1_000_000;

/// A small generator (xorshift64*): the same packets on every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 16
    }

    fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound.max(1) as u64) as usize
    }

    fn byte(&mut self) -> u8 {
        // Bytes of headers and stuffing come often.
        [0xFF, 0xFF, 0xFD, 0x00, 0x55, self.next() as u8, self.next() as u8, self.next() as u8][self.below(8)]
    }

    fn packet(&mut self) -> Vec<u8> {
        let instructions = [0x01, 0x02, 0x03, 0x04, 0x55, 0x82, 0x83, 0x8A, 0x92, 0x93, self.byte()];
        let instruction = instructions[self.below(instructions.len())];
        let parameters = (0..self.below(40)).map(|_| self.byte()).collect();
        Packet { id: self.byte(), instruction, parameters }.to_bytes()
    }

    /// One to three bytes changed, left out or put in, or the end cut off.
    fn mutate(&mut self, bytes: &mut Vec<u8>) {
        for _ in 0..=self.below(3) {
            let at = self.below(bytes.len());
            match self.below(4) {
                0 if at < bytes.len() => bytes[at] ^= 1 << self.below(8),
                1 if at < bytes.len() => drop(bytes.remove(at)),
                2 => bytes.insert(at, self.byte()),
                _ => bytes.truncate(at),
            }
        }
    }
}

/// Whether the stream holds a run of bytes that is a packet by the manual's rules: judged apart from the code.
fn holds_a_whole_packet(stream: &[u8]) -> bool {
    (0..stream.len()).any(|start| {
        let rest = &stream[start..];
        let Some(head) = rest.first_chunk::<7>() else { return false };
        let end = 7 + usize::from(u16::from_le_bytes([head[5], head[6]]));
        rest.starts_with(&HEADER)
            && end >= 10
            && rest
                .get(..end)
                .is_some_and(|packet| crc::of(&packet[..end - 2]).to_le_bytes() == packet[end - 2..])
    })
}

#[test]
fn of_a_million_damaged_packets_none_with_a_wrong_checksum_is_taken() {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let (mut refused, mut taken) = (0u64, 0u64);
    for _ in 0..PACKETS / 2 {
        let mut bytes = random.packet();
        random.mutate(&mut bytes);
        match Packet::read(&bytes) {
            Ok(packet) => {
                let (body, end) = bytes.split_at(bytes.len() - 2);
                assert_eq!(crc::of(body).to_le_bytes(), end, "{bytes:02x?}");
                // What is inside may still be nonsense; it must only not panic.
                let _ = (Request::of_packet(&packet), Status::of_packet(&packet));
                taken += 1;
            }
            Err(_) => refused += 1,
        }
        let _ = fast::read(&bytes, 10);
    }
    // A few mutations undo themselves; the rest are refused.
    assert!(refused > taken * 10, "{refused} refused, {taken} taken");
}

#[test]
fn in_streams_of_damaged_packets_only_whole_ones_are_found() {
    let mut random = Random(0xD1B5_4A32_D192_ED03);
    let mut found = 0u64;
    for _ in 0..PACKETS / 2 / 4 {
        let mut scanner = Scanner::default();
        let mut stream = Vec::new();
        for _ in 0..4 {
            let mut bytes = random.packet();
            if random.below(4) > 0 {
                random.mutate(&mut bytes);
            }
            stream.extend(bytes);
        }
        scanner.push(&stream);
        let packets = std::iter::from_fn(|| scanner.next_packet()).count();
        assert!(packets == 0 || holds_a_whole_packet(&stream), "{stream:02x?}");
        found += packets as u64;
    }
    assert!(found > 0);
}
