//! A servo's answer: who, whether it refused and why, whether it has an error, and data.

use std::fmt;

use super::packet::{Packet, STATUS, write};

/// Set in an answer's error byte while the servo has a hardware error.
const ALERT: u8 = 0x80;

/// An answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Status {
    /// Who answers.
    pub id: u8,
    /// Why it did not do what it was told.
    pub refusal: Option<Refusal>,
    /// It has a hardware error, which register 70 tells.
    pub alert: bool,
    /// What was read.
    pub data: Vec<u8>,
}

/// Why a servo did not do what it was told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// It could not.
    Failed,
    /// It does not know the instruction.
    Instruction,
    /// The packet came damaged.
    Checksum,
    /// A value is outside its range, or a goal is read-only because the bus watchdog has tripped.
    Range,
    /// Too few or too many bytes for the register.
    Length,
    /// A value is outside a limit that is set.
    Limit,
    /// The register cannot be written, or not while the torque is on.
    Access,
    /// A number without meaning.
    Unknown(u8),
}

impl Refusal {
    /// The reason in the lower bits of an error byte.
    pub fn of_bits(bits: u8) -> Option<Self> {
        match bits & !ALERT {
            0 => None,
            1 => Some(Self::Failed),
            2 => Some(Self::Instruction),
            3 => Some(Self::Checksum),
            4 => Some(Self::Range),
            5 => Some(Self::Length),
            6 => Some(Self::Limit),
            7 => Some(Self::Access),
            other => Some(Self::Unknown(other)),
        }
    }

    /// Its bits in an error byte.
    pub fn bits(self) -> u8 {
        match self {
            Self::Failed => 1,
            Self::Instruction => 2,
            Self::Checksum => 3,
            Self::Range => 4,
            Self::Length => 5,
            Self::Limit => 6,
            Self::Access => 7,
            Self::Unknown(bits) => bits,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Failed => f.write_str("it failed"),
            Self::Instruction => f.write_str("it does not know the instruction"),
            Self::Checksum => f.write_str("the packet reached it damaged"),
            Self::Range => f.write_str("the value is outside its range, or its bus watchdog has tripped"),
            Self::Length => f.write_str("the register has another length"),
            Self::Limit => f.write_str("the value is beyond a limit of its own"),
            Self::Access => f.write_str("the register cannot be written, or not while the torque is on"),
            Self::Unknown(bits) => write!(f, "unknown reason {bits}"),
        }
    }
}

/// Hardware errors of a servo, as register 70 has them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HardwareError(pub u8);

impl HardwareError {
    /// The supply is outside its limits.
    pub const VOLTAGE: u8 = 1 << 0;
    /// Hotter than its limit.
    pub const HEAT: u8 = 1 << 2;
    /// The encoder does not work.
    pub const ENCODER: u8 = 1 << 3;
    /// A shock on the line, or too little power for the motor.
    pub const SHOCK: u8 = 1 << 4;
    /// Loaded beyond its power for too long.
    pub const OVERLOAD: u8 = 1 << 5;

    /// Without any.
    pub const fn is_none(self) -> bool {
        self.0 == 0
    }
}

impl fmt::Display for HardwareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = [
            (Self::VOLTAGE, "input voltage"),
            (Self::HEAT, "overheating"),
            (Self::ENCODER, "encoder"),
            (Self::SHOCK, "electrical shock"),
            (Self::OVERLOAD, "overload"),
        ];
        let known = names.iter().fold(0, |bits, (bit, _)| bits | bit);
        let mut parts = names.iter().filter(|(bit, _)| self.0 & bit != 0).map(|(_, name)| *name);
        match parts.next() {
            None if self.is_none() => return f.write_str("no error"),
            None => return write!(f, "error bits {:#04x}", self.0),
            Some(first) => f.write_str(first)?,
        }
        for name in parts {
            write!(f, ", {name}")?;
        }
        if self.0 & !known != 0 { write!(f, ", bits {:#04x}", self.0 & !known) } else { Ok(()) }
    }
}

impl Status {
    /// An answer without data or error.
    pub fn done(id: u8) -> Self {
        Self { id, refusal: None, alert: false, data: Vec::new() }
    }

    /// The error byte.
    pub fn error_bits(&self) -> u8 {
        self.refusal.map_or(0, Refusal::bits) | if self.alert { ALERT } else { 0 }
    }

    /// Refusal and alert of an error byte.
    pub fn of_error_bits(id: u8, bits: u8, data: Vec<u8>) -> Self {
        Self { id, refusal: Refusal::of_bits(bits), alert: bits & ALERT != 0, data }
    }

    /// The answer in a packet, if it is one.
    pub fn of_packet(packet: &Packet) -> Option<Self> {
        let (bits, data) = packet.parameters.split_first()?;
        (packet.instruction == STATUS).then(|| Self::of_error_bits(packet.id, *bits, data.to_vec()))
    }

    /// Appends the answer's packet.
    pub fn write(&self, out: &mut Vec<u8>) {
        let parameters: Vec<u8> =
            std::iter::once(self.error_bits()).chain(self.data.iter().copied()).collect();
        write(self.id, STATUS, &parameters, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_told_in_words() {
        assert_eq!(HardwareError(0).to_string(), "no error");
        assert_eq!(HardwareError(0b10_0101).to_string(), "input voltage, overheating, overload");
        assert_eq!(HardwareError(0x80).to_string(), "error bits 0x80");
    }

    #[test]
    fn an_error_byte_holds_a_reason_and_the_alert() {
        for bits in 0..=u8::MAX {
            assert_eq!(Status::of_error_bits(1, bits, vec![]).error_bits(), bits);
        }
    }
}
