//! A relay in the line between the robot's program and the virtual robot's board: sees what is really sent.

use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::Result;

/// How often a waiting thread looks whether it should end.
const STOP_CHECK: Duration = Duration::from_millis(50);
/// Bytes of a command; where its motors begin, how long each is, where a motor's torque and stiffness are.
const COMMAND: usize = 614;
const FIRST: usize = 22;
const SLOT: usize = 27;
const TORQUE: usize = 9;
const STIFFNESS: usize = 11;

/// A command that passed.
#[derive(Debug, Clone, Copy)]
pub struct Passed {
    /// When.
    pub at: Instant,
    /// It asks the legs' motors for neither stiffness nor torque.
    pub damps: bool,
}

/// The relay; ends when dropped.
pub struct Relay {
    address: SocketAddr,
    passed: Arc<Mutex<Vec<Passed>>>,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Relay {
    /// Relays to this board.
    pub fn start(board: SocketAddr) -> Result<Self> {
        let (front, back) = (UdpSocket::bind("127.0.0.1:0")?, UdpSocket::bind("127.0.0.1:0")?);
        back.connect(board)?;
        for socket in [&front, &back] {
            socket.set_read_timeout(Some(STOP_CHECK))?;
        }
        let address = front.local_addr()?;
        let passed = Arc::new(Mutex::new(Vec::new()));
        let stop = Arc::new(AtomicBool::new(false));
        let robot = Arc::new(Mutex::new(None));
        let forth = {
            let (front, back) = (front.try_clone()?, back.try_clone()?);
            let (passed, stop, robot) = (Arc::clone(&passed), Arc::clone(&stop), Arc::clone(&robot));
            std::thread::spawn(move || {
                let mut buffer = [0; 2048];
                while !stop.load(Ordering::Relaxed) {
                    let Ok((length, from)) = front.recv_from(&mut buffer) else { continue };
                    let seen = Passed { at: Instant::now(), damps: damps(&buffer[..length]) };
                    passed.lock().unwrap_or_else(PoisonError::into_inner).push(seen);
                    *robot.lock().unwrap_or_else(PoisonError::into_inner) = Some(from);
                    // A board that is away is silent; so is this line.
                    let _ = back.send(&buffer[..length]);
                }
            })
        };
        let forth_and_back = {
            let stop = Arc::clone(&stop);
            std::thread::spawn(move || {
                let mut buffer = [0; 2048];
                while !stop.load(Ordering::Relaxed) {
                    let Ok(length) = back.recv(&mut buffer) else { continue };
                    let to = *robot.lock().unwrap_or_else(PoisonError::into_inner);
                    if let Some(robot) = to {
                        let _ = front.send_to(&buffer[..length], robot);
                    }
                }
            })
        };
        Ok(Self { address, passed, stop, threads: vec![forth, forth_and_back] })
    }

    /// Where the board seems to be.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The commands that passed since the last call.
    pub fn take(&self) -> Vec<Passed> {
        std::mem::take(&mut *self.passed.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A thread that panicked has said so already.
            let _ = thread.join();
        }
    }
}

/// Read by the byte table of the datagram, not by the code under test.
fn damps(datagram: &[u8]) -> bool {
    datagram.len() == COMMAND
        && (0..12).all(|motor| {
            let slot = &datagram[FIRST + SLOT * motor..];
            slot[TORQUE..TORQUE + 2] == [0, 0] && slot[STIFFNESS..STIFFNESS + 2] == [0, 0]
        })
}
