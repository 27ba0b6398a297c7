//! One virtual servo: its table, its motion, its watchdog and its faults.
//!
//! Without a robot in front of it, it moves by itself: towards its goal as fast as its motor can, with no more than
//! the goal current. With one ([`VirtualServo::feed`]), it measures what it is fed and only hands its goal out.

use std::time::Duration;

use locoman_robot::servo::registers::{self as reg, CURRENT_STEP_A, VELOCITY_STEP_RAD_S};
use locoman_robot::servo::wire::{HardwareError, Refusal, Request, Status};
use locoman_robot::servo::{Angles, Motor};

use super::fault::ServoFault;
use super::table::Table;

/// A self-moving servo comes as near as 1/e in this time, s.
const TIME_CONSTANT_S: f64 = 0.02;
/// Hotter than any limit, °C.
const OVERHEATED_C: i64 = 78;
/// As it is at rest, °C.
const REST_C: i64 = 30;

/// What a joint does, measured by its servo.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointMotion {
    /// rad.
    pub position_rad: f64,
    /// rad/s.
    pub velocity_rad_s: f64,
    /// What the servo's motor gives, N m.
    pub torque_n_m: f64,
}

/// What a servo has been told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoGoal {
    /// Goal of the joint's angle, rad.
    pub position_rad: f64,
    /// The most current that it may take, A; 0 without torque.
    pub current_a: f64,
}

/// One servo.
#[derive(Debug, Clone)]
pub struct VirtualServo {
    pub(super) table: Table,
    angles: Angles,
    motor: Motor,
    /// Position of the joint, its speed and the motor's torque.
    motion: JointMotion,
    fed: bool,
    /// Counts that the encoder has beyond the joint's angle: whole turns that it forgot when it was switched on.
    forgotten: i32,
    registered: Option<(u16, Vec<u8>)>,
    stepped_ns: u64,
    heard_ns: u64,
    powered: bool,
    late: Duration,
    damaged: u32,
    mute: u32,
}

impl VirtualServo {
    /// A servo with this table whose joint stands at an angle; `angles` is how it was assembled.
    pub fn new(table: Table, angles: Angles, motor: Motor, position_rad: f64) -> Self {
        let motion = JointMotion { position_rad, ..JointMotion::default() };
        let mut servo = Self {
            table,
            angles,
            motor,
            motion,
            fed: false,
            forgotten: 0,
            registered: None,
            stepped_ns: 0,
            heard_ns: 0,
            powered: true,
            late: Duration::ZERO,
            damaged: 0,
            mute: 0,
        };
        servo.restart();
        servo
    }

    /// Its id.
    pub fn id(&self) -> u8 {
        self.table.get(reg::ID) as u8
    }

    /// Its baud rate.
    pub fn baud(&self) -> u32 {
        let code = self.table.get(reg::BAUD_RATE);
        reg::BAUD_RATES.iter().find(|(known, _)| i64::from(*known) == code).map_or(0, |(_, rate)| *rate)
    }

    /// Whether it has power.
    pub fn is_powered(&self) -> bool {
        self.powered
    }

    /// From the last bit of a request to the first of its answer.
    pub fn answer_delay(&self) -> Duration {
        Duration::from_micros(2 * self.table.get(reg::RETURN_DELAY) as u64) + self.late
    }

    /// Takes in what the joint does.
    pub fn feed(&mut self, motion: JointMotion) {
        self.motion = motion;
        self.fed = true;
    }

    /// Where the joint is.
    pub fn motion(&self) -> JointMotion {
        self.motion
    }

    /// What it has been told.
    pub fn goal(&self) -> ServoGoal {
        let torque_on = self.table.get(reg::TORQUE_ENABLE) == 1;
        let current = if torque_on { self.table.get(reg::GOAL_CURRENT).abs() } else { 0 };
        let count = self.table.get(reg::GOAL_POSITION) as i32;
        ServoGoal {
            position_rad: self.angles.angle_rad(count + self.forgotten),
            current_a: current as f64 * CURRENT_STEP_A,
        }
    }

    /// Something happens to it.
    pub fn inject(&mut self, fault: ServoFault) {
        match fault {
            ServoFault::Overheats => {
                self.table.put(reg::PRESENT_TEMPERATURE, OVERHEATED_C);
                self.fail(HardwareError::HEAT);
            }
            ServoFault::Overloads => self.fail(HardwareError::OVERLOAD),
            ServoFault::Vanishes => {
                self.powered = false;
                self.table.put(reg::TORQUE_ENABLE, 0);
            }
            ServoFault::Returns => {
                self.powered = true;
                self.table.put(reg::PRESENT_TEMPERATURE, REST_C);
                self.restart();
            }
            ServoFault::Late(delay) => self.late = delay,
            ServoFault::Damaged(answers) => self.damaged = answers,
            ServoFault::Mute(answers) => self.mute = answers,
        }
    }

    /// Lets time pass: the joint moves, the watchdog may trip, registers show what is measured.
    pub fn step(&mut self, now_ns: u64) {
        let elapsed_s = now_ns.saturating_sub(self.stepped_ns) as f64 * 1e-9;
        self.stepped_ns = now_ns;
        let patience = self.table.get(reg::BUS_WATCHDOG);
        let armed = (1..=i64::from(reg::WATCHDOG_MAX_STEPS)).contains(&patience) && self.torque_on();
        let patience_ns = patience as u64 * u64::from(reg::WATCHDOG_STEP_MS) * 1_000_000;
        if armed && now_ns.saturating_sub(self.heard_ns) > patience_ns {
            self.table.put(reg::BUS_WATCHDOG, reg::WATCHDOG_TRIPPED.into());
            self.table.put(reg::GOAL_POSITION, self.count().into());
        }
        if !self.fed {
            self.move_itself(elapsed_s);
        }
        self.measure();
    }

    /// Notes that a packet came: the bus watchdog is satisfied.
    pub fn hear(&mut self, now_ns: u64) {
        self.heard_ns = now_ns;
    }

    /// Does what it alone is told and answers.
    pub fn answer(&mut self, request: &Request) -> Option<Status> {
        let level = self.table.get(reg::STATUS_RETURN_LEVEL);
        let answered_from = match request {
            Request::Ping => 0,
            Request::Read(_) => 1,
            _ => 2,
        };
        let id = self.id();
        let outcome = match request {
            Request::Ping => {
                let [a, b] = (self.table.get(reg::MODEL_NUMBER) as u16).to_le_bytes();
                Ok(vec![a, b, self.table.get(reg::FIRMWARE) as u8])
            }
            Request::Read(span) => self.table.read(*span).map(<[u8]>::to_vec),
            Request::Write { address, data, registered: false } => {
                self.write(*address, data).map(|()| vec![])
            }
            Request::Write { address, data, registered: true } => {
                self.registered = Some((*address, data.clone()));
                Ok(vec![])
            }
            Request::Action => match self.registered.take() {
                Some((address, data)) => self.write(address, &data).map(|()| vec![]),
                None => Err(Refusal::Failed),
            },
            Request::Reboot => {
                self.restart();
                Ok(vec![])
            }
            _ => Err(Refusal::Instruction),
        };
        (level >= answered_from).then(|| self.status(id, outcome))
    }

    /// An answer with what was read, and the alert.
    pub fn status(&self, id: u8, outcome: Result<Vec<u8>, Refusal>) -> Status {
        let alert = self.table.get(reg::HARDWARE_ERROR) != 0;
        match outcome {
            Ok(data) => Status { id, refusal: None, alert, data },
            Err(refusal) => Status { id, refusal: Some(refusal), alert, data: vec![] },
        }
    }

    /// Writes registers; a joint that is taken hold of holds where it is.
    pub fn write(&mut self, address: u16, data: &[u8]) -> Result<(), Refusal> {
        let was_on = self.torque_on();
        self.table.write(address, data)?;
        if self.torque_on() && !was_on && address == reg::TORQUE_ENABLE.address {
            self.table.put(reg::GOAL_POSITION, self.count().into());
        }
        Ok(())
    }

    /// Whether the next answer is lost.
    pub fn is_mute(&mut self) -> bool {
        let mute = self.mute > 0;
        self.mute = self.mute.saturating_sub(1);
        mute
    }

    /// Whether the next answer is damaged.
    pub fn is_damaged(&mut self) -> bool {
        let damaged = self.damaged > 0;
        self.damaged = self.damaged.saturating_sub(1);
        damaged
    }

    fn torque_on(&self) -> bool {
        self.table.get(reg::TORQUE_ENABLE) == 1
    }

    fn count(&self) -> i32 {
        self.angles.count(self.motion.position_rad) - self.forgotten
    }

    fn fail(&mut self, error: u8) {
        self.table.put(reg::HARDWARE_ERROR, self.table.get(reg::HARDWARE_ERROR) | i64::from(error));
        if self.table.get(reg::SHUTDOWN) & i64::from(error) != 0 {
            self.table.put(reg::TORQUE_ENABLE, 0);
        }
    }

    /// As when it is switched on: it knows its angle within a turn.
    fn restart(&mut self) {
        self.table.restart();
        self.registered = None;
        let absolute = self.angles.count(self.motion.position_rad);
        self.forgotten = absolute - absolute.rem_euclid(reg::COUNTS_PER_TURN);
        self.table.put(reg::GOAL_POSITION, self.count().into());
        self.measure();
    }

    fn move_itself(&mut self, elapsed_s: f64) {
        let ServoGoal { position_rad, current_a } = self.goal();
        let share = (current_a / self.motor.stall_current_a).min(1.0);
        let error = position_rad - self.motion.position_rad;
        let most = share * self.motor.no_load_speed_rad_s * elapsed_s;
        let way = (error * (1.0 - (-elapsed_s / TIME_CONSTANT_S).exp())).clamp(-most, most);
        self.motion = JointMotion {
            position_rad: self.motion.position_rad + way,
            velocity_rad_s: if elapsed_s > 0.0 { way / elapsed_s } else { 0.0 },
            torque_n_m: 0.0,
        };
    }

    fn measure(&mut self) {
        let sign = self.angles.sign();
        let amperes = self.motion.torque_n_m / self.motor.stall_torque_n_m * self.motor.stall_current_a;
        self.table.put(reg::PRESENT_CURRENT, (sign * amperes / CURRENT_STEP_A).round() as i64);
        let velocity = sign * self.motion.velocity_rad_s / VELOCITY_STEP_RAD_S;
        self.table.put(reg::PRESENT_VELOCITY, velocity.round() as i64);
        self.table.put(reg::PRESENT_POSITION, self.count().into());
    }
}

#[cfg(test)]
mod tests {
    use locoman_robot::servo::{Place, ServoSettings, Zero};

    use super::*;

    /// ns.
    const MS: u64 = 1_000_000;

    fn followed() -> VirtualServo {
        let settings = ServoSettings::default();
        let angles = Angles::new(Zero { id: 1, sign: -1, count: 2048 }, settings.range_rad(Place::ALL[0]));
        let mut servo = VirtualServo::new(Table::new(52), angles, settings.motor, 0.0);
        servo.write(reg::OPERATING_MODE.address, &[reg::CURRENT_BASED_POSITION]).unwrap();
        servo.write(reg::TORQUE_ENABLE.address, &[1]).unwrap();
        servo.write(reg::GOAL_POSITION.address, &1048i32.to_le_bytes()).unwrap();
        servo
    }

    #[test]
    fn r_safe_036_a_servo_that_hears_nothing_any_more_stops_where_it_is() {
        let mut sut = followed();
        sut.write(reg::BUS_WATCHDOG.address, &[5]).unwrap();
        sut.hear(0);
        (0..=100).for_each(|ms| sut.step(ms * MS));
        let before = sut.motion().position_rad;
        assert!(before > 0.3 && before < 1.5, "it was on its way: {before}");
        (101..300).for_each(|ms| sut.step(ms * MS));
        assert!((sut.motion().position_rad - before).abs() < 0.05);
        let refused = sut.write(reg::GOAL_POSITION.address, &[0; 4]);
        assert_eq!(refused, Err(Refusal::Range), "goals are locked until the watchdog is cleared");
        sut.write(reg::BUS_WATCHDOG.address, &[0]).unwrap();
        sut.write(reg::GOAL_POSITION.address, &[0; 4]).unwrap();
    }

    #[test]
    fn a_servo_that_is_switched_on_knows_its_angle_within_a_turn() {
        let mut sut = followed();
        sut.feed(JointMotion { position_rad: -4.0, ..JointMotion::default() });
        sut.step(MS);
        let before = sut.table.get(reg::PRESENT_POSITION);
        assert!(before > 4096);
        sut.inject(ServoFault::Returns);
        assert_eq!(sut.table.get(reg::PRESENT_POSITION), before - 4096);
    }

    #[test]
    fn a_servo_that_has_shut_down_takes_no_torque_until_it_starts_anew() {
        let mut sut = followed();
        sut.inject(ServoFault::Overheats);
        assert!(sut.status(1, Ok(vec![])).alert);
        assert_eq!(sut.goal().current_a, 0.0);
        assert_eq!(sut.write(reg::TORQUE_ENABLE.address, &[1]), Err(Refusal::Access));
        assert_eq!(sut.answer(&Request::Reboot).map(|status| status.refusal), Some(None));
        sut.write(reg::TORQUE_ENABLE.address, &[1]).unwrap();
    }
}
