//! The real controller on the simulated robot in lockstep, moved by trajectories.
//!
//! No sockets and no clock: the same seed gives the same bits. After each tick, controller and truth are those
//! of the same instant.

use std::path::Path;

use anyhow::ensure;
use locoman_robot::commander::Command;
use locoman_robot::control::{Controller, Inputs, Options as ControlOptions, RobotConfig, Snapshot};
use locoman_robot::locomotion::Velocity;
use locoman_robot::modes::Mode;
use locoman_robot::plant::{JointCommand, Plant, Sensors};
use locoman_robot::trajectory::Trajectory;

use crate::robot::{EXCHANGE_S, LockstepPlant, Options, Truth};

/// Ticks between two of the operator's commands: 66.7 Hz.
const COMMAND_EVERY: u64 = 6;
/// Longest time to reach a mode, s.
const ON_THE_WAY_S: f64 = 30.0;

/// A robot under a controller, with an operator who only plays trajectories.
pub struct Lockstep {
    plant: LockstepPlant,
    controller: Controller,
    command: JointCommand,
    sensors: Option<Sensors>,
    operator: Command,
    truth: Truth,
    ticks: u64,
    silent: bool,
    /// How often the operator has engaged.
    engagements: u64,
}

impl Lockstep {
    /// A robot in a posture of the scene, met by a controller that has just started.
    pub fn new(configs: &Path, options: &Options) -> anyhow::Result<Self> {
        Self::with_config(configs, RobotConfig::load(configs)?, options)
    }

    /// The same with a given configuration of the controller.
    pub fn with_config(configs: &Path, config: RobotConfig, options: &Options) -> anyhow::Result<Self> {
        let mut plant = LockstepPlant::new(configs, options)?;
        let controller = Controller::new(config, ControlOptions { auto_stand: true });
        let operator = Command::idle(1);
        let (command, truth) = (*controller.command(), plant.truth());
        Ok(Self {
            plant,
            controller,
            command,
            sensors: None,
            operator,
            truth,
            ticks: 0,
            silent: false,
            engagements: 0,
        })
    }

    /// One control step.
    pub fn tick(&mut self) -> anyhow::Result<()> {
        let sensors = self.plant.exchange(&self.command)?;
        if !self.silent && self.ticks.is_multiple_of(COMMAND_EVERY) {
            self.operator.sequence += 1;
            self.operator.capture_ns = sensors.time_ns;
            self.operator.received_ns = sensors.time_ns;
        }
        self.ticks += 1;
        self.sensors = Some(sensors);
        let inputs = Inputs { command: Some(self.operator), ..Inputs::default() };
        self.command = self.controller.tick(sensors.time_ns, &sensors, &inputs);
        self.truth = self.plant.truth();
        Ok(())
    }

    /// Ticks for some time.
    pub fn run(&mut self, seconds: f64) -> anyhow::Result<()> {
        (0..ticks(seconds)).try_for_each(|_| self.tick())
    }

    /// Asks for a mode and waits until the robot is there.
    pub fn go_to(&mut self, mode: Mode) -> anyhow::Result<()> {
        // A robot that is standing up refuses: ask when it stands.
        self.wait("a stance", |state| state.mode != Mode::Damped && state.goal == state.mode)?;
        if self.snapshot().mode != mode {
            self.request(mode);
            self.wait(&format!("{mode:?}"), |state| state.mode == mode && state.goal == mode)?;
        }
        Ok(())
    }

    /// Asks for a mode.
    pub fn request(&mut self, mode: Mode) {
        self.operator.mode_request += 1;
        self.operator.mode = Some(mode);
    }

    fn wait(&mut self, what: &str, there: impl Fn(&Snapshot) -> bool) -> anyhow::Result<()> {
        for _ in 0..ticks(ON_THE_WAY_S) {
            self.tick()?;
            if there(self.snapshot()) {
                return Ok(());
            }
        }
        let refusal = self.snapshot().refusal.map_or("", |refusal| refusal.text());
        anyhow::bail!(
            "{what} not reached in {ON_THE_WAY_S} s: {:?} {refusal}, the robot {}",
            self.snapshot().phase,
            if self.truth.fallen { "has fallen" } else { "stands" }
        )
    }

    /// Engages with a trajectory. Returns with the robot at its beginning, time 0.
    pub fn engage(&mut self, trajectory: &Trajectory) -> anyhow::Result<()> {
        self.engagements += 1;
        self.operator.engagement = self.engagements;
        self.operator.trajectory = Some(*trajectory);
        self.tick()?;
        let engaged = self.snapshot().engagement;
        ensure!(
            engaged == self.operator.engagement,
            "the robot did not engage: {:?}",
            self.snapshot().assessment
        );
        Ok(())
    }

    /// Engages, to walk at a velocity; none lets go.
    pub fn walk(&mut self, velocity: Option<Velocity>) {
        self.operator.walk = velocity;
        if velocity.is_none() {
            self.operator.engagement = 0;
        } else if self.operator.engagement == 0 {
            self.engagements += 1;
            self.operator.engagement = self.engagements;
        }
    }

    /// The operator's commands come, or no longer do.
    pub fn set_silent(&mut self, silent: bool) {
        self.silent = silent;
    }

    /// The operator lets go.
    pub fn release(&mut self) {
        self.operator.trajectory = None;
        self.operator.engagement = 0;
    }

    /// What the operator's commands say, besides who sent them and when.
    pub fn operator_mut(&mut self) -> &mut Command {
        &mut self.operator
    }

    /// What the controller says.
    pub fn snapshot(&self) -> &Snapshot {
        self.controller.snapshot()
    }

    /// The controller.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// What the robot measured last.
    pub fn sensors(&self) -> Option<&Sensors> {
        self.sensors.as_ref()
    }

    /// The controller, out of the simulation.
    pub fn into_controller(self) -> Controller {
        self.controller
    }

    /// The last command to the joints.
    pub fn command(&self) -> &JointCommand {
        &self.command
    }

    /// What is really going on.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// The simulated robot.
    pub fn plant_mut(&mut self) -> &mut LockstepPlant {
        &mut self.plant
    }
}

/// Control steps in some time.
pub fn ticks(seconds: f64) -> u64 {
    (seconds / EXCHANGE_S).round() as u64
}
