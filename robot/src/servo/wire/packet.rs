//! One packet: written with stuffing and checksum, read back from the bytes of a whole one.

use super::{BROADCAST, EMPTY_PACKET_BYTES, HEAD_BYTES, HEADER, MARK, MAX_PACKET_BYTES, STUFFING, crc};

/// The instruction byte of an answer.
pub const STATUS: u8 = 0x55;

/// A packet without its wrapping.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    /// Whom it is for, or who answers.
    pub id: u8,
    /// What it is: see [`super::Instruction`], or [`STATUS`].
    pub instruction: u8,
    /// What follows, without stuffing.
    pub parameters: Vec<u8>,
}

/// Why bytes are not a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PacketError {
    /// They begin with something else.
    #[error("a packet does not begin with ff ff fd 00")]
    Header,
    /// Their number is not what the packet says.
    #[error("a packet of {bytes} bytes says that it has {said}")]
    Length {
        /// How many there are.
        bytes: usize,
        /// How many the packet announces.
        said: usize,
    },
    /// The checksum is not that of the bytes.
    #[error(
        "a packet ends with checksum {found:04x}, its bytes have {computed:04x}: look at cable and baud rate"
    )]
    Checksum {
        /// What stands at its end.
        found: u16,
        /// What its bytes have.
        computed: u16,
    },
}

/// Appends a packet to `out`: header, id, length, stuffed inside, checksum.
///
/// The inside of any packet of this program is far shorter than the 65,535 bytes that a length can say; longer
/// ones are cut there.
pub fn write(id: u8, instruction: u8, parameters: &[u8], out: &mut Vec<u8>) {
    let start = out.len();
    out.extend_from_slice(&HEADER);
    out.extend_from_slice(&[id, 0, 0, instruction]);
    for byte in parameters {
        out.push(*byte);
        if out[start + HEAD_BYTES..].ends_with(&MARK) {
            out.push(STUFFING);
        }
    }
    let length = u16::try_from(out.len() - start - HEAD_BYTES + 2).unwrap_or(u16::MAX);
    out[start + 5..start + HEAD_BYTES].copy_from_slice(&length.to_le_bytes());
    let crc = crc::of(&out[start..]);
    out.extend_from_slice(&crc.to_le_bytes());
}

/// How many bytes the packet has that begins here, once its length has come; nothing if the bytes cannot begin one.
pub fn announced(bytes: &[u8]) -> Option<usize> {
    let head = bytes.first_chunk::<HEAD_BYTES>()?;
    let total = HEAD_BYTES + usize::from(u16::from_le_bytes([head[5], head[6]]));
    let whole = EMPTY_PACKET_BYTES..=MAX_PACKET_BYTES;
    (head.starts_with(&HEADER) && whole.contains(&total)).then_some(total)
}

impl Packet {
    /// Reads exactly one packet.
    pub fn read(bytes: &[u8]) -> Result<Self, PacketError> {
        let said = announced(bytes).ok_or(PacketError::Header)?;
        if bytes.len() != said {
            return Err(PacketError::Length { bytes: bytes.len(), said });
        }
        let (body, end) = bytes.split_at(said - 2);
        let found = u16::from_le_bytes([end[0], end[1]]);
        let computed = crc::of(body);
        if found != computed {
            return Err(PacketError::Checksum { found, computed });
        }
        let (id, instruction) = (body[4], body[HEAD_BYTES]);
        // The answer to a fast sync read is the one packet that is not stuffed.
        let stuffed = !(id == BROADCAST && instruction == STATUS);
        let inside = &body[HEAD_BYTES..];
        let mut parameters = if stuffed { unstuffed(inside) } else { inside.to_vec() };
        parameters.remove(0);
        Ok(Self { id, instruction, parameters })
    }

    /// The packet's bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(EMPTY_PACKET_BYTES + self.parameters.len());
        write(self.id, self.instruction, &self.parameters, &mut out);
        out
    }
}

/// Without the `FD` behind each `FF FF FD`.
fn unstuffed(inside: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(inside.len());
    let mut bytes = inside.iter().copied().peekable();
    while let Some(byte) = bytes.next() {
        out.push(byte);
        if out.ends_with(&MARK) {
            bytes.next_if_eq(&STUFFING);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn what_is_written_is_read_back(
            id in 0u8..=252,
            instruction: u8,
            // Few values, so that marks and stuffing of every kind come up.
            parameters in prop::collection::vec(prop::sample::select(vec![0xFFu8, 0xFD, 0x00, 0x55]), 0..64),
        ) {
            let packet = Packet { id, instruction, parameters };
            prop_assert_eq!(Packet::read(&packet.to_bytes()), Ok(packet));
        }

        #[test]
        fn no_packet_has_a_second_beginning_inside(
            parameters in prop::collection::vec(prop::sample::select(vec![0xFFu8, 0xFD, 0x00]), 0..64),
        ) {
            let bytes = Packet { id: 1, instruction: 3, parameters }.to_bytes();
            let inside = &bytes[HEAD_BYTES..bytes.len() - 2];
            prop_assert!(!inside.windows(4).any(|window| window == HEADER));
        }
    }

    #[test]
    fn a_packet_cut_off_or_damaged_is_refused() {
        let bytes = Packet { id: 1, instruction: 1, parameters: vec![] }.to_bytes();
        assert_eq!(Packet::read(&bytes[..9]), Err(PacketError::Length { bytes: 9, said: 10 }));
        assert_eq!(Packet::read(&bytes[..4]), Err(PacketError::Header));
        let mut damaged = bytes.clone();
        damaged[4] = 2;
        assert!(matches!(Packet::read(&damaged), Err(PacketError::Checksum { found: 0x4E19, .. })));
    }
}
