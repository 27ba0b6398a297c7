//! A virtual servo's registers: what they hold when it comes from the maker, and which writes it takes.
//!
//! Source: the maker's manual "XC330-T288-T", Control Table, and "DYNAMIXEL Protocol 2.0", Error.

use locoman_robot::servo::registers as reg;
use locoman_robot::servo::registers::{AnyRegister, Register, TABLE_BYTES};
use locoman_robot::servo::wire::Refusal;
use locoman_robot::servo::wire::instruction::Span;

/// Everything that can be written: the register, its least and greatest value, and what it holds at first.
const WRITABLE: [Entry; 26] = [
    Entry::kept(reg::ID, 0, 252, 1),
    Entry::kept(reg::BAUD_RATE, 0, 6, 1),
    Entry::kept(reg::RETURN_DELAY, 0, 254, 250),
    Entry::kept(reg::DRIVE_MODE, 0, 15, 0),
    Entry::kept(reg::OPERATING_MODE, 0, 16, 3),
    Entry::kept(reg::SECONDARY_ID, 0, 255, 255),
    Entry::kept(reg::HOMING_OFFSET, -1_044_479, 1_044_479, 0),
    Entry::kept(reg::TEMPERATURE_LIMIT, 0, 100, 70),
    Entry::kept(reg::MAX_VOLTAGE, 31, 140, 140),
    Entry::kept(reg::MIN_VOLTAGE, 31, 140, 55),
    Entry::kept(reg::PWM_LIMIT, 0, 885, 885),
    Entry::kept(reg::CURRENT_LIMIT, 0, 910, 910),
    Entry::kept(reg::SHUTDOWN, 0, 255, reg::SHUTDOWN_ERRORS as i64),
    Entry::volatile(reg::TORQUE_ENABLE, 0, 1, 0),
    Entry::volatile(reg::LED, 0, 1, 0),
    Entry::volatile(reg::STATUS_RETURN_LEVEL, 0, 2, 2),
    Entry::volatile(reg::POSITION_D, 0, 16_383, 0),
    Entry::volatile(reg::POSITION_I, 0, 16_383, 0),
    Entry::volatile(reg::POSITION_P, 0, 16_383, 900),
    Entry::volatile(reg::BUS_WATCHDOG, 0, 127, 0),
    Entry::volatile(reg::GOAL_CURRENT, -910, 910, 910),
    Entry::volatile(reg::PROFILE_ACCELERATION, 0, 32_767, 0),
    Entry::volatile(reg::PROFILE_VELOCITY, 0, 32_767, 0),
    Entry::volatile(reg::GOAL_POSITION, -(reg::MAX_GOAL as i64), reg::MAX_GOAL as i64, 0),
    Entry {
        register: AnyRegister { span: Span::new(100, 2), name: "goal pwm" },
        min: -885,
        max: 885,
        first: 885,
    },
    Entry {
        register: AnyRegister { span: Span::new(104, 4), name: "goal velocity" },
        min: -2047,
        max: 2047,
        first: 0,
    },
];
/// What cannot be written and is not zero at first.
const READ_ONLY: [(u16, &[u8]); 3] =
    [(0, &reg::MODEL.to_le_bytes()), (13, &[2]), (reg::PRESENT_TEMPERATURE.address, &[30])];
/// Registers that a tripped bus watchdog locks.
const GOALS: [u16; 4] = [100, 102, 104, 116];
/// Reads end here.
const END: usize = 228;

#[derive(Debug, Clone, Copy)]
struct Entry {
    register: AnyRegister,
    min: i64,
    max: i64,
    first: i64,
}

impl Entry {
    const fn kept<const N: usize>(register: Register<N>, min: i64, max: i64, first: i64) -> Self {
        Self { register: AnyRegister { span: register.span(), name: register.name }, min, max, first }
    }

    const fn volatile<const N: usize>(register: Register<N>, min: i64, max: i64, first: i64) -> Self {
        Self::kept(register, min, max, first)
    }

    fn is_kept(&self) -> bool {
        self.register.span.address < reg::FIRST_VOLATILE
    }

    /// The signed value if the register can be negative.
    fn value(&self, bytes: &[u8]) -> i64 {
        let value = bytes.iter().rev().fold(0i64, |value, byte| value << 8 | i64::from(*byte));
        let bits = 8 * bytes.len() as u32;
        if self.min < 0 && value >= 1 << (bits - 1) { value - (1 << bits) } else { value }
    }
}

/// The registers.
#[derive(Debug, Clone)]
pub struct Table {
    bytes: [u8; TABLE_BYTES],
}

impl Table {
    /// As it comes from the maker.
    pub fn new(firmware: u8) -> Self {
        let mut table = Self { bytes: [0; TABLE_BYTES] };
        for (address, bytes) in READ_ONLY {
            table.put_bytes(address, bytes);
        }
        table.put(reg::FIRMWARE, firmware.into());
        table.put(reg::PRESENT_VOLTAGE, 111);
        WRITABLE.iter().for_each(|entry| table.put_first(entry));
        table
    }

    /// As when it is switched on: what is not kept is as at first.
    pub fn restart(&mut self) {
        WRITABLE.iter().filter(|entry| !entry.is_kept()).for_each(|entry| self.put_first(entry));
        self.put(reg::HARDWARE_ERROR, 0);
        self.put(reg::GOAL_CURRENT, self.get(reg::CURRENT_LIMIT));
    }

    /// A register's signed or unsigned value, as its range says.
    pub fn get<const N: usize>(&self, register: Register<N>) -> i64 {
        let bytes = register.bytes(&self.bytes);
        let entry = WRITABLE.iter().find(|entry| entry.register.span == register.span());
        entry.map_or_else(|| AnyRegister::from(register).value(&self.bytes), |entry| entry.value(&bytes))
    }

    /// Sets a register, whatever it permits.
    pub fn put<const N: usize>(&mut self, register: Register<N>, value: i64) {
        self.put_bytes(register.address, &value.to_le_bytes()[..N]);
    }

    /// Sets a register of any length, whatever it permits.
    pub fn put_any(&mut self, register: AnyRegister, value: i64) {
        let Span { address, length } = register.span;
        self.put_bytes(address, &value.to_le_bytes()[..usize::from(length)]);
    }

    /// Some registers' bytes.
    pub fn read(&self, span: Span) -> Result<&[u8], Refusal> {
        let (start, end) = (usize::from(span.address), usize::from(span.address) + usize::from(span.length));
        if end > END { Err(Refusal::Access) } else { Ok(&self.bytes[start..end]) }
    }

    /// Writes registers from an address on: all of them, or none and the reason.
    pub fn write(&mut self, address: u16, data: &[u8]) -> Result<(), Refusal> {
        let mut at = address;
        let mut rest = data;
        let mut writes = Vec::new();
        while !rest.is_empty() {
            let entry =
                WRITABLE.iter().find(|entry| entry.register.span.address == at).ok_or(Refusal::Access)?;
            let length = entry.register.span.length;
            let (bytes, tail) = rest.split_at_checked(usize::from(length)).ok_or(Refusal::Length)?;
            self.permits(entry, bytes)?;
            writes.push((at, bytes));
            (at, rest) = (at + length, tail);
        }
        for (at, bytes) in writes {
            self.put_bytes(at, bytes);
            if at == reg::OPERATING_MODE.address {
                self.forget_gains();
            }
        }
        Ok(())
    }

    fn permits(&self, entry: &Entry, bytes: &[u8]) -> Result<(), Refusal> {
        let value = entry.value(bytes);
        let address = entry.register.span.address;
        if entry.is_kept() && self.get(reg::TORQUE_ENABLE) == 1 {
            return Err(Refusal::Access);
        }
        let tripped = self.get(reg::BUS_WATCHDOG) == i64::from(reg::WATCHDOG_TRIPPED);
        if !(entry.min..=entry.max).contains(&value) || (tripped && GOALS.contains(&address)) {
            return Err(Refusal::Range);
        }
        if address == reg::GOAL_CURRENT.address && value.abs() > self.get(reg::CURRENT_LIMIT) {
            return Err(Refusal::Limit);
        }
        let shut_down = self.get(reg::HARDWARE_ERROR) & self.get(reg::SHUTDOWN) != 0;
        if address == reg::TORQUE_ENABLE.address && value == 1 && shut_down {
            return Err(Refusal::Access);
        }
        Ok(())
    }

    /// Another operating mode begins with the maker's gains and limits.
    fn forget_gains(&mut self) {
        let of_mode = |entry: &&Entry| (76..120).contains(&entry.register.span.address);
        WRITABLE.iter().filter(of_mode).for_each(|entry| self.put_first(entry));
        self.put(reg::GOAL_CURRENT, self.get(reg::CURRENT_LIMIT));
    }

    fn put_first(&mut self, entry: &Entry) {
        self.put_any(entry.register, entry.first);
    }

    fn put_bytes(&mut self, address: u16, bytes: &[u8]) {
        let start = usize::from(address);
        self.bytes[start..start + bytes.len()].copy_from_slice(bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kept_registers_are_locked_while_the_torque_is_on() {
        let mut sut = Table::new(52);
        sut.write(64, &[1]).unwrap();
        assert_eq!(sut.write(11, &[5]), Err(Refusal::Access));
        sut.write(64, &[0]).unwrap();
        sut.write(11, &[5]).unwrap();
        assert_eq!(sut.get(reg::OPERATING_MODE), 5);
    }

    #[test]
    fn a_write_is_done_whole_or_not_at_all() {
        let mut sut = Table::new(52);
        // Goal current good, goal velocity beyond its range.
        let data = [10, 0, 0xFF, 0x7F, 0, 0];
        assert_eq!(sut.write(102, &data), Err(Refusal::Range));
        assert_eq!(sut.get(reg::GOAL_CURRENT), 910);
        assert_eq!(sut.write(116, &[0, 0]), Err(Refusal::Length));
        assert_eq!(sut.write(132, &[0, 0, 0, 0]), Err(Refusal::Access));
    }

    #[test]
    fn another_mode_forgets_gains_and_a_restart_forgets_what_is_not_kept() {
        let mut sut = Table::new(52);
        sut.write(84, &[1, 2]).unwrap();
        sut.write(11, &[5]).unwrap();
        assert_eq!(sut.get(reg::POSITION_P), 900);
        sut.write(84, &[1, 2]).unwrap();
        sut.restart();
        assert_eq!((sut.get(reg::POSITION_P), sut.get(reg::OPERATING_MODE)), (900, 5));
    }
}
