//! The simulated robot as a machine: commands in, sensors out, one exchange of 2.5 ms at a time.
//!
//! ```text
//! command ─► wire, latency ─► latched ─► joint law and motor limits ─► MuJoCo ─► noise ─► sensors
//!                                        └──────── every step (2 kHz) ───────┘
//! ```
//! The last command stays in force for ever, as on the Go1. Lockstep and real time differ only in who says
//! when to advance.

use std::collections::VecDeque;
use std::path::Path;

use locoman_robot::joints::{JOINTS, JointVector, Side};
use locoman_robot::model::Model;
use locoman_robot::plant::{JointCommand, Sensors};
use locoman_robot::servo::{Place, SERVOS};
use nalgebra::Vector3;

use super::disturbance::{Disturbance, Target};
use super::drives::Drives;
use super::noise::SensorNoise;
use super::profile::Profile;
use super::scene::{Posture, Scene};
use super::terrain::Terrain;
use super::world::{MOTORS, Truth, World};
use super::{EXCHANGE_NS, EXCHANGE_S, SimRobotError, body, go1_wire, mjcf};
use crate::servo_bus::JointMotion;

/// Commands that can be under way at once: more than arrive within the longest latency.
const COMMANDS_UNDER_WAY: usize = 64;

/// How to set the robot up.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// A profile of the scene file: `hw`, `ideal`.
    pub profile: String,
    /// A posture of the scene file: `lying`, `standing`.
    pub posture: String,
    /// Seed of everything random.
    pub seed: u64,
    /// What it stands on.
    pub terrain: Terrain,
}

impl Default for Options {
    fn default() -> Self {
        Self { profile: "hw".into(), posture: "lying".into(), seed: 1, terrain: Terrain::Flat }
    }
}

/// A robot in its world.
#[derive(Debug)]
pub struct SimRobot {
    world: World,
    drives: Drives,
    noise: SensorNoise,
    scene: Scene,
    seed: u64,
    profile: Profile,
    steps_per_exchange: u64,
    latency_steps: u64,
    /// Commands that have not come into force, with the step at which they do.
    under_way: VecDeque<(u64, JointCommand)>,
    latched: JointCommand,
    applied: [f64; MOTORS],
    rejected_commands: u64,
    /// Steps since time zero, and the clock's reading then.
    step: u64,
    epoch_ns: u64,
    /// Step at which the push on each target ends; 0 without a push.
    push_until: [u64; Target::COUNT],
    /// Commands sent before this step are lost.
    silent_until: u64,
}

impl SimRobot {
    /// Builds the robot of a configuration folder and lets it settle in its posture.
    pub fn new(configs: &Path, options: &Options) -> Result<Self, SimRobotError> {
        let scene = Scene::load(configs)?;
        let model = Model::load(&configs.join("robot"))?;
        Self::with_model(&model, scene, options)
    }

    /// The same with a given model and scene.
    pub fn with_model(model: &Model, scene: Scene, options: &Options) -> Result<Self, SimRobotError> {
        let profile = *scene.profile(&options.profile)?;
        let robot = body::built(model, &profile.body, options.seed);
        let world = World::new(
            &mjcf::write(&robot, &scene, &profile, &options.terrain.blocks(options.seed))?,
            &profile.feet,
        )?;
        let steps = |seconds: f64| (seconds / scene.physics.timestep_s).round() as u64;
        let mut robot = Self {
            world,
            drives: Drives::new(&scene, &profile, options.seed),
            noise: SensorNoise::new(&profile.sensors, options.seed),
            steps_per_exchange: steps(EXCHANGE_S),
            latency_steps: steps(profile.commands.latency_s),
            seed: options.seed,
            profile,
            scene,
            under_way: VecDeque::with_capacity(COMMANDS_UNDER_WAY),
            latched: JointCommand::damping(),
            applied: [0.0; MOTORS],
            rejected_commands: 0,
            step: 0,
            epoch_ns: 0,
            push_until: [0; Target::COUNT],
            silent_until: 0,
        };
        robot.reset(&options.posture)?;
        Ok(robot)
    }

    /// Starts again from a posture, with the noise of the seed: the same as a new robot.
    pub fn reset(&mut self, posture: &str) -> Result<(), SimRobotError> {
        let posture = self.scene.posture(posture)?.clone();
        self.noise = SensorNoise::new(&self.profile.sensors, self.seed);
        self.drives = Drives::new(&self.scene, &self.profile, self.seed);
        self.under_way.clear();
        self.push_until = [0; Target::COUNT];
        self.silent_until = 0;
        self.world.calm()?;
        self.latched = if posture.held { hold(&posture) } else { JointCommand::damping() };
        self.world.place(&posture, self.drives.jaw_angle(0.0));
        for _ in 0..self.steps(posture.settle_s) {
            self.step_once();
        }
        self.step = 0;
        Ok(())
    }

    /// A command that arrives `after_ns` of the present exchange; a nonsensical one is dropped, as a drive
    /// drops a damaged frame.
    pub fn send(&mut self, command: &JointCommand, after_ns: u64) {
        let arrival = self.step + after_ns.div_ceil(self.step_ns());
        if arrival < self.silent_until {
            return;
        }
        if !command.is_finite() {
            self.rejected_commands += 1;
            return;
        }
        if self.under_way.len() == COMMANDS_UNDER_WAY {
            // Faster than any latency allows for: the oldest comes into force early.
            self.apply_next();
        }
        let carried = if self.profile.commands.go1_wire { go1_wire::command(command) } else { *command };
        self.under_way.push_back((arrival + self.latency_steps, carried));
    }

    /// Advances by one exchange and measures.
    pub fn advance(&mut self) -> Result<Sensors, SimRobotError> {
        self.advance_by(EXCHANGE_NS)
    }

    /// Advances by a time and measures; by whole steps of the physics.
    pub fn advance_by(&mut self, time_ns: u64) -> Result<Sensors, SimRobotError> {
        for _ in 0..time_ns / self.step_ns() {
            while self.under_way.front().is_some_and(|(due, _)| *due <= self.step) {
                self.apply_next();
            }
            self.end_pushes();
            self.step_once();
            self.step += 1;
        }
        if self.world.is_finite() {
            Ok(self.measure())
        } else {
            Err(SimRobotError::Diverged { time_s: self.time_s() })
        }
    }

    /// Everything, exact, at the time of the last sensors.
    pub fn truth(&mut self) -> Truth {
        let mut truth = self.world.truth();
        truth.time_ns = self.time_ns();
        truth.sim_time_s = self.time_s();
        truth.opening = self.opening();
        truth
    }

    /// Disturbs the robot from now on.
    pub fn disturb(&mut self, disturbance: &Disturbance) -> Result<(), SimRobotError> {
        disturbance.check()?;
        match *disturbance {
            Disturbance::Push { target, force_n, torque_nm, duration_s } => {
                self.world.set_push(target, force_n, torque_nm);
                self.push_until[target.index()] = self.step + self.steps(duration_s).max(1);
            }
            Disturbance::Load { side, mass_kg } => self.world.set_load(side, mass_kg)?,
            Disturbance::Friction { foot: Some(leg), coefficient } => {
                self.world.set_friction(leg, coefficient)?;
            }
            Disturbance::Friction { foot: None, coefficient } => {
                self.world.set_friction_everywhere(coefficient)?;
            }
            Disturbance::Silence { duration_s } => self.silent_until = self.step + self.steps(duration_s),
        }
        Ok(())
    }

    /// Sets the sensors' clock, which starts at 0 and advances with the exchanges.
    pub fn set_time_ns(&mut self, now_ns: u64) {
        self.epoch_ns = now_ns.saturating_sub(self.time_ns() - self.epoch_ns);
    }

    /// The sensors' clock now, ns.
    pub fn time_ns(&self) -> u64 {
        self.epoch_ns + self.step * EXCHANGE_NS / self.steps_per_exchange
    }

    /// Seconds since time zero.
    pub fn time_s(&self) -> f64 {
        self.step as f64 * self.scene.physics.timestep_s
    }

    /// Commands dropped because they held something that is no number.
    pub fn rejected_commands(&self) -> u64 {
        self.rejected_commands
    }

    /// Motor torques of the last step, N m.
    pub fn applied_torques(&self) -> &[f64; MOTORS] {
        &self.applied
    }

    /// What the arms' joints and the jaws do, as their servos measure it before their encoders round it.
    pub fn servo_motions(&self) -> [JointMotion; SERVOS] {
        Place::ALL.map(|place| {
            let motor = if place.is_gripper() { JOINTS + place.side.index() } else { 12 + place.index() };
            JointMotion {
                position_rad: self.world.angle(motor),
                velocity_rad_s: self.world.speed(motor),
                torque_n_m: self.applied[motor],
            }
        })
    }

    /// The servos hang on a bus of their own: commands are their goals, at once.
    pub fn leave_bus_to_others(&mut self) {
        self.drives.servos_mut().leave_bus_to_others();
    }

    /// The physics, for tests.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    fn end_pushes(&mut self) {
        for target in [Target::Torso, Target::Gripper(Side::Right), Target::Gripper(Side::Left)] {
            let until = &mut self.push_until[target.index()];
            if *until != 0 && self.step >= *until {
                *until = 0;
                self.world.set_push(target, Vector3::zeros(), Vector3::zeros());
            }
        }
    }

    fn steps(&self, seconds: f64) -> u64 {
        (seconds / self.scene.physics.timestep_s).round() as u64
    }

    fn apply_next(&mut self) {
        if let Some((_, command)) = self.under_way.pop_front() {
            self.latched = command;
        }
    }

    fn step_once(&mut self) {
        self.applied = self.drives.torques(&self.latched, &self.world);
        self.world.step(&self.applied);
    }

    fn step_ns(&self) -> u64 {
        EXCHANGE_NS / self.steps_per_exchange
    }

    fn opening(&self) -> [f64; 2] {
        [0, 1].map(|side| self.drives.opening(self.world.angle(JointVector::zeros().len() + side)))
    }

    fn measure(&mut self) -> Sensors {
        let mut position = self.world.joint_position();
        let mut velocity = self.world.joint_velocity();
        let mut torque = JointVector::from_fn(|joint, _| self.applied[joint]);
        for joint in 0..12 {
            position[joint] = self.noise.leg_position(position[joint]);
            velocity[joint] = self.noise.leg_velocity(velocity[joint]);
            torque[joint] = self.noise.leg_torque(torque[joint]);
        }
        for joint in 12..JOINTS {
            let reading = self.drives.servos_mut().reading(joint - 12, &self.world);
            (position[joint], velocity[joint]) = (reading.position, reading.velocity);
            torque[joint] = self.noise.arm_torque(torque[joint]);
        }
        Sensors {
            time_ns: self.time_ns(),
            position,
            velocity,
            torque,
            opening: self.opening(),
            attitude: self.noise.attitude(self.world.attitude(), self.time_s()),
            gyro: self.noise.gyro(self.world.angular_velocity()).into(),
            accelerometer: self.noise.accelerometer(self.world.specific_force()).into(),
            foot_force: self.noise.foot_force(self.world.foot_force()),
        }
    }
}

/// Holds a posture by joint position alone.
fn hold(posture: &Posture) -> JointCommand {
    /// Gains of the authors' start-up: stiff, because nothing else holds the robot.
    const KP: f64 = 200.0;
    const KD: f64 = 4.0;
    let mut command = JointCommand::damping();
    for joint in 0..12 {
        command.position[joint] = posture.leg[joint % 3];
        command.kp[joint] = KP;
        command.kd[joint] = KD;
    }
    for joint in 0..3 {
        command.position[12 + joint] = posture.right_arm[joint];
        command.position[15 + joint] = posture.left_arm[joint];
    }
    // Zero gains: the servos hold with their own.
    command.kd.rows_mut(12, 6).fill(0.0);
    command
}
