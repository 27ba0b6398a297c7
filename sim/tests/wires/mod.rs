//! The virtual Go1 and the driver, in one process: for tests that look behind the wires.

#![allow(dead_code, reason = "each test program uses its part")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic in a test is the report")]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use locoman_protocol::realtime;
use locoman_robot::go1::{Driver, Go1Settings, WatchdogSettings, driver::Place};
use locoman_robot::plant::{BusServos, Go1Plant, JointCommand, Plant, PlantError, Sensors};
use locoman_robot::servo::{ServoDriver, ServoSettings};
use locoman_sim::robot::Options;
use locoman_sim::robot::board::{HostedRobot, VirtualRobot};

/// Nothing here takes this long unless it hangs.
pub const WATCHDOG: Duration = Duration::from_secs(20);

pub fn configs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs")
}

/// A robot, and a plant that talks to it. The plant is dropped first.
pub struct Wires {
    pub plant: Go1Plant,
    pub robot: HostedRobot,
}

impl Wires {
    /// With a watchdog that is patient with tests on a busy machine.
    pub fn new(posture: &str) -> Self {
        let watchdog = Go1Settings::default().watchdog;
        Self::watched(posture, WatchdogSettings { hold_ms: 500.0, damp_ms: 2_000.0, ..watchdog })
    }

    /// With this watchdog.
    pub fn watched(posture: &str, watchdog: WatchdogSettings) -> Self {
        // As the control thread does, where it is permitted.
        let _granted = realtime::run_before_others();
        let options = Options { posture: posture.into(), ..Options::default() };
        let (robot, line) = VirtualRobot::with_servos(&configs(), &options, None).unwrap();
        let robot = HostedRobot::start(robot, options.seed).unwrap();
        let servos = ServoSettings { port: line.port, ..ServoSettings::default() };
        // On a busy machine servos may answer late.
        let mut tries = std::iter::repeat_with(|| ServoDriver::start(&servos, &line.zeros)).take(20);
        let arms = BusServos::new(tries.find_map(Result::ok).unwrap(), servos.gripper);
        let default = Go1Settings::default();
        let settings = Go1Settings {
            board: robot.address(),
            local: "127.0.0.1:0".parse().unwrap(),
            // A thread is waited for while it lingers.
            watchdog: WatchdogSettings { linger_ms: 500.0, ..watchdog },
            ..default
        };
        let driver = Driver::start(settings, Place::Thread).unwrap();
        Self { plant: Go1Plant::new(driver, Box::new(arms)), robot }
    }

    /// Exchanges for some time; the last sample.
    pub fn run(&mut self, command: &JointCommand, seconds: f64) -> Sensors {
        let deadline = Instant::now() + Duration::from_secs_f64(seconds);
        let mut last = None;
        while Instant::now() < deadline || last.is_none() {
            assert!(Instant::now() < deadline + WATCHDOG, "the robot says nothing");
            match self.plant.exchange(command) {
                Ok(sensors) => last = Some(sensors),
                Err(PlantError::Silent { .. }) => {}
                Err(error) => panic!("{error}"),
            }
        }
        last.unwrap()
    }
}

/// Stands by joint position control alone, arms folded.
pub fn stand() -> JointCommand {
    let mut command = JointCommand::damping();
    for joint in 0..12 {
        command.position[joint] = [0.0, 0.9, -1.8][joint % 3];
        command.kp[joint] = 60.0;
        command.kd[joint] = 2.0;
    }
    for (side, sign) in [(0, -1.0), (1, 1.0)] {
        command.position[12 + 3 * side] = -std::f64::consts::PI;
        command.position[13 + 3 * side] = 0.05 * sign;
    }
    command.kd.rows_mut(12, 6).fill(0.0);
    command
}
