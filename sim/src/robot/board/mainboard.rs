//! The board itself: datagrams in, joint commands out; samples in, datagrams out. No socket, no clock.

use std::f64::consts::PI;

use locoman_robot::go1::{
    Battery, Checksum, Feet, LowCommand, LowState, MOTORS, MotorCommand, MotorState, command, state,
};
use locoman_robot::plant::{JointCommand, Sensors};

use super::Faults;

/// What a motor shows that protects itself, °C: its protection begins there.
const PROTECTED_C: i8 = 95;
/// Temperatures in normal use, °C.
const MOTOR_C: i8 = 42;
const BATTERY_C: i8 = 31;
/// A charged battery: percent, and its cells in steps of 32 mV.
const CHARGE_PERCENT: u8 = 87;
const CELL_STEPS: u8 = 122;
/// Resistance of a motor without a command, N m s/rad: its gears, and its short-circuited windings.
const BRAKE_KD: f64 = 3.0;
const DEAD_KD: f64 = 0.3;
/// L2 and B of the remote control.
const CHORD: u16 = 0x0220;

/// What the board remembers.
#[derive(Debug, Clone)]
pub struct Mainboard {
    feet: Feet,
    latched: Option<LowCommand>,
    refused: u64,
}

impl Mainboard {
    /// A board that has just been switched on.
    pub fn new(feet: Feet) -> Self {
        Self { feet, latched: None, refused: 0 }
    }

    /// Takes a datagram in; the command in it, if it is a good one: of either checksum, of the right length.
    pub fn take(&mut self, datagram: &[u8]) -> Option<&LowCommand> {
        let is_low_level = datagram.len() == command::LENGTH && datagram[2] == 0xFF;
        match LowCommand::decode(datagram) {
            Ok((command, _)) if is_low_level => Some(self.latched.insert(command)),
            _ => {
                self.refused += 1;
                None
            }
        }
    }

    /// Datagrams that were no commands.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Whether it has been woken by a first command.
    pub fn is_awake(&self) -> bool {
        self.latched.is_some()
    }

    /// The legs' part of the latched command in place of that of `arms`; damped before the first one.
    pub fn joint_command(&self, arms: &JointCommand, faults: &Faults) -> JointCommand {
        let mut joints = *arms;
        for motor in 0..MOTORS {
            let told = self.latched.map_or(MotorCommand::damping(BRAKE_KD as f32), |it| it.motors[motor]);
            let follows = told.mode == command::SERVO;
            let [mut kp, mut kd] = told.gains();
            if told.q_rad == command::NO_POSITION || !follows {
                kp = 0.0;
            }
            if told.dq_rad_s == command::NO_VELOCITY && follows {
                kd = 0.0;
            }
            let dead = faults.motor_error == Some(motor);
            let (kp, kd, torque) = match (dead, follows) {
                (true, _) => (0.0, DEAD_KD, 0.0),
                (false, true) => (kp, kd, told.torque_n_m()),
                (false, false) => (0.0, BRAKE_KD, 0.0),
            };
            let held = kp > 0.0;
            joints.position[motor] = if held { told.q_rad.into() } else { 0.0 };
            joints.velocity[motor] = if follows && kd > 0.0 && !dead { told.dq_rad_s.into() } else { 0.0 };
            (joints.kp[motor], joints.kd[motor], joints.torque[motor]) = (kp, kd, torque);
        }
        joints
    }

    /// The state datagram of a sample, as long as the board sends it.
    pub fn state(&self, sensors: &Sensors, tick_ms: u32, faults: &Faults) -> Vec<u8> {
        let motors = std::array::from_fn(|slot| {
            if slot < MOTORS { self.motor(slot, sensors, faults) } else { MotorState::default() }
        });
        let mut feet = [0; 8];
        feet[..4].copy_from_slice(&self.feet.counts(&sensors.foot_force));
        let state = LowState {
            opening: opening(),
            quaternion_wxyz: sensors.attitude.map(|part| part as f32),
            gyroscope_rad_s: sensors.gyro.map(|part| part as f32),
            accelerometer_m_s2: sensors.accelerometer.map(|part| part as f32),
            rpy_rad: roll_pitch_yaw(&sensors.attitude),
            imu_temperature_c: 45,
            motors,
            battery: battery(faults),
            feet,
            tick_ms,
            remote_bytes: remote(faults.remote_stop),
            reserve: [0; 4],
        };
        let mut datagram = state.encode(Checksum::Plain).to_vec();
        datagram.resize(state::SENT, 0);
        datagram
    }

    fn motor(&self, motor: usize, sensors: &Sensors, faults: &Faults) -> MotorState {
        let dead = faults.motor_error == Some(motor);
        let told = self.latched.map_or(command::BRAKE, |it| it.motors[motor].mode);
        let torque = MotorCommand::servo(0.0, 0.0, sensors.torque[motor] as f32, 0.0, 0.0);
        MotorState {
            mode: if dead { 0x08 } else { told },
            q_rad: sensors.position[motor] as f32,
            dq_rad_s: sensors.velocity[motor] as f32,
            tau: torque.tau,
            temperature_c: if dead { PROTECTED_C } else { faults.motor_c.unwrap_or(MOTOR_C) },
            // What a motor that is too hot was seen to say.
            reserve: if dead { [4, 0, 0, 0, 0, 0, 0, 0] } else { [0; 8] },
            ..MotorState::default()
        }
    }
}

/// Level, an EDU robot's serial number, no version.
fn opening() -> [u8; 20] {
    let mut opening = [0; 20];
    (opening[0], opening[2], opening[3]) = (0xFF, 4, 3);
    opening
}

fn battery(faults: &Faults) -> Battery {
    let mut cells = [0; 10];
    cells[..6].fill(CELL_STEPS);
    if let Some(mv) = faults.cell_mv {
        cells[3] = u8::try_from(mv / 32).unwrap_or(u8::MAX);
    }
    Battery {
        version: [1, 9],
        status: 1,
        charge_percent: faults.battery_percent.unwrap_or(CHARGE_PERCENT),
        current_ma: -2500,
        cycles: 42,
        temperatures_c: [faults.battery_c.unwrap_or(BATTERY_C); 4],
        cells,
    }
}

/// A remote control that is switched on, its sticks in the middle.
fn remote(stop: bool) -> [u8; 40] {
    let mut raw = [0; 40];
    raw[..2].copy_from_slice(&[0x55, 0x51]);
    let buttons = if stop { CHORD } else { 0 };
    raw[2..4].copy_from_slice(&buttons.to_le_bytes());
    raw
}

/// Of an attitude w, x, y, z.
fn roll_pitch_yaw(attitude: &[f64; 4]) -> [f32; 3] {
    let [w, x, y, z] = *attitude;
    let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
    let pitch = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin().clamp(-PI, PI);
    let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    [roll as f32, pitch as f32, yaw as f32]
}

#[cfg(test)]
mod tests {
    use locoman_robot::go1::MotorMode;
    use locoman_robot::joints::JointVector;

    use super::*;

    fn standing() -> LowCommand {
        let mut command = LowCommand::default();
        for (motor, slot) in command.motors[..MOTORS].iter_mut().enumerate() {
            *slot = MotorCommand::servo(0.1 * motor as f32, 0.5, -1.5, 60.0, 2.0);
        }
        command
    }

    fn sample() -> Sensors {
        Sensors {
            time_ns: 0,
            position: JointVector::from_fn(|joint, _| 0.1 * joint as f64),
            velocity: JointVector::repeat(-0.25),
            torque: JointVector::repeat(3.5),
            opening: [0.0; 2],
            attitude: [1.0, 0.0, 0.0, 0.0],
            gyro: [0.01, 0.02, 0.03],
            accelerometer: [0.0, 0.0, 9.81],
            foot_force: [30.0, 31.0, 32.0, 33.0],
        }
    }

    #[test]
    fn only_a_good_command_wakes_it_and_stays_in_force() {
        let mut sut = Mainboard::new(Feet::default());
        let good = standing().encode(Checksum::Encrypted);
        let mut wrong_checksum = good;
        wrong_checksum[50] ^= 1;
        let mut high_level = good;
        high_level[2] = 0xEE;
        for bad in [&wrong_checksum[..], &high_level, &good[..613], b"", &[0; 700]] {
            assert!(sut.take(bad).is_none());
        }
        assert!(!sut.is_awake() && sut.refused() == 5);
        assert!(sut.take(&good).is_some() && sut.is_awake());
        assert!(sut.take(&wrong_checksum).is_none());
        let told = sut.joint_command(&JointCommand::damping(), &Faults::default());
        assert_eq!((told.kp[3], told.kd[3], told.torque[3]), (60.0, 2.0, -1.5));
        assert!((told.position[3] - 0.3).abs() < 1e-6);
        assert_eq!(told.kd[12], JointCommand::damping().kd[12], "the arms are none of its business");
    }

    #[test]
    fn idle_braked_and_protected_motors_give_no_torque() {
        let mut sut = Mainboard::new(Feet::default());
        assert!(sut.take(&LowCommand::default().encode(Checksum::Plain)).is_some());
        let idle = sut.joint_command(&JointCommand::damping(), &Faults::default());
        assert!(idle.is_finite() && idle.kp[0] == 0.0 && idle.kd[0] == 0.0);
        let mut brake = standing();
        brake.motors[0].mode = command::BRAKE;
        sut.take(&brake.encode(Checksum::Plain));
        let faults = Faults { motor_error: Some(1), ..Faults::default() };
        let told = sut.joint_command(&JointCommand::damping(), &faults);
        assert_eq!((told.kp[0], told.kd[0], told.torque[0]), (0.0, BRAKE_KD, 0.0));
        assert_eq!((told.kp[1], told.kd[1], told.torque[1]), (0.0, DEAD_KD, 0.0));
        assert_eq!(told.kp[2], 60.0);
    }

    #[test]
    fn its_state_says_what_was_measured_and_what_is_wrong() {
        let mut sut = Mainboard::new(Feet::default());
        sut.take(&standing().encode(Checksum::Plain));
        let faults = Faults {
            motor_error: Some(4),
            battery_percent: Some(7),
            cell_mv: Some(3072),
            remote_stop: true,
            ..Faults::default()
        };
        let datagram = sut.state(&sample(), 1234, &faults);
        assert_eq!(datagram.len(), state::SENT);
        let (told, kind) = LowState::decode(&datagram).unwrap();
        assert_eq!((told.tick_ms, kind), (1234, Checksum::Plain));
        assert_eq!((told.motors[3].q_rad, told.motors[3].torque_n_m()), (0.3_f64 as f32, 3.5));
        assert_eq!(told.motors[3].mode(), MotorMode::Servo);
        assert_eq!(told.motors[4].mode(), MotorMode::Protection);
        assert_eq!((told.battery.charge_percent, told.battery.cell_mv(3)), (7, Some(3072)));
        assert!(told.remote().unwrap().asks_for_stop());
        assert_eq!(Feet::default().force_n(&told.feet), [30.0, 31.0, 32.0, 33.0]);
    }
}
