//! How long bytes take on the line, computed: 10 bits a byte (start, 8, stop), answers without delay.

use super::{EMPTY_PACKET_BYTES, fast};

/// Bits of a byte on the line.
const BITS_PER_BYTE: u64 = 10;

/// Time of `bytes` on a line of `baud` bits a second, ns.
pub const fn bytes_ns(bytes: usize, baud: u32) -> u64 {
    (bytes as u64 * BITS_PER_BYTE * 1_000_000_000).div_ceil(baud as u64)
}

/// Bytes of a sync write of `length` bytes to each of `servos`.
pub const fn sync_write_bytes(servos: usize, length: usize) -> usize {
    EMPTY_PACKET_BYTES + 4 + servos * (1 + length)
}

/// Bytes of a sync read's request.
pub const fn sync_read_request_bytes(servos: usize) -> usize {
    EMPTY_PACKET_BYTES + 4 + servos
}

/// Bytes of an answer with `length` bytes of data.
pub const fn status_bytes(length: usize) -> usize {
    EMPTY_PACKET_BYTES + 1 + length
}

/// Bytes of a whole cycle: write `written` bytes to each of `servos`, read `read` from each, one answer or many.
pub const fn cycle_bytes(servos: usize, written: usize, read: usize, one_answer: bool) -> usize {
    let answers = if one_answer { fast::answer_bytes(servos, read) } else { servos * status_bytes(read) };
    sync_write_bytes(servos, written) + sync_read_request_bytes(servos) + answers
}
