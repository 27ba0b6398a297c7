//! The simulated robot in real time, behind a UDP socket.
//!
//! Each exchange of 2.5 ms is simulated at its end, with every command placed at the moment at which it
//! arrived: to the robot it looks like a machine that runs at 2 kHz, at a fifth of the wake-ups. When this
//! thread was held up, it catches up exchange by exchange; after [`MAX_BEHIND_NS`] it lets time go and counts
//! what it lost.

use std::io::ErrorKind;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc;
use std::time::Duration;

use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::pace::sleep_until;
use locoman_protocol::realtime;
use locoman_robot::plant::JointCommand;
use locoman_robot::plant::wire::{self, MAX_DATAGRAM};
use triple_buffer::Input;

use super::machine::SimRobot;
use super::world::Truth;
use super::{EXCHANGE_NS, SimRobotError};

/// Further behind than this the past is given up: 20 exchanges.
const MAX_BEHIND_NS: u64 = 50_000_000;
/// How often a waiting thread looks whether it should end.
const STOP_CHECK: Duration = Duration::from_millis(100);

/// What the real-time loop has to tell; read from other threads.
#[derive(Debug, Default)]
pub struct Counters {
    /// Exchanges that were simulated more than one exchange late.
    pub late_exchanges: AtomicU64,
    /// Time that was given up, ns.
    pub lost_ns: AtomicU64,
    /// Datagrams that were no commands.
    pub malformed: AtomicU64,
}

/// A command as it came in.
struct Arrival {
    command: JointCommand,
    from: SocketAddr,
    received_ns: u64,
}

/// Runs the robot until `stop`: commands in, sensors out to whoever commanded last, truth into the buffer.
pub fn serve(
    robot: &mut SimRobot,
    socket: &UdpSocket,
    truth: &mut Input<Option<Truth>>,
    counters: &Counters,
    stop: &AtomicBool,
) -> Result<(), SimRobotError> {
    socket.set_read_timeout(Some(STOP_CHECK)).map_err(SimRobotError::Socket)?;
    let (sender, arrivals) = mpsc::channel();
    std::thread::scope(|scope| {
        scope.spawn(move || receive(socket, &sender, counters, stop));
        let outcome = simulate(robot, socket, &arrivals, truth, counters, stop);
        stop.store(true, Ordering::Relaxed);
        outcome
    })
}

/// Stamps commands at their arrival.
fn receive(socket: &UdpSocket, sender: &mpsc::Sender<Arrival>, counters: &Counters, stop: &AtomicBool) {
    realtime::run_before_others();
    let mut buffer = [0; MAX_DATAGRAM];
    while !stop.load(Ordering::Relaxed) {
        match socket.recv_from(&mut buffer) {
            Ok((length, from)) => match wire::decode(&buffer[..length]) {
                Ok(command) => {
                    let arrival = Arrival { command, from, received_ns: monotonic_ns() };
                    if sender.send(arrival).is_err() {
                        return;
                    }
                }
                Err(_) => {
                    counters.malformed.fetch_add(1, Ordering::Relaxed);
                }
            },
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            // Refusals of earlier answers and the like say nothing about the next command.
            Err(_) => std::thread::sleep(Duration::from_millis(1)),
        }
    }
}

fn simulate(
    robot: &mut SimRobot,
    socket: &UdpSocket,
    arrivals: &mpsc::Receiver<Arrival>,
    truth: &mut Input<Option<Truth>>,
    counters: &Counters,
    stop: &AtomicBool,
) -> Result<(), SimRobotError> {
    let mut buffer = [0; MAX_DATAGRAM];
    let mut commander = None;
    if !realtime::run_before_others() {
        tracing::info!(
            "no real-time priority (it takes root or an rtprio limit); a busy machine will be felt"
        );
    }
    let mut begin_ns = monotonic_ns();
    robot.set_time_ns(begin_ns);
    while !stop.load(Ordering::Relaxed) {
        let end_ns = begin_ns + EXCHANGE_NS;
        // No watching of the clock: the exchange is simulated as of `end_ns` however late it is, and the core
        // is better spent on the tracker beside it.
        sleep_until(end_ns, 0);
        for Arrival { command, from, received_ns } in arrivals.try_iter() {
            robot.send(&command, received_ns.saturating_sub(begin_ns));
            commander = Some(from);
        }
        let sensors = robot.advance()?;
        if let Some(address) = commander
            && let Ok(datagram) = wire::encode(&sensors, &mut buffer)
        {
            // A robot that has gone away is no reason to stop: it may return.
            let _ = socket.send_to(datagram, address);
        }
        truth.write(Some(robot.truth()));

        begin_ns = end_ns;
        let behind_ns = monotonic_ns().saturating_sub(end_ns);
        if behind_ns > EXCHANGE_NS {
            counters.late_exchanges.fetch_add(1, Ordering::Relaxed);
        }
        if behind_ns > MAX_BEHIND_NS {
            counters.lost_ns.fetch_add(behind_ns, Ordering::Relaxed);
            begin_ns += behind_ns;
            robot.set_time_ns(begin_ns);
        }
    }
    Ok(())
}
