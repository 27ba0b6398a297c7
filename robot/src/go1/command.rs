//! The low-level command, 614 bytes: what each motor's own loop shall do.
//!
//! A motor's torque is `tau + kp (q − measured q) + kd (dq − measured dq)`. Torques and gains are fixed point,
//! cut towards zero. The maker's library lets them overflow: 128 N m becomes −128 N m. Here they are clamped
//! first. The battery's four bytes, one of which switches the robot off, are always written as zero.

use super::{Checksum, DatagramError, HEAD, SLOTS, bytes, checked, checksum};
use crate::joints::Leg;

/// Bytes of a command.
pub const LENGTH: usize = 614;
/// Says "no position control" in a command's position.
pub const NO_POSITION: f32 = 2.146e9;
/// Says "no velocity control" in a command's velocity.
pub const NO_VELOCITY: f32 = 16_000.0;
/// The motor follows its command.
pub const SERVO: u8 = 0x0A;
/// The motor brakes by itself.
pub const BRAKE: u8 = 0x00;
/// Motors of the legs, in the first slots.
pub const MOTORS: usize = 3 * Leg::ALL.len();
/// "Low level" in the third byte.
const LOW_LEVEL: u8 = 0xFF;
/// Where slots begin, and their length.
const FIRST: usize = 22;
const SLOT: usize = 27;

/// One motor's slot, in the numbers of the wire.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorCommand {
    /// [`SERVO`] or [`BRAKE`].
    pub mode: u8,
    /// Position, rad, or [`NO_POSITION`].
    pub q_rad: f32,
    /// Velocity, rad/s, or [`NO_VELOCITY`].
    pub dq_rad_s: f32,
    /// Torque, 1/256 N m.
    pub tau: i16,
    /// Position gain, 1/32 N m/rad.
    pub kp: u16,
    /// Velocity gain, 1/16 N m s/rad.
    pub kd: u16,
    /// Without known meaning.
    pub reserve: [u8; 12],
}

impl MotorCommand {
    /// A slot that asks for nothing.
    pub const IDLE: Self = Self {
        mode: SERVO,
        q_rad: NO_POSITION,
        dq_rad_s: NO_VELOCITY,
        tau: 0,
        kp: 0,
        kd: 0,
        reserve: [0; 12],
    };

    /// A servo's command: rad, rad/s, N m, N m/rad, N m s/rad. If a number is none, the motor is damped.
    pub fn servo(q_rad: f32, dq_rad_s: f32, tau_n_m: f32, kp: f32, kd: f32) -> Self {
        if ![q_rad, dq_rad_s, tau_n_m, kp, kd].iter().all(|number| number.is_finite()) {
            return Self::damping(2.0);
        }
        Self {
            q_rad,
            dq_rad_s,
            tau: (tau_n_m.clamp(-127.99, 127.99) * 256.0) as i16,
            kp: (kp.clamp(0.0, 1023.0) * 32.0) as u16,
            kd: (kd.clamp(0.0, 2047.0) * 16.0) as u16,
            ..Self::IDLE
        }
    }

    /// Torque, N m.
    pub fn torque_n_m(&self) -> f64 {
        f64::from(self.tau) / 256.0
    }

    /// Position gain, N m/rad, and velocity gain, N m s/rad.
    pub fn gains(&self) -> [f64; 2] {
        [f64::from(self.kp) / 32.0, f64::from(self.kd) / 16.0]
    }

    /// Resists motion by `kd` N m s/rad and does nothing else.
    pub fn damping(kd: f32) -> Self {
        Self { kd: (kd.clamp(0.0, 2047.0) * 16.0) as u16, dq_rad_s: 0.0, ..Self::IDLE }
    }
}

/// A command datagram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowCommand {
    /// Bytes 3 to 21 without known use: frame reserve, serial number, version, bandwidth.
    pub opening: [u8; 19],
    /// The slots.
    pub motors: [MotorCommand; SLOTS],
    /// The remote control's part, and a reserve.
    pub closing: [u8; 44],
}

impl Default for LowCommand {
    /// Nothing is asked of any motor.
    fn default() -> Self {
        Self { opening: [0; 19], motors: [MotorCommand::IDLE; SLOTS], closing: [0; 44] }
    }
}

impl LowCommand {
    /// All legs damped by `kd` N m s/rad.
    pub fn damping(kd: f32) -> Self {
        let mut command = Self::default();
        command.motors[..MOTORS].fill(MotorCommand::damping(kd));
        command
    }

    /// Its datagram.
    pub fn encode(&self, kind: Checksum) -> [u8; LENGTH] {
        let mut raw = [0; LENGTH];
        bytes::put(&mut raw, 0, HEAD);
        raw[2] = LOW_LEVEL;
        bytes::put(&mut raw, 3, self.opening);
        for (motor, slot) in self.motors.iter().zip(raw[FIRST..].chunks_exact_mut(SLOT)) {
            slot[0] = motor.mode;
            bytes::put_floats(slot, 1, &[motor.q_rad, motor.dq_rad_s]);
            bytes::put(slot, 9, motor.tau.to_le_bytes());
            bytes::put(slot, 11, motor.kp.to_le_bytes());
            bytes::put(slot, 13, motor.kd.to_le_bytes());
            bytes::put(slot, 15, motor.reserve);
        }
        bytes::put(&mut raw, 566, self.closing);
        let sum = kind.seal(checksum::of_words(&raw));
        bytes::put(&mut raw, LENGTH - 4, sum.to_le_bytes());
        raw
    }

    /// Reads a datagram, and how its checksum is written. The battery's bytes are passed over.
    pub fn decode(datagram: &[u8]) -> Result<(Self, Checksum), DatagramError> {
        let (raw, kind) = checked::<LENGTH>(datagram)?;
        let motors = std::array::from_fn(|motor| {
            let slot = &raw[FIRST + SLOT * motor..];
            MotorCommand {
                mode: slot[0],
                q_rad: bytes::float(slot, 1),
                dq_rad_s: bytes::float(slot, 5),
                tau: bytes::short(slot, 9),
                kp: u16::from_le_bytes(bytes::take(slot, 11)),
                kd: u16::from_le_bytes(bytes::take(slot, 13)),
                reserve: bytes::take(slot, 15),
            }
        });
        Ok((Self { opening: bytes::take(raw, 3), motors, closing: bytes::take(raw, 566) }, kind))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_beyond_the_wire_are_clamped_and_never_change_sign() {
        let motor = MotorCommand::servo(0.0, 0.0, 200.0, 5000.0, -1.0);
        assert_eq!((motor.tau, motor.kp, motor.kd), (32765, 32736, 0));
        assert_eq!(MotorCommand::servo(0.0, 0.0, -200.0, 0.03, 0.06).tau, -32765);
    }

    #[test]
    fn a_number_that_is_none_damps_its_motor() {
        assert_eq!(MotorCommand::servo(f32::NAN, 0.0, 1.0, 60.0, 2.0), MotorCommand::damping(2.0));
    }
}
