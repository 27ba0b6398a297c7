//! The low-level state: 807 bytes that have a meaning, of 820 that the robot sends.

use super::{Checksum, DatagramError, HEAD, Remote, SLOTS, bytes, checked, checksum};

/// Bytes with a known meaning.
pub const LENGTH: usize = 807;
/// Bytes that the robot's board sends.
pub const SENT: usize = 820;
/// Where motors begin, and their length.
const FIRST: usize = 75;
const SLOT: usize = 32;

/// What a motor says that it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotorMode {
    /// Follows its command.
    Servo,
    /// Brakes by itself.
    Brake,
    /// Protects itself: too hot, or cut off.
    Protection,
    /// Something that nobody has described.
    Unknown(u8),
}

/// One motor, in the numbers of the wire.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotorState {
    /// See [`Self::mode`].
    pub mode: u8,
    /// Position, rad.
    pub q_rad: f32,
    /// Velocity, rad/s.
    pub dq_rad_s: f32,
    /// Acceleration, rad/s².
    pub ddq_rad_s2: i16,
    /// Estimated torque, 1/256 N m.
    pub tau: i16,
    /// Raw position, velocity and acceleration: zero on a Go1.
    pub raw: [u8; 10],
    /// Temperature, °C.
    pub temperature_c: i8,
    /// An error code, as far as is known: 4 stands for too hot.
    pub reserve: [u8; 8],
}

impl MotorState {
    /// What it does.
    pub const fn mode(&self) -> MotorMode {
        match self.mode {
            0x0A => MotorMode::Servo,
            0x00 => MotorMode::Brake,
            0x08 => MotorMode::Protection,
            other => MotorMode::Unknown(other),
        }
    }

    /// Estimated torque, N m.
    pub fn torque_n_m(&self) -> f64 {
        f64::from(self.tau) / 256.0
    }
}

/// The battery.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Battery {
    /// Version, high and low.
    pub version: [u8; 2],
    /// 1 discharging, 2 charging; others see the maker's list.
    pub status: u8,
    /// Charge, percent.
    pub charge_percent: u8,
    /// Current, mA; negative while discharging.
    pub current_ma: i32,
    /// Charges so far.
    pub cycles: u16,
    /// Two temperatures of the pack and two of its board, °C.
    pub temperatures_c: [i8; 4],
    /// Cells, steps of 32 mV; a Go1 has six.
    pub cells: [u8; 10],
}

impl Battery {
    /// A cell's voltage, mV.
    pub fn cell_mv(&self, cell: usize) -> Option<u32> {
        self.cells.get(cell).map(|&steps| 32 * u32::from(steps))
    }

    fn decode(raw: &[u8]) -> Self {
        Self {
            version: bytes::take(raw, 0),
            status: raw[2],
            charge_percent: raw[3],
            current_ma: i32::from_le_bytes(bytes::take(raw, 4)),
            cycles: u16::from_le_bytes(bytes::take(raw, 8)),
            temperatures_c: bytes::take::<4>(raw, 10).map(u8::cast_signed),
            cells: bytes::take(raw, 14),
        }
    }

    fn encode(&self, raw: &mut [u8]) {
        bytes::put(raw, 0, self.version);
        bytes::put(raw, 2, [self.status, self.charge_percent]);
        bytes::put(raw, 4, self.current_ma.to_le_bytes());
        bytes::put(raw, 8, self.cycles.to_le_bytes());
        bytes::put(raw, 10, self.temperatures_c.map(i8::cast_unsigned));
        bytes::put(raw, 14, self.cells);
    }
}

/// A state datagram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowState {
    /// Bytes 2 to 21: level, serial number, version, bandwidth.
    pub opening: [u8; 20],
    /// Attitude, w x y z.
    pub quaternion_wxyz: [f32; 4],
    /// Angular velocity, rad/s.
    pub gyroscope_rad_s: [f32; 3],
    /// Specific force, m/s²; +9.8 on z when level.
    pub accelerometer_m_s2: [f32; 3],
    /// Roll, pitch, yaw, rad.
    pub rpy_rad: [f32; 3],
    /// Temperature of the IMU, °C.
    pub imu_temperature_c: i8,
    /// The slots; the legs' first.
    pub motors: [MotorState; SLOTS],
    /// The battery.
    pub battery: Battery,
    /// The feet's pressure FR, FL, RR, RL, counts; then their estimates, zero on a Go1.
    pub feet: [i16; 8],
    /// Since the board began, ms.
    pub tick_ms: u32,
    /// The remote control's part; see [`Self::remote`].
    pub remote_bytes: [u8; 40],
    /// Without known meaning.
    pub reserve: [u8; 4],
}

impl LowState {
    /// The remote control, if it is switched on.
    pub fn remote(&self) -> Option<Remote> {
        Remote::decode(&self.remote_bytes)
    }

    /// Reads a datagram, and how its checksum is written.
    pub fn decode(datagram: &[u8]) -> Result<(Self, Checksum), DatagramError> {
        let (raw, kind) = checked::<LENGTH>(datagram)?;
        let motors = std::array::from_fn(|motor| {
            let slot = &raw[FIRST + SLOT * motor..];
            MotorState {
                mode: slot[0],
                q_rad: bytes::float(slot, 1),
                dq_rad_s: bytes::float(slot, 5),
                ddq_rad_s2: bytes::short(slot, 9),
                tau: bytes::short(slot, 11),
                raw: bytes::take(slot, 13),
                temperature_c: slot[23].cast_signed(),
                reserve: bytes::take(slot, 24),
            }
        });
        let state = Self {
            opening: bytes::take(raw, 2),
            quaternion_wxyz: bytes::floats(raw, 22),
            gyroscope_rad_s: bytes::floats(raw, 38),
            accelerometer_m_s2: bytes::floats(raw, 50),
            rpy_rad: bytes::floats(raw, 62),
            imu_temperature_c: raw[74].cast_signed(),
            motors,
            battery: Battery::decode(&raw[715..739]),
            feet: std::array::from_fn(|foot| bytes::short(raw, 739 + 2 * foot)),
            tick_ms: u32::from_le_bytes(bytes::take(raw, 755)),
            remote_bytes: bytes::take(raw, 759),
            reserve: bytes::take(raw, 799),
        };
        Ok((state, kind))
    }

    /// Its 807 bytes; a board sends 13 more.
    pub fn encode(&self, kind: Checksum) -> [u8; LENGTH] {
        let mut raw = [0; LENGTH];
        bytes::put(&mut raw, 0, HEAD);
        bytes::put(&mut raw, 2, self.opening);
        bytes::put_floats(&mut raw, 22, &self.quaternion_wxyz);
        bytes::put_floats(&mut raw, 38, &self.gyroscope_rad_s);
        bytes::put_floats(&mut raw, 50, &self.accelerometer_m_s2);
        bytes::put_floats(&mut raw, 62, &self.rpy_rad);
        raw[74] = self.imu_temperature_c.cast_unsigned();
        for (motor, slot) in self.motors.iter().zip(raw[FIRST..].chunks_exact_mut(SLOT)) {
            slot[0] = motor.mode;
            bytes::put_floats(slot, 1, &[motor.q_rad, motor.dq_rad_s]);
            bytes::put(slot, 9, motor.ddq_rad_s2.to_le_bytes());
            bytes::put(slot, 11, motor.tau.to_le_bytes());
            bytes::put(slot, 13, motor.raw);
            slot[23] = motor.temperature_c.cast_unsigned();
            bytes::put(slot, 24, motor.reserve);
        }
        self.battery.encode(&mut raw[715..739]);
        for (foot, counts) in self.feet.iter().enumerate() {
            bytes::put(&mut raw, 739 + 2 * foot, counts.to_le_bytes());
        }
        bytes::put(&mut raw, 755, self.tick_ms.to_le_bytes());
        bytes::put(&mut raw, 759, self.remote_bytes);
        bytes::put(&mut raw, 799, self.reserve);
        let sum = kind.seal(checksum::of_words(&raw));
        bytes::put(&mut raw, LENGTH - 4, sum.to_le_bytes());
        raw
    }
}
