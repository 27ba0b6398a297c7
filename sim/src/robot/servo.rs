//! The arms' servos: Dynamixel XC330-T288-T in current-based position mode, and the bus that they hang on.
//!
//! ```text
//! command ─► driver: goal in counts ─► bus (200 Hz) ─► P, D on counts (1 kHz) ─► PWM ─► motor ─► play ─► joint
//!                                       readings ◄──── encoder: 4096 counts a turn ◄────────────────────┘
//! ```
//! A servo takes nothing but a position goal, so the driver puts what else a command has into it:
//!
//! `goal = q_des + (tau_ff + k_b dq_des) / kp`
//!
//! `kp` and `k_b` are the stiffness of the servo's loop and its back-EMF. The servo itself (maker's manual,
//! "Position PID Gain": the controller's output is the motor's PWM):
//!
//! `u = P / 128 e + D / 16 Δe`, `e` the error in counts and `Δe` its change in a millisecond, cut to the limit;
//! `tau = T (u / 885 - w / w0)`, cut to the current's limit.
//!
//! The encoder is an absolute one on the output shaft (12 bits over one turn of it): it sees the joint, and
//! the play of the gears lies between it and the motor. With all imperfections off the same loop runs
//! continuously: `tau = tau_ff + kp (q_des - q) + (kd + k_b) (dq_des - dq)`.

use std::f64::consts::TAU;

use locoman_robot::plant::JointCommand;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::noise::normal;
use super::profile::ServoErrors;
use super::scene::ArmServo;
use super::world::World;

/// Servos of both arms, without those of the jaws.
pub const SERVOS: usize = 6;
/// The first of them among the joints.
const FIRST: usize = 12;
/// Counts that the P and D gains are about, whatever the encoder of a profile resolves.
const COUNTS_PER_TURN: f64 = 4096.0;
/// PWM units at which the whole supply voltage is on the motor (one is 0.113 %).
const FULL_PWM: f64 = 885.0;
/// The D gain is about the change of the error in this time, s. Not published: an assumption.
const D_PERIOD_S: f64 = 0.001;

/// Keeps the encoders' noise apart from other draws of the same seed.
const STREAM: u64 = 2;

/// What the bus brings from one servo.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reading {
    /// rad.
    pub position: f64,
    /// rad/s.
    pub velocity: f64,
}

/// What one servo remembers.
#[derive(Debug, Clone, Copy, Default)]
struct Memory {
    /// Goal and its rate, rad and rad/s.
    goal: f64,
    goal_rate: f64,
    /// Last error, counts; none before the first round of the loop.
    error: Option<f64>,
    /// Output in force, PWM units.
    pwm: f64,
}

/// All servos of the arms.
#[derive(Debug, Clone)]
pub struct Servos {
    arm: ArmServo,
    errors: ServoErrors,
    timestep_s: f64,
    loop_steps: u64,
    bus_steps: u64,
    step: u64,
    memory: [Memory; SERVOS],
    readings: [Reading; SERVOS],
    random: ChaCha8Rng,
}

impl Servos {
    /// At rest, without goals: [`Self::exchange`] brings them.
    pub fn new(arm: &ArmServo, errors: &ServoErrors, timestep_s: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(STREAM);
        let steps = |period_s: f64| ((period_s / timestep_s).round() as u64).max(1);
        Self {
            arm: *arm,
            errors: *errors,
            timestep_s,
            loop_steps: steps(errors.loop_period_s),
            bus_steps: steps(errors.bus_period_s),
            step: 0,
            memory: [Memory::default(); SERVOS],
            readings: [Reading::default(); SERVOS],
            random,
        }
    }

    /// Goals and readings pass at once from now on: they have had a bus already.
    pub fn leave_bus_to_others(&mut self) {
        self.errors.bus_period_s = 0.0;
        self.bus_steps = 1;
    }

    /// What the controller knows of a servo: what the bus brought last; the present without a period.
    pub fn reading(&mut self, servo: usize, world: &World) -> Reading {
        if self.errors.bus_period_s > 0.0 { self.readings[servo] } else { self.read(servo, world) }
    }

    /// One step of the physics: the bus and the servos' loops run when it is their turn.
    pub fn exchange(&mut self, command: &JointCommand, world: &World) {
        if self.step.is_multiple_of(self.bus_steps) {
            for servo in 0..SERVOS {
                if self.errors.bus_period_s > 0.0 {
                    self.readings[servo] = self.read(servo, world);
                }
                self.write(servo, command);
            }
        }
        if self.step.is_multiple_of(self.loop_steps) {
            for servo in 0..SERVOS {
                self.control(servo, world);
            }
        }
        self.step += 1;
    }

    /// Torque of one servo's motor, which turns at `speed_rad_s`, N m.
    pub fn torque(&self, servo: usize, speed_rad_s: f64) -> f64 {
        let ArmServo { torque_limit_nm, no_load_speed_rad_s, current_limit_a, stall_current_a, .. } =
            self.arm;
        let most = torque_limit_nm * current_limit_a / stall_current_a;
        let share = self.memory[servo].pwm / FULL_PWM - speed_rad_s / no_load_speed_rad_s;
        (torque_limit_nm * share).clamp(-most, most)
    }

    fn read(&mut self, servo: usize, world: &World) -> Reading {
        let (position, velocity) = (world.angle(FIRST + servo), world.speed(FIRST + servo));
        let ServoErrors { encoder_noise_rad, velocity_noise_rad_s, velocity_step_rad_s, .. } = self.errors;
        let mut noisy = |value: f64, sigma: f64| value + sigma * normal(&mut self.random);
        let position = noisy(position, encoder_noise_rad);
        let velocity = noisy(velocity, velocity_noise_rad_s);
        Reading {
            position: rounded(position, self.count_rad()),
            velocity: rounded(velocity, velocity_step_rad_s),
        }
    }

    fn write(&mut self, servo: usize, command: &JointCommand) {
        let joint = FIRST + servo;
        let stiffness = self.stiffness(servo % 3);
        let back_emf = self.arm.torque_limit_nm / self.arm.no_load_speed_rad_s;
        let offset = (command.torque[joint] + back_emf * command.velocity[joint]) / stiffness;
        self.memory[servo].goal = rounded(command.position[joint] + offset, self.count_rad());
        self.memory[servo].goal_rate = command.velocity[joint];
    }

    fn control(&mut self, servo: usize, world: &World) {
        let joint = FIRST + servo;
        let place = servo % 3;
        let memory = self.memory[servo];
        let present = rounded(world.angle(joint), self.count_rad());
        let error = (memory.goal - present) * COUNTS_PER_TURN / TAU;
        let change = if self.errors.loop_period_s > 0.0 {
            let period_s = self.loop_steps as f64 * self.timestep_s;
            (error - memory.error.unwrap_or(error)) * D_PERIOD_S / period_s
        } else {
            (memory.goal_rate - world.speed(joint)) * D_PERIOD_S * COUNTS_PER_TURN / TAU
        };
        let pwm = self.arm.p_gain[place] / 128.0 * error + self.arm.d_gain[place] / 16.0 * change;
        let memory = &mut self.memory[servo];
        memory.error = Some(error);
        memory.pwm = pwm.clamp(-self.arm.pwm_limit, self.arm.pwm_limit);
    }

    /// kp of the loop, N m/rad.
    fn stiffness(&self, place: usize) -> f64 {
        self.arm.p_gain[place] / 128.0 * COUNTS_PER_TURN / TAU * self.arm.torque_limit_nm / FULL_PWM
    }

    /// Angle of one count, rad; 0 if the encoder of this profile has none.
    fn count_rad(&self) -> f64 {
        if self.errors.counts_per_turn > 0.0 { TAU / self.errors.counts_per_turn } else { 0.0 }
    }
}

/// The nearest multiple of a step; the value itself if there is no step.
pub fn rounded(value: f64, step: f64) -> f64 {
    if step > 0.0 { (value / step).round() * step } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_fall_on_counts() {
        let count = TAU / COUNTS_PER_TURN;
        assert!((rounded(1.0, count) - 652.0 * count).abs() < 1e-12);
        assert_eq!(rounded(1.0, 0.0), 1.0);
    }
}
