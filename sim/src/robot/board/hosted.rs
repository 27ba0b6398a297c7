//! A virtual Go1 on threads of this process, on a free port: for tests and evaluations, which look behind it.

use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::JoinHandle;

use locoman_robot::go1::Go1Settings;
use locoman_robot::plant::JointCommand;
use triple_buffer::{Output, TripleBuffer};

use super::{Faults, Heard, Host, Mainboard, Planned, serve};
use crate::robot::machine::{Options, SimRobot};
use crate::robot::server::Counters;
use crate::robot::{SimRobotError, Truth};

/// What a board is made of: for those who run [`serve`] themselves.
pub struct HostedSetup {
    /// The machine.
    pub robot: SimRobot,
    /// The board in front of it.
    pub board: Mainboard,
    /// What the arms hold.
    pub arms: JointCommand,
}

impl HostedSetup {
    /// A robot of a configuration folder; its arms hold where they are.
    pub fn new(configs: &Path, options: &Options) -> anyhow::Result<Self> {
        let mut robot = SimRobot::new(configs, options)?;
        let mut arms = JointCommand::damping();
        arms.position = robot.truth().joint_position;
        // Zero gains: the servos hold with their own.
        arms.kd.rows_mut(12, 6).fill(0.0);
        Ok(Self { robot, board: Mainboard::new(Go1Settings::load(configs)?.feet), arms })
    }
}

/// The robot; ends when dropped.
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
    pub fn start(configs: &Path, options: &Options) -> anyhow::Result<Self> {
        let HostedSetup { mut robot, mut board, arms } = HostedSetup::new(configs, options)?;
        let socket = UdpSocket::bind("127.0.0.1:0")?;
        let address = socket.local_addr()?;
        let (faults, counters) = (Arc::new(Mutex::new(Faults::default())), Arc::new(Counters::default()));
        let stop = Arc::new(AtomicBool::new(false));
        let (tell, heard) = mpsc::channel();
        let (mut truth_in, truth) = TripleBuffer::new(&None).split();
        let thread = {
            let (faults, counters, stop) = (Arc::clone(&faults), Arc::clone(&counters), Arc::clone(&stop));
            let seed = options.seed;
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
