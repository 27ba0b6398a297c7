//! The one answer of all servos to a fast sync read.
//!
//! ```text
//! FF FF FD 00 | FE | length | 55 | error id data… CRC | error id data… CRC | …
//! ```
//! Each servo adds its block when the one before has ended. Each CRC is that of all bytes before it, those of the
//! earlier CRCs included. Nothing is stuffed. If a servo is missing, those behind it are silent too; what came
//! before is good.

use super::{BROADCAST, HEAD_BYTES, HEADER, Status, crc, packet::STATUS};

/// Bytes of a block besides its data.
const BLOCK_BYTES: usize = 4;
/// Bytes before the first block.
const FIRST_BLOCK: usize = HEAD_BYTES + 1;

/// Bytes of the whole answer of `servos` with `length` bytes of data each.
pub const fn answer_bytes(servos: usize, length: usize) -> usize {
    FIRST_BLOCK + servos * (BLOCK_BYTES + length)
}

/// Appends the first `blocks` blocks of an answer that should have `servos`: fewer if one in the chain is missing.
pub fn write(blocks: &[Status], servos: usize, length: usize, out: &mut Vec<u8>) {
    let start = out.len();
    out.extend_from_slice(&HEADER);
    out.push(BROADCAST);
    let announced = u16::try_from(1 + servos * (BLOCK_BYTES + length)).unwrap_or(u16::MAX);
    out.extend_from_slice(&announced.to_le_bytes());
    out.push(STATUS);
    for block in blocks {
        out.extend_from_slice(&[block.error_bits(), block.id]);
        out.extend_from_slice(&block.data);
        let crc = crc::of(&out[start..]);
        out.extend_from_slice(&crc.to_le_bytes());
    }
}

/// The blocks with right checksums up to the first that is wrong or missing; `length` bytes of data each.
///
/// The bytes may begin with noise. A block's id is what the servo says: the caller checks that it was asked.
pub fn read(bytes: &[u8], length: usize) -> Vec<Status> {
    let begins =
        |window: &[u8]| window.starts_with(&HEADER) && window[4] == BROADCAST && window[HEAD_BYTES] == STATUS;
    let Some(start) = bytes.windows(FIRST_BLOCK).position(begins) else { return Vec::new() };
    let answer = &bytes[start..];
    let mut statuses = Vec::new();
    let (head, mut rest) = answer.split_at(FIRST_BLOCK);
    let mut crc = crc::of(head);
    while let Some((block, tail)) = rest.split_at_checked(BLOCK_BYTES + length) {
        let (body, found) = block.split_at(2 + length);
        crc = crc::continued(crc, body);
        if found != crc.to_le_bytes() {
            break;
        }
        crc = crc::continued(crc, found);
        statuses.push(Status::of_error_bits(body[1], body[0], body[2..].to_vec()));
        rest = tail;
    }
    statuses
}
