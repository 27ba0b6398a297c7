//! What a servo can be told, written and read.

use super::packet::{Packet, write};

/// The instruction byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Instruction {
    /// Answer with model and firmware.
    Ping = 0x01,
    /// Read registers.
    Read = 0x02,
    /// Write registers.
    Write = 0x03,
    /// Write registers when told to act.
    RegisteredWrite = 0x04,
    /// Do the registered write.
    Action = 0x05,
    /// Forget all settings.
    FactoryReset = 0x06,
    /// Start anew; ends a shutdown.
    Reboot = 0x08,
    /// The same registers of several servos, each in an answer of its own.
    SyncRead = 0x82,
    /// The same registers of several servos.
    SyncWrite = 0x83,
    /// The same registers of several servos, all in one answer.
    FastSyncRead = 0x8A,
    /// Registers of several servos, of each others.
    BulkRead = 0x92,
    /// Registers of several servos, of each others.
    BulkWrite = 0x93,
}

impl Instruction {
    /// Of an instruction byte.
    pub const fn of_byte(byte: u8) -> Option<Self> {
        Some(match byte {
            0x01 => Self::Ping,
            0x02 => Self::Read,
            0x03 => Self::Write,
            0x04 => Self::RegisteredWrite,
            0x05 => Self::Action,
            0x06 => Self::FactoryReset,
            0x08 => Self::Reboot,
            0x82 => Self::SyncRead,
            0x83 => Self::SyncWrite,
            0x8A => Self::FastSyncRead,
            0x92 => Self::BulkRead,
            0x93 => Self::BulkWrite,
            _ => return None,
        })
    }
}

/// Registers of one servo: the first and how many bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// Address of the first byte.
    pub address: u16,
    /// Bytes.
    pub length: u16,
}

impl Span {
    /// `length` bytes from `address`.
    pub const fn new(address: u16, length: u16) -> Self {
        Self { address, length }
    }
}

/// An instruction with what belongs to it, as the servo's side reads it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Request {
    /// Answer with model and firmware.
    Ping,
    /// Read registers.
    Read(Span),
    /// Write registers from an address on, at once or when told to act.
    Write {
        /// The first register.
        address: u16,
        /// What to write.
        data: Vec<u8>,
        /// Only when told to act.
        registered: bool,
    },
    /// Do the registered write.
    Action,
    /// Start anew.
    Reboot,
    /// Read from several servos, in one answer or in one each.
    SyncRead {
        /// Which registers.
        span: Span,
        /// Who, in the order of the answers.
        ids: Vec<u8>,
        /// In one answer.
        fast: bool,
    },
    /// Write to several servos.
    SyncWrite {
        /// Which registers.
        span: Span,
        /// To whom what.
        data: Vec<(u8, Vec<u8>)>,
    },
    /// Read from several servos, of each other registers.
    BulkRead(Vec<(u8, Span)>),
    /// Write to several servos, of each other registers.
    BulkWrite(Vec<(u8, u16, Vec<u8>)>),
}

impl Request {
    /// What a packet asks for; nothing if the instruction is unknown or its parameters do not fit it.
    pub fn of_packet(packet: &Packet) -> Option<Self> {
        let parameters = packet.parameters.as_slice();
        Some(match Instruction::of_byte(packet.instruction)? {
            Instruction::Ping => Self::Ping,
            Instruction::Action => Self::Action,
            Instruction::Reboot => Self::Reboot,
            Instruction::FactoryReset => return None,
            Instruction::Read => Self::Read(span(parameters)?.0),
            kind @ (Instruction::Write | Instruction::RegisteredWrite) => {
                let (address, data) = word(parameters)?;
                Self::Write { address, data: data.to_vec(), registered: kind == Instruction::RegisteredWrite }
            }
            kind @ (Instruction::SyncRead | Instruction::FastSyncRead) => {
                let (span, ids) = span(parameters)?;
                Self::SyncRead { span, ids: ids.to_vec(), fast: kind == Instruction::FastSyncRead }
            }
            Instruction::SyncWrite => {
                let (span, rest) = span(parameters)?;
                let blocks = rest.chunks_exact(1 + usize::from(span.length));
                if !blocks.remainder().is_empty() {
                    return None;
                }
                let data =
                    blocks.filter_map(|block| block.split_first()).map(|(id, data)| (*id, data.to_vec()));
                Self::SyncWrite { span, data: data.collect() }
            }
            Instruction::BulkRead => {
                let blocks = parameters.chunks_exact(5);
                if !blocks.remainder().is_empty() {
                    return None;
                }
                let read = |block: &[u8]| Some((*block.first()?, span(block.get(1..)?)?.0));
                Self::BulkRead(blocks.map(read).collect::<Option<_>>()?)
            }
            Instruction::BulkWrite => {
                let mut rest = parameters;
                let mut writes = Vec::new();
                while let Some((id, tail)) = rest.split_first() {
                    let (span, tail) = span(tail)?;
                    let (data, tail) = tail.split_at_checked(usize::from(span.length))?;
                    writes.push((*id, span.address, data.to_vec()));
                    rest = tail;
                }
                Self::BulkWrite(writes)
            }
        })
    }
}

fn word(bytes: &[u8]) -> Option<(u16, &[u8])> {
    let (word, rest) = bytes.split_first_chunk::<2>()?;
    Some((u16::from_le_bytes(*word), rest))
}

fn span(bytes: &[u8]) -> Option<(Span, &[u8])> {
    let (address, rest) = word(bytes)?;
    let (length, rest) = word(rest)?;
    Some((Span { address, length }, rest))
}

fn span_bytes(span: Span) -> [u8; 4] {
    let ([a, b], [c, d]) = (span.address.to_le_bytes(), span.length.to_le_bytes());
    [a, b, c, d]
}

/// Appends a packet without parameters: ping, action, reboot.
pub fn plain(id: u8, instruction: Instruction, out: &mut Vec<u8>) {
    write(id, instruction as u8, &[], out);
}

/// Appends a read.
pub fn read(id: u8, span: Span, out: &mut Vec<u8>) {
    write(id, Instruction::Read as u8, &span_bytes(span), out);
}

/// Appends a write, at once or registered.
pub fn write_registers(id: u8, instruction: Instruction, address: u16, data: &[u8], out: &mut Vec<u8>) {
    let parameters: Vec<u8> = address.to_le_bytes().iter().chain(data).copied().collect();
    write(id, instruction as u8, &parameters, out);
}

/// Appends a sync read or a fast one.
pub fn sync_read(instruction: Instruction, span: Span, ids: &[u8], out: &mut Vec<u8>) {
    let parameters: Vec<u8> = span_bytes(span).iter().chain(ids).copied().collect();
    write(super::BROADCAST, instruction as u8, &parameters, out);
}

/// Appends a sync write of `N` bytes to each servo.
pub fn sync_write<const N: usize>(address: u16, data: &[(u8, [u8; N])], out: &mut Vec<u8>) {
    let head = span_bytes(Span { address, length: N as u16 });
    let blocks = data.iter().flat_map(|(id, data)| std::iter::once(id).chain(data));
    let parameters: Vec<u8> = head.iter().chain(blocks).copied().collect();
    write(super::BROADCAST, Instruction::SyncWrite as u8, &parameters, out);
}
