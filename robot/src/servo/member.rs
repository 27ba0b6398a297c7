//! One servo of the bus: brought to its settings, given goals, judged by its answers.

use locoman_protocol::clock::monotonic_ns;

use super::{
    Angles, ServoCommand, ServoError, ServoSettings,
    bus::Bus,
    line::Line,
    place::Place,
    registers::{self as reg, CURRENT_STEP_A, VELOCITY_STEP_RAD_S},
    state::ServoState,
    wire::{HardwareError, Status},
    zeros::Zero,
};

/// A servo and what is known of it.
#[derive(Debug, Clone)]
pub struct Member {
    pub place: Place,
    pub id: u8,
    pub state: ServoState,
    pub firmware: u8,
    /// Answers lost in a row.
    pub lost_in_row: u32,
    /// The servo's answers say that it has an error that has not been read yet.
    pub alert: bool,
    zero: Zero,
    angles: Angles,
    /// Where the goal stands, rad.
    goal_rad: f64,
    /// It has been taken hold of and has not come to its goal yet.
    catching_up: bool,
    /// Share of the permitted current that the command asks for.
    effort: f64,
    /// The goal current that the servo has been told, steps.
    told_current: u16,
}

impl Member {
    pub fn new(place: Place, zero: Zero, settings: &ServoSettings) -> Self {
        Self {
            place,
            id: settings.id(place),
            state: ServoState::default(),
            firmware: 0,
            lost_in_row: 0,
            alert: false,
            zero,
            angles: Angles::new(zero, settings.range_rad(place)),
            goal_rad: 0.0,
            catching_up: true,
            effort: 0.0,
            told_current: 0,
        }
    }

    /// Checks the servo's kept settings, finds its turn and brings it under torque, limp, where it stands.
    pub fn adopt<L: Line>(&mut self, bus: &mut Bus<L>, settings: &ServoSettings) -> Result<(), ServoError> {
        let id = self.id;
        let kept = bus.read(id, reg::KEPT, "settings")?.data;
        self.check(&kept, settings)?;
        let error = HardwareError(bus.read_register(id, reg::HARDWARE_ERROR)? as u8);
        self.state.error = error;
        if !error.is_none() {
            return Err(ServoError::Hardware { id, place: self.place, error });
        }
        let count = bus.read_register(id, reg::PRESENT_POSITION)? as i32;
        let range_rad = settings.range_rad(self.place);
        self.angles = Angles::new(self.zero, range_rad)
            .resolved(count)
            .map_err(|angle_rad| ServoError::Range { id, place: self.place, angle_rad, range_rad })?;
        let gains = &settings.gains;
        let limb = self.place.in_limb();
        // A tripped watchdog lets no goal through until it is cleared.
        bus.write(id, reg::BUS_WATCHDOG, 0)?;
        bus.write(id, reg::POSITION_P, gains.p[limb].into())?;
        bus.write(id, reg::POSITION_I, 0)?;
        bus.write(id, reg::POSITION_D, gains.d[limb].into())?;
        let steps = |value: f64, step: f64| (value / step).round() as u32;
        let speed = steps(gains.profile_speed_rad_s, VELOCITY_STEP_RAD_S);
        let acceleration = steps(gains.profile_acceleration_rad_s2, reg::ACCELERATION_STEP_RAD_S2);
        bus.write(id, reg::PROFILE_VELOCITY, speed)?;
        bus.write(id, reg::PROFILE_ACCELERATION, acceleration)?;
        bus.write(id, reg::GOAL_CURRENT, 0)?;
        bus.write(id, reg::GOAL_POSITION, count as u32)?;
        bus.write(id, reg::TORQUE_ENABLE, 1)?;
        bus.write(id, reg::BUS_WATCHDOG, settings.watchdog_ms / reg::WATCHDOG_STEP_MS)?;
        self.goal_rad = self.angles.angle_rad(count);
        self.state.position_rad = self.goal_rad;
        self.state.sample_ns = monotonic_ns();
        (self.told_current, self.effort, self.lost_in_row, self.alert) = (0, 0.0, 0, false);
        self.catching_up = true;
        self.state.present = true;
        Ok(())
    }

    fn check(&mut self, kept: &[u8], settings: &ServoSettings) -> Result<(), ServoError> {
        let (id, place) = (self.id, self.place);
        let model = u16::from_le_bytes(reg::MODEL_NUMBER.bytes(kept));
        if model != reg::MODEL {
            return Err(ServoError::Model { id, place, model });
        }
        self.firmware = reg::FIRMWARE.bytes(kept)[0];
        for (register, expected) in reg::kept_settings() {
            let found = register.value(kept);
            if found != expected {
                return Err(ServoError::Setup { id, place, register: register.name, found, expected });
            }
        }
        let permitted = i64::from(u16::from_le_bytes(reg::CURRENT_LIMIT.bytes(kept)));
        let needed = (settings.current_a(place) / CURRENT_STEP_A).round() as i64;
        if permitted < needed {
            let register = reg::CURRENT_LIMIT.name;
            return Err(ServoError::Setup { id, place, register, found: permitted, expected: needed });
        }
        Ok(())
    }

    /// The goal for this cycle, counts: towards the command no faster than the settings permit.
    pub fn goal(&mut self, command: &ServoCommand, settings: &ServoSettings, elapsed_s: f64) -> i32 {
        self.effort = command.effort.clamp(0.0, 1.0);
        if self.effort == 0.0 {
            // Whoever takes hold again begins from where the joint is then.
            self.goal_rad = self.state.position_rad;
            self.catching_up = true;
            return self.angles.count(self.goal_rad);
        }
        let speed_rad_s = if self.catching_up { settings.catch_up_rad_s } else { settings.max_speed_rad_s };
        let step_rad = speed_rad_s * elapsed_s;
        let mut wished = self.angles.within_range(command.position_rad);
        if self.place.is_gripper() {
            let lead_rad = settings.gripper.lead_rad;
            wished = wished.clamp(self.state.position_rad - lead_rad, self.state.position_rad + lead_rad);
        }
        let way_rad = wished - self.goal_rad;
        self.goal_rad += way_rad.clamp(-step_rad, step_rad);
        self.catching_up &= way_rad.abs() > step_rad;
        let most = settings.motor.stall_torque_n_m;
        let torque = command.torque_n_m + settings.back_emf_n_m_s() * command.velocity_rad_s;
        let offset_rad = torque.clamp(-most, most) / settings.stiffness_n_m_rad(self.place);
        self.angles.count(self.goal_rad + offset_rad)
    }

    /// The count of a joint's angle.
    pub fn count(&self, angle_rad: f64) -> i32 {
        self.angles.count(angle_rad)
    }

    /// The joint's angle at a count, rad.
    pub fn angle_rad(&self, count: i32) -> f64 {
        self.angles.angle_rad(count)
    }

    /// The goal current that the servo must be told, steps; nothing if it knows.
    pub fn current_to_tell(&mut self, settings: &ServoSettings) -> Option<u16> {
        let current = (self.effort * settings.current_a(self.place) / CURRENT_STEP_A).round() as u16;
        (current != self.told_current).then(|| {
            self.told_current = current;
            current
        })
    }

    /// Takes in an answer to a read of [`reg::MOTION`].
    pub fn take_motion(&mut self, status: &Status, settings: &ServoSettings, now_ns: u64) {
        let data = &status.data;
        let first = reg::MOTION.address;
        let steps = |bytes| f64::from(i32::from_le_bytes(bytes));
        let current = f64::from(i16::from_le_bytes(reg::PRESENT_CURRENT.bytes_in(data, first)));
        let sign = self.angles.sign();
        self.state.current_a = sign * current * CURRENT_STEP_A;
        self.state.torque_n_m = self.state.current_a * settings.torque_constant();
        self.state.velocity_rad_s =
            sign * steps(reg::PRESENT_VELOCITY.bytes_in(data, first)) * VELOCITY_STEP_RAD_S;
        let count = i32::from_le_bytes(reg::PRESENT_POSITION.bytes_in(data, first));
        self.state.position_rad = self.angles.angle_rad(count);
        self.state.sample_ns = now_ns;
        self.lost_in_row = 0;
        self.alert |= status.alert && self.state.error.is_none();
    }

    /// An answer did not come.
    pub fn lose(&mut self) {
        self.state.lost += 1;
        self.lost_in_row += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::servo::registers::RAD_PER_COUNT;

    /// One cycle, s.
    const PERIOD_S: f64 = 0.005;

    fn member(place: Place) -> (Member, ServoSettings) {
        let settings = ServoSettings::default();
        let zero = Zero { id: settings.id(place), sign: 1, count: 0 };
        (Member::new(place, zero, &settings), settings)
    }

    #[test]
    fn a_servo_that_is_taken_hold_of_comes_slowly_and_follows_fast_from_then_on() {
        let (mut sut, settings) = member(Place::ALL[0]);
        let mut way_rad = |to: f64, cycles: usize| {
            let before = sut.goal_rad;
            for _ in 0..cycles {
                sut.goal(&ServoCommand::at(to), &settings, PERIOD_S);
            }
            sut.goal_rad - before
        };
        assert!((way_rad(1.0, 100) - 0.5).abs() < 1e-9);
        way_rad(1.0, 101);
        assert!((way_rad(-1.0, 10) + 0.34).abs() < 1e-9);
    }

    #[test]
    fn goals_keep_to_the_joints_range_and_to_what_the_motor_can_do() {
        let (mut sut, settings) = member(Place::ALL[1]);
        let most = settings.motor.stall_torque_n_m / settings.stiffness_n_m_rad(sut.place);
        let strong = ServoCommand { torque_n_m: 1e9, ..ServoCommand::at(1e9) };
        let mut count = 0;
        for _ in 0..1000 {
            count = sut.goal(&strong, &settings, PERIOD_S);
        }
        assert!((f64::from(count) * RAD_PER_COUNT - (0.6 + most)).abs() < RAD_PER_COUNT);
    }

    #[test]
    fn jaws_that_hold_something_are_not_pressed_beyond_the_lead() {
        let (mut sut, settings) = member(Place::ALL[6]);
        sut.state.position_rad = 0.5;
        let mut count = 0;
        for _ in 0..1000 {
            count = sut.goal(&ServoCommand::at(0.02), &settings, PERIOD_S);
        }
        assert!((f64::from(count) * RAD_PER_COUNT - 0.3).abs() < RAD_PER_COUNT);
    }
}
