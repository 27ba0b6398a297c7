//! A virtual Go1 on threads of this process, on a free port: for tests and evaluations, which look behind it.

use std::net::{SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::JoinHandle;

use locoman_robot::go1::Go1Settings;
use locoman_robot::plant::JointCommand;
use locoman_robot::servo::{Place, ServoSettings, Zeros};
use triple_buffer::{Output, TripleBuffer};

use super::{Faults, Heard, Host, Mainboard, Planned, VirtualArms, serve};
use crate::robot::machine::{Options, SimRobot};
use crate::robot::server::Counters;
use crate::robot::{SimRobotError, Truth};
use crate::servo_bus::{VirtualBus, VirtualBusSetup};

/// What a virtual robot is made of.
pub struct VirtualRobot {
    /// The machine.
    pub robot: SimRobot,
    /// The board in front of it.
    pub board: Mainboard,
    /// Who says what the arms do.
    pub arms: VirtualArms,
}

/// How its servos are reached.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ServoLine {
    /// The port.
    pub port: String,
    /// Their zero angles.
    pub zeros: Zeros,
}

impl VirtualRobot {
    /// A robot of a configuration folder whose arms hold where they are.
    pub fn new(configs: &Path, options: &Options) -> anyhow::Result<Self> {
        let mut robot = SimRobot::new(configs, options)?;
        let mut held = JointCommand::damping();
        held.position = robot.truth().joint_position;
        // Zero gains: the servos hold with their own.
        held.kd.rows_mut(12, 6).fill(0.0);
        let board = Mainboard::new(Go1Settings::load(configs)?.feet);
        Ok(Self { robot, board, arms: VirtualArms::Held(Box::new(held)) })
    }

    /// The same with servos on a bus, behind a pseudo-terminal that has this name too, if one is given.
    pub fn with_servos(
        configs: &Path,
        options: &Options,
        link: Option<PathBuf>,
    ) -> anyhow::Result<(Self, ServoLine)> {
        let mut virtual_robot = Self::new(configs, options)?;
        let motions = virtual_robot.robot.servo_motions();
        let settings = ServoSettings::load(configs)?;
        let gripper = settings.gripper;
        let setup = VirtualBusSetup {
            settings,
            positions_rad: Place::ALL.map(|place| motions[place.index()].position_rad),
            link,
            ..VirtualBusSetup::default()
        };
        let bus = VirtualBus::open(&setup)?;
        let line = ServoLine { port: bus.path().to_owned(), zeros: bus.zeros() };
        virtual_robot.arms = VirtualArms::Bus { bus, gripper };
        Ok((virtual_robot, line))
    }
}

/// A robot that runs; ends when dropped.
pub struct HostedRobot {
    address: SocketAddr,
    faults: Arc<Mutex<Faults>>,
    counters: Arc<Counters>,
    heard: mpsc::Receiver<Heard>,
    truth: Output<Option<Truth>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<(), SimRobotError>>>,
}

impl HostedRobot {
    /// Switches a robot on.
    pub fn start(virtual_robot: VirtualRobot, seed: u64) -> std::io::Result<Self> {
        let VirtualRobot { mut robot, mut board, arms } = virtual_robot;
        let socket = UdpSocket::bind("127.0.0.1:0")?;
        let address = socket.local_addr()?;
        let (faults, counters) = (Arc::new(Mutex::new(Faults::default())), Arc::new(Counters::default()));
        let stop = Arc::new(AtomicBool::new(false));
        let (tell, heard) = mpsc::channel();
        let (mut truth_in, truth) = TripleBuffer::new(&None).split();
        let thread = {
            let (faults, counters, stop) = (Arc::clone(&faults), Arc::clone(&counters), Arc::clone(&stop));
            std::thread::Builder::new().name("virtual-go1".into()).spawn(move || {
                let plan: &[Planned] = &[];
                let host = Host {
                    socket: &socket,
                    faults: &faults,
                    plan,
                    heard: Some(tell),
                    counters: &counters,
                    stop: &stop,
                    seed,
                };
                serve(&mut robot, &mut board, &arms, &mut truth_in, &host)
            })?
        };
        Ok(Self { address, faults, counters, heard, truth, stop, thread: Some(thread) })
    }

    /// Where its board listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Changes what goes wrong.
    pub fn set_faults(&self, faults: Faults) {
        *self.faults.lock().unwrap_or_else(PoisonError::into_inner) = faults;
    }

    /// The good commands since the last call, in order.
    pub fn heard(&self) -> impl Iterator<Item = Heard> {
        self.heard.try_iter()
    }

    /// The latest truth; nothing before the first.
    pub fn truth(&mut self) -> Option<Truth> {
        *self.truth.read()
    }

    /// What the real-time loop has to tell.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }
}

impl Drop for HostedRobot {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(Ok(Err(error))) = self.thread.take().map(JoinHandle::join) {
            tracing::error!(%error, "the virtual robot broke down");
        }
    }
}
