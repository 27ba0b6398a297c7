//! The control table of the Dynamixel XC330-T288-T: which register stands where and in what unit.
//!
//! Source: the maker's manual, "XC330-T288-T", Control Table. Registers below 64 are kept without power and can be
//! written only while the torque is off.

use std::f64::consts::TAU;

use super::wire::instruction::Span;

/// Model number of the XC330-T288-T.
pub const MODEL: u16 = 1220;
/// Firmware from which on it knows the fast sync read.
pub const FAST_READ_FIRMWARE: u8 = 46;
/// Registers altogether, bytes.
pub const TABLE_BYTES: usize = 256;
/// Registers from here on are lost without power.
pub const FIRST_VOLATILE: u16 = 64;

/// One register: its address and how many bytes it has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Register<const N: usize> {
    /// Address of the first byte.
    pub address: u16,
    /// As the manual calls it.
    pub name: &'static str,
}

impl<const N: usize> Register<N> {
    const fn new(address: u16, name: &'static str) -> Self {
        Self { address, name }
    }

    /// Where it stands.
    pub const fn span(self) -> Span {
        Span::new(self.address, N as u16)
    }

    /// Its bytes in a table that is read from address 0 on; zeros beyond the end.
    pub fn bytes(self, table: &[u8]) -> [u8; N] {
        self.bytes_in(table, 0)
    }

    /// Its bytes in data that were read from `first` on; zeros if it is not among them.
    pub fn bytes_in(self, data: &[u8], first: u16) -> [u8; N] {
        let at = usize::from(self.address.saturating_sub(first));
        data.get(at..).and_then(|rest| rest.first_chunk::<N>()).copied().unwrap_or([0; N])
    }
}

macro_rules! registers {
    ($($(#[$doc:meta])* $name:ident: $bytes:literal at $address:literal, $text:literal;)*) => {
        $($(#[$doc])* pub const $name: Register<$bytes> = Register::new($address, $text);)*
    };
}

registers! {
    /// Number of the model.
    MODEL_NUMBER: 2 at 0, "model number";
    /// Version of its program.
    FIRMWARE: 1 at 6, "firmware version";
    /// Its id, 0 to 252.
    ID: 1 at 7, "id";
    /// See [`baud_code`].
    BAUD_RATE: 1 at 8, "baud rate";
    /// Before an answer, 2 µs.
    RETURN_DELAY: 1 at 9, "return delay time";
    /// Bit 0 turns the direction, bit 2 makes profiles times.
    DRIVE_MODE: 1 at 10, "drive mode";
    /// [`CURRENT_BASED_POSITION`] here.
    OPERATING_MODE: 1 at 11, "operating mode";
    /// A second id, 255 for none.
    SECONDARY_ID: 1 at 12, "secondary id";
    /// Added to positions, counts.
    HOMING_OFFSET: 4 at 20, "homing offset";
    /// °C.
    TEMPERATURE_LIMIT: 1 at 31, "temperature limit";
    /// 0.1 V.
    MAX_VOLTAGE: 2 at 32, "max voltage limit";
    /// 0.1 V.
    MIN_VOLTAGE: 2 at 34, "min voltage limit";
    /// 0.113 %.
    PWM_LIMIT: 2 at 36, "pwm limit";
    /// mA.
    CURRENT_LIMIT: 2 at 38, "current limit";
    /// Which hardware errors switch the torque off.
    SHUTDOWN: 1 at 63, "shutdown";
    /// 1 drives the motor.
    TORQUE_ENABLE: 1 at 64, "torque enable";
    /// 1 lights the lamp.
    LED: 1 at 65, "led";
    /// What is answered: 0 pings, 1 also reads, 2 all.
    STATUS_RETURN_LEVEL: 1 at 68, "status return level";
    /// See [`super::wire::HardwareError`].
    HARDWARE_ERROR: 1 at 70, "hardware error status";
    /// 1/16.
    POSITION_D: 2 at 80, "position d gain";
    /// 1/65536.
    POSITION_I: 2 at 82, "position i gain";
    /// 1/128.
    POSITION_P: 2 at 84, "position p gain";
    /// 20 ms; 0 is off, 255 says that it has tripped.
    BUS_WATCHDOG: 1 at 98, "bus watchdog";
    /// mA; the most that the position loop may take.
    GOAL_CURRENT: 2 at 102, "goal current";
    /// 214.577 rev/min²; 0 has no limit.
    PROFILE_ACCELERATION: 4 at 108, "profile acceleration";
    /// 0.229 rev/min; 0 has no limit.
    PROFILE_VELOCITY: 4 at 112, "profile velocity";
    /// Counts.
    GOAL_POSITION: 4 at 116, "goal position";
    /// mA.
    PRESENT_CURRENT: 2 at 126, "present current";
    /// 0.229 rev/min.
    PRESENT_VELOCITY: 4 at 128, "present velocity";
    /// Counts.
    PRESENT_POSITION: 4 at 132, "present position";
    /// 0.1 V.
    PRESENT_VOLTAGE: 2 at 144, "present input voltage";
    /// °C.
    PRESENT_TEMPERATURE: 1 at 146, "present temperature";
}

/// A register of any length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AnyRegister {
    /// Where it stands.
    pub span: Span,
    /// As the manual calls it.
    pub name: &'static str,
}

impl AnyRegister {
    /// Its unsigned value in a table that is read from address 0 on; 0 beyond the end.
    pub fn value(self, table: &[u8]) -> i64 {
        let at = usize::from(self.span.address);
        let bytes = table.get(at..at + usize::from(self.span.length)).unwrap_or_default();
        bytes.iter().rev().fold(0, |value, byte| value << 8 | i64::from(*byte))
    }
}

impl<const N: usize> From<Register<N>> for AnyRegister {
    fn from(register: Register<N>) -> Self {
        Self { span: register.span(), name: register.name }
    }
}

/// What every servo must keep without power, whatever its place; `locoman-robot servo setup` writes it.
///
/// Drive mode 0 leaves directions to the zeros' file and profiles in speeds; homing offset 0 leaves angles to it too.
pub fn kept_settings() -> [(AnyRegister, i64); 6] {
    [
        (RETURN_DELAY.into(), 0),
        (DRIVE_MODE.into(), 0),
        (OPERATING_MODE.into(), CURRENT_BASED_POSITION.into()),
        (SECONDARY_ID.into(), 255),
        (HOMING_OFFSET.into(), 0),
        (SHUTDOWN.into(), SHUTDOWN_ERRORS.into()),
    ]
}

/// All registers that are kept without power.
pub const KEPT: Span = Span::new(0, FIRST_VOLATILE);
/// Current, velocity and position, which stand side by side: what a cycle reads.
pub const MOTION: Span = Span::new(PRESENT_CURRENT.address, 10);
/// From the torque's switch to the bus watchdog: all that tells whether a servo is as it was set up.
pub const CONDITION: Span = Span::new(TORQUE_ENABLE.address, 35);
/// Voltage and temperature.
pub const SUPPLY: Span = Span::new(PRESENT_VOLTAGE.address, 3);

/// The operating mode in which a position is held with no more than the goal current.
pub const CURRENT_BASED_POSITION: u8 = 5;
/// Overheating, electrical shock and overload switch the torque off: the maker's default.
pub const SHUTDOWN_ERRORS: u8 = 0b11_0100;
/// What [`BUS_WATCHDOG`] reads after it has tripped.
pub const WATCHDOG_TRIPPED: u8 = 0xFF;
/// Duration of one step of the bus watchdog, ms.
pub const WATCHDOG_STEP_MS: u32 = 20;
/// The longest that the bus watchdog can be set to, steps.
pub const WATCHDOG_MAX_STEPS: u32 = 127;
/// Goals beyond are refused in [`CURRENT_BASED_POSITION`], counts.
pub const MAX_GOAL: i32 = 1_048_575;

/// Counts of the encoder in a turn of the output shaft.
pub const COUNTS_PER_TURN: i32 = 4096;
/// rad.
pub const RAD_PER_COUNT: f64 = TAU / COUNTS_PER_TURN as f64;
/// One step of a velocity, rad/s (0.229 rev/min).
pub const VELOCITY_STEP_RAD_S: f64 = 0.229 * TAU / 60.0;
/// One step of an acceleration, rad/s² (214.577 rev/min²).
pub const ACCELERATION_STEP_RAD_S2: f64 = 214.577 * TAU / 3600.0;
/// One step of a current, A.
pub const CURRENT_STEP_A: f64 = 0.001;
/// One step of a voltage, V.
pub const VOLTAGE_STEP_V: f64 = 0.1;
/// The gains' units: one of P is 1/128, one of D 1/16 PWM steps a count.
pub const P_UNIT: f64 = 128.0;
/// See [`P_UNIT`].
pub const D_UNIT: f64 = 16.0;
/// PWM steps at which the whole supply is on the motor.
pub const FULL_PWM: f64 = 885.0;

/// Baud rates that a servo can be set to, with their codes. The maker delivers servos with 57,600.
pub const BAUD_RATES: [(u8, u32); 7] =
    [(0, 9_600), (1, 57_600), (2, 115_200), (3, 1_000_000), (4, 2_000_000), (5, 3_000_000), (6, 4_000_000)];

/// The register's value for a baud rate.
pub fn baud_code(baud: u32) -> Option<u8> {
    BAUD_RATES.iter().find(|(_, rate)| *rate == baud).map(|(code, _)| *code)
}
