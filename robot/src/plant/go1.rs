//! A Go1 on its wires: the legs' line and the arms' servos as one plant.

use std::time::Duration;

use super::{ArmServos, Health, JointCommand, Plant, PlantError, Sensors, SustainedPower, arms::ArmSample};
use crate::{
    go1::{Driver, Feet, LineCounts, MOTORS, MotorMode, Report, state::MotorState},
    joints::JointVector,
};

/// How long an exchange waits for a state: four periods, and shorter than the sender's patience with us.
const EXCHANGE_TIMEOUT: Duration = Duration::from_millis(8);
/// A motor that brakes for so many samples although it is told to follow has a fault: 0.2 s.
const BRAKING_SAMPLES: u32 = 100;
/// That the sender has damped is told for so many samples, 0.5 s, so that nobody misses it.
const TOLD_SAMPLES: u32 = 250;
/// An attitude's quaternion is at least so long, or it is none.
const SHORTEST_QUATERNION: f64 = 0.5;
/// Cells of the battery.
const CELLS: usize = 6;

/// The robot. Paces its caller at 500 Hz.
pub struct Go1Plant {
    driver: Driver,
    arms: Box<dyn ArmServos>,
    feet: Feet,
    power: SustainedPower,
    braking: u32,
    /// The last command asked for damping.
    damped: bool,
    /// Samples in which it is still told that the sender has damped.
    telling: u32,
    health: Health,
    report: Option<Report>,
}

impl Go1Plant {
    /// A robot behind a driver that runs, with these arms.
    pub fn new(driver: Driver, arms: Box<dyn ArmServos>) -> Self {
        let feet = driver.settings().feet;
        Self {
            driver,
            arms,
            feet,
            power: SustainedPower::default(),
            braking: 0,
            damped: true,
            telling: 0,
            health: Health::default(),
            report: None,
        }
    }

    /// The last state, as it came.
    pub fn report(&self) -> Option<&Report> {
        self.report.as_ref()
    }

    /// What has gone over the line, as of the last state.
    pub fn counts(&self) -> LineCounts {
        self.report.map(|report| report.counts).unwrap_or_default()
    }

    /// The driver.
    pub fn driver(&self) -> &Driver {
        &self.driver
    }

    fn judge(&mut self, report: &Report, arms: &ArmSample, damped: bool) -> Health {
        let state = &report.state;
        // Motors that were damped by command may be damped by the sender as well: that is no news.
        let overruled = report.verdict.damps() && !damped && !self.damped;
        self.damped = damped;
        self.telling = if overruled { TOLD_SAMPLES } else { self.telling.saturating_sub(1) };
        let motors = &state.motors[..MOTORS];
        let brakes = motors.iter().any(|motor| motor.mode() == MotorMode::Brake);
        self.braking = if brakes { self.braking + 1 } else { 0 };
        let refuses =
            |motor: &MotorState| matches!(motor.mode(), MotorMode::Protection | MotorMode::Unknown(_));
        let power_w = motors.iter().map(|motor| (f64::from(motor.dq_rad_s) * motor.torque_n_m()).abs()).sum();
        let hottest = |temperatures: &mut dyn Iterator<Item = i8>| temperatures.max().map_or(0.0, f64::from);
        let cells = state.battery.cells[..CELLS].iter().map(|steps| 0.032 * f64::from(*steps));
        Health {
            remote_stop: state.remote().is_some_and(|remote| remote.asks_for_stop()),
            sender_damped: self.telling > 0,
            motor_fault: motors.iter().any(refuses) || self.braking > BRAKING_SAMPLES,
            motor_c: hottest(&mut motors.iter().map(|motor| motor.temperature_c)),
            battery_percent: f64::from(state.battery.charge_percent),
            cell_v: cells.fold(f64::INFINITY, f64::min),
            battery_c: hottest(&mut state.battery.temperatures_c.into_iter()),
            leg_power_w: self.power.update(power_w),
            servo_fault: arms.fault,
            servo_c: arms.hottest_c,
        }
    }
}

impl Plant for Go1Plant {
    fn exchange(&mut self, command: &JointCommand) -> Result<Sensors, PlantError> {
        let arms = self.arms.exchange(command);
        let Some(report) = self.driver.exchange(command, EXCHANGE_TIMEOUT)? else {
            return Err(PlantError::Silent { waited_ms: EXCHANGE_TIMEOUT.as_millis() as u64 });
        };
        let damped = command.kp.amax() == 0.0 && command.torque.amax() == 0.0;
        self.health = self.judge(&report, &arms, damped);
        self.report = Some(report);
        Ok(sensors(&report, &arms, &self.feet))
    }

    fn health(&self) -> Health {
        self.health
    }
}

/// A state and the servos' sample in the controller's terms.
fn sensors(report: &Report, arms: &ArmSample, feet: &Feet) -> Sensors {
    let state = &report.state;
    let joints = |leg: fn(&MotorState) -> f64, arm: &[f64]| {
        JointVector::from_fn(|joint, _| match joint {
            0..MOTORS => leg(&state.motors[joint]),
            _ => arm[joint - MOTORS],
        })
    };
    let attitude = state.quaternion_wxyz.map(f64::from);
    let length = attitude.iter().map(|part| part * part).sum::<f64>().sqrt();
    // An IMU that has not started says zeros: no attitude, which damps, and not an upright robot.
    let scale = if length >= SHORTEST_QUATERNION { 1.0 / length } else { f64::NAN };
    Sensors {
        time_ns: report.sample_ns,
        position: joints(|motor| motor.q_rad.into(), &arms.position),
        velocity: joints(|motor| motor.dq_rad_s.into(), &arms.velocity),
        torque: joints(MotorState::torque_n_m, &arms.torque),
        opening: arms.opening,
        attitude: attitude.map(|part| part * scale),
        gyro: state.gyroscope_rad_s.map(f64::from),
        accelerometer: state.accelerometer_m_s2.map(f64::from),
        foot_force: feet.force_n(&state.feet),
    }
}
