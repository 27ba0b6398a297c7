//! Robot and simulator in lockstep, with a scripted operator.

#![allow(dead_code, reason = "each test program uses its part")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic in a test is the report")]

use std::path::PathBuf;

use locoman_robot::{
    commander::Command,
    control::{Controller, Inputs, Options, RobotConfig, Snapshot},
    modes::Mode,
    plant::{JointCommand, Plant},
    supervisor::Stop,
};
use locoman_sim::robot::{self, LockstepPlant, Truth};
use nalgebra::Vector3;

/// Commands come at 60 Hz.
pub const COMMAND_PERIOD_NS: u64 = 16_666_667;

/// Robot and simulator, with a scripted operator.
pub struct Session {
    pub plant: LockstepPlant,
    pub controller: Controller,
    pub command: JointCommand,
    pub operator: Option<Command>,
    pub truth: Truth,
    pub time_ns: u64,
    pub worst_tilt: f64,
    /// Whether the operator's commands keep coming.
    pub speaks: bool,
}

pub fn configs() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../configs")
}

impl Session {
    pub fn new(posture: &str, profile: &str, seed: u64) -> Self {
        let options = robot::Options {
            profile: profile.into(),
            posture: posture.into(),
            seed,
            ..robot::Options::default()
        };
        let mut plant = LockstepPlant::new(&configs(), &options).unwrap();
        let config = RobotConfig::load(&configs()).unwrap();
        let truth = plant.truth();
        Self {
            plant,
            controller: Controller::new(config, Options { auto_stand: true }),
            command: JointCommand::damping(),
            operator: None,
            truth,
            time_ns: 0,
            worst_tilt: 0.0,
            speaks: true,
        }
    }

    pub fn snapshot(&self) -> &Snapshot {
        self.controller.snapshot()
    }

    pub fn tick(&mut self, stop: Stop) {
        let sensors = self.plant.exchange(&self.command).unwrap();
        self.time_ns = sensors.time_ns;
        if let Some(operator) = &mut self.operator
            && self.speaks
            && self.time_ns.saturating_sub(operator.received_ns) >= COMMAND_PERIOD_NS
        {
            operator.received_ns = self.time_ns;
            operator.sequence += 1;
        }
        let inputs = Inputs { command: self.operator, stop, ..Inputs::default() };
        self.command = self.controller.tick(self.time_ns, &sensors, &inputs);
        self.truth = self.plant.truth();
        let tilt = (self.truth.world_from_torso.rotation * Vector3::z()).z.clamp(-1.0, 1.0).acos();
        if self.snapshot().phase.is_balanced() {
            self.worst_tilt = self.worst_tilt.max(tilt);
        }
        if std::env::var_os("TRACE").is_some() && self.time_ns.is_multiple_of(100_000_000) {
            let s = self.snapshot();
            println!(
                "{:6.2} {:?} slips {} q {:.2?} foot {:.3?} z {:.4} tilt {:.4} force {:.1?} est {:.4?} sev {:?} ff {}",
                self.time_ns as f64 * 1e-9,
                s.phase,
                s.slips,
                [0, 1, 2, 12, 13, 14].map(|i| s.joint_position[i]),
                self.truth.feet_in_world[0].coords.as_slice(),
                self.truth.world_from_torso.translation.z,
                tilt,
                self.truth.foot_force_n,
                s.torso.pose.translation.vector.as_slice(),
                s.assessment.severity,
                s.force_fallbacks,
            );
        }
        assert!(
            !self.snapshot().phase.is_balanced() || !self.truth.fallen,
            "fell at {} s",
            self.time_ns as f64 * 1e-9
        );
    }

    /// The robot's program is started anew; the plant keeps the last command meanwhile.
    pub fn restart_robot(&mut self) {
        let config = RobotConfig::load(&configs()).unwrap();
        self.controller = Controller::new(config, Options { auto_stand: true });
        for _ in 0..400 {
            self.plant.robot_mut().advance().unwrap();
        }
        self.command = JointCommand::damping();
    }

    pub fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds * 400.0) as usize {
            self.tick(Stop::None);
        }
    }

    pub fn run_until(&mut self, what: &str, limit_s: f64, done: impl Fn(&Snapshot) -> bool) {
        for _ in 0..(limit_s * 400.0) as usize {
            self.tick(Stop::None);
            if done(self.snapshot()) {
                return;
            }
        }
        panic!("{what} not reached in {limit_s} s: {:?}", self.snapshot().phase);
    }

    /// An operator appears, engaged with nothing.
    pub fn join(&mut self) {
        self.operator = Some(Command {
            sequence: 1,
            capture_ns: self.time_ns,
            received_ns: self.time_ns,
            ..Command::idle(7)
        });
        self.run(0.05);
    }

    pub fn operator(&mut self) -> &mut Command {
        self.operator.as_mut().unwrap()
    }

    pub fn request(&mut self, mode: Mode) {
        let operator = self.operator();
        operator.mode = Some(mode);
        operator.mode_request += 1;
        self.run_until("mode", 25.0, |s| s.mode == mode && s.goal == mode);
    }
}
