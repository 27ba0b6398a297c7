//! Drives the real controller on the simulated robot in lockstep, by a scripted operator.
//!
//! No sockets and no clock: the same seed gives the same session. The session has the form of a recorded one,
//! so that the same judges apply.

use std::path::Path;

use locoman_protocol::geometry;
use locoman_protocol::messages::{Header, Mode, OperatorCommand};
use locoman_robot::commander::Command;
use locoman_robot::control::{Controller, Inputs, Options as ControlOptions, RobotConfig};
use locoman_robot::link;
use locoman_robot::plant::{JointCommand, Plant};
use nalgebra::Isometry3;

use super::demo::Session;
use crate::robot::publish;
use crate::robot::{EXCHANGE_NS, LockstepPlant, Options};

/// The scripted operator is one sender.
const SOURCE: u64 = 1;
/// Exchanges between two commands: 66.7 Hz.
const COMMAND_EVERY: u64 = 6;
/// Exchanges between two states and truths: 100 Hz.
const STATE_EVERY: u64 = 4;
/// Longest time to stand up and to change the mode, s.
const ON_THE_WAY_S: f64 = 30.0;

/// What the operator's bodies do, as displacements since engagement.
#[derive(Debug, Clone, Copy, Default)]
pub struct Motion {
    /// Torso.
    pub torso: Option<Isometry3<f64>>,
    /// Palms, right and left.
    pub palms: [Option<Isometry3<f64>>; 2],
    /// Openings, right and left.
    pub openings: [Option<f64>; 2],
}

/// A script: in this mode, for so long after engagement, move like this.
pub struct Script<F> {
    /// Which mode.
    pub mode: Mode,
    /// How long, s.
    pub seconds: f64,
    /// The motion, by the time since engagement, s.
    pub motion: F,
}

/// A robot under a controller, and everything that was said.
pub struct Drive {
    plant: LockstepPlant,
    controller: Controller,
    command: JointCommand,
    latest: Option<Command>,
    exchange: u64,
    sequence: u64,
    session: Session,
}

impl Drive {
    /// A robot that lies and is about to stand up.
    pub fn new(configs: &Path, options: &Options) -> anyhow::Result<Self> {
        let plant = LockstepPlant::new(configs, options)?;
        let controller = Controller::new(RobotConfig::load(configs)?, ControlOptions { auto_stand: true });
        let command = *controller.command();
        Ok(Self {
            plant,
            controller,
            command,
            latest: None,
            exchange: 0,
            sequence: 0,
            session: Session::default(),
        })
    }

    /// Runs a script: asks for its mode, waits until it is reached, engages, moves, lets go.
    pub fn run(&mut self, script: &Script<impl Fn(f64) -> Motion>) -> anyhow::Result<()> {
        let request = self.session.commands.last().map_or(0, |command| command.mode_request_id) + 1;
        let asking = OperatorCommand {
            mode_request_id: request,
            mode: script.mode.into(),
            ..OperatorCommand::default()
        };
        let silent = OperatorCommand { mode_request_id: request - 1, ..OperatorCommand::default() };
        let given_up = self.exchange + (ON_THE_WAY_S / 0.0025) as u64;
        // A robot that is standing up refuses: ask when it stands.
        let mut asked = false;
        while !self.has_reached(script.mode) {
            anyhow::ensure!(
                self.exchange < given_up,
                "{:?} not reached in {ON_THE_WAY_S} s: {:?} ({})",
                script.mode,
                self.controller.snapshot().phase,
                self.controller.snapshot().refusal.map_or("", |refusal| refusal.text())
            );
            asked |= self.stands();
            self.exchange(if asked { &asking } else { &silent })?;
        }
        let begin_ns = self.time_ns();
        let seconds = |drive: &Self| (drive.time_ns() - begin_ns) as f64 * 1e-9;
        while seconds(self) < script.seconds {
            let motion = (script.motion)(seconds(self));
            self.exchange(&OperatorCommand { engagement: request, ..asking.clone().with(&motion) })?;
        }
        for _ in 0..40 {
            self.exchange(&asking)?;
        }
        Ok(())
    }

    /// What was said.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The robot's truth now.
    pub fn plant_mut(&mut self) -> &mut LockstepPlant {
        &mut self.plant
    }

    fn stands(&self) -> bool {
        let modes = [Mode::Stance, Mode::RightGripper, Mode::LeftGripper, Mode::RightFoot, Mode::LeftFoot];
        modes.into_iter().any(|mode| self.has_reached(mode))
    }

    fn has_reached(&self, mode: Mode) -> bool {
        let snapshot = self.controller.snapshot();
        snapshot.mode.to_message() == mode && snapshot.goal.to_message() == mode
    }

    fn time_ns(&self) -> u64 {
        self.exchange * EXCHANGE_NS
    }

    /// One exchange; every few, the operator's command is renewed and states are noted down.
    fn exchange(&mut self, wish: &OperatorCommand) -> anyhow::Result<()> {
        let now_ns = self.time_ns();
        if self.exchange.is_multiple_of(COMMAND_EVERY) {
            self.sequence += 1;
            let header =
                Header { source: SOURCE, sequence: self.sequence, capture_ns: now_ns, send_ns: now_ns };
            let message = OperatorCommand { header: Some(header), ..wish.clone() };
            self.latest = Some(Command::from_message(&message, now_ns));
            self.session.commands.push(message);
        }
        let sensors = self.plant.exchange(&self.command)?;
        self.exchange += 1;
        let inputs = Inputs { command: self.latest, ..Inputs::default() };
        self.command = self.controller.tick(sensors.time_ns, &sensors, &inputs);
        if self.exchange.is_multiple_of(STATE_EVERY) {
            let header = Header {
                source: 2,
                sequence: self.exchange,
                capture_ns: sensors.time_ns,
                send_ns: sensors.time_ns,
            };
            let mut state = link::message(self.controller.snapshot(), self.sequence, 0);
            state.header = Some(header);
            self.session.states.push(state);
            let mut truth = publish::message(&self.plant.truth());
            truth.header = Some(header);
            self.session.truths.push(truth);
        }
        Ok(())
    }
}

trait WithMotion {
    fn with(self, motion: &Motion) -> Self;
}

impl WithMotion for OperatorCommand {
    fn with(self, motion: &Motion) -> Self {
        let pose = |displacement: &Option<Isometry3<f64>>| displacement.as_ref().map(geometry::pose);
        Self {
            torso: pose(&motion.torso),
            right_palm: pose(&motion.palms[0]),
            left_palm: pose(&motion.palms[1]),
            right_opening: motion.openings[0],
            left_opening: motion.openings[1],
            ..self
        }
    }
}
