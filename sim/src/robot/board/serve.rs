//! The virtual Go1 in real time, behind its UDP port.
//!
//! Each millisecond is simulated at its end, with every command placed at the moment at which it came out of the
//! line: see [`super::super::server`], which does the same for its own wire.

use std::io::ErrorKind;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Duration;

use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::pace::sleep_until;
use locoman_protocol::realtime;
use locoman_robot::go1::LowCommand;
use triple_buffer::Input;

use super::gauntlet::Gauntlet;
use super::{Faults, Mainboard, Planned, VirtualArms};
use crate::robot::machine::SimRobot;
use crate::robot::server::Counters;
use crate::robot::{SimRobotError, Truth};

/// Time between two states, ns.
pub const STATE_NS: u64 = 1_000_000;
/// Further behind than this the past is given up.
const MAX_BEHIND_NS: u64 = 50_000_000;
/// How often a waiting thread looks whether it should end.
const STOP_CHECK: Duration = Duration::from_millis(100);
/// Longer than any command.
const BUFFER: usize = 2_048;
/// States between two truths: 200 Hz.
const TRUTH_EVERY: u32 = 5;

/// A good command as it came out of the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heard {
    /// When it came out of the line, ns of the monotonic clock.
    pub received_ns: u64,
    /// The command.
    pub command: LowCommand,
}

/// What the loop works with, beside the robot.
pub struct Host<'a> {
    /// The board's port.
    pub socket: &'a UdpSocket,
    /// What goes wrong; may be changed at any time.
    pub faults: &'a Mutex<Faults>,
    /// What will go wrong.
    pub plan: &'a [Planned],
    /// Where good commands are told, if anybody wants to know.
    pub heard: Option<mpsc::Sender<Heard>>,
    /// What the loop has to tell.
    pub counters: &'a Counters,
    /// Ends the loop.
    pub stop: &'a AtomicBool,
    /// Seed of the line's faults.
    pub seed: u64,
}

/// A datagram as it came in.
struct Arrival {
    datagram: Vec<u8>,
    from: SocketAddr,
    received_ns: u64,
}

/// Runs the robot until `stop`.
pub fn serve(
    robot: &mut SimRobot,
    board: &mut Mainboard,
    arms: &VirtualArms,
    truth: &mut Input<Option<Truth>>,
    host: &Host<'_>,
) -> Result<(), SimRobotError> {
    host.socket.set_read_timeout(Some(STOP_CHECK)).map_err(SimRobotError::Socket)?;
    let (sender, arrivals) = mpsc::channel();
    std::thread::scope(|scope| {
        scope.spawn(move || receive(host, &sender));
        let outcome = simulate(robot, board, arms, &arrivals, truth, host);
        host.stop.store(true, Ordering::Relaxed);
        outcome
    })
}

/// Stamps datagrams at their arrival.
fn receive(host: &Host<'_>, sender: &mpsc::Sender<Arrival>) {
    realtime::run_before_others();
    let mut buffer = [0; BUFFER];
    while !host.stop.load(Ordering::Relaxed) {
        match host.socket.recv_from(&mut buffer) {
            Ok((length, from)) => {
                let arrival =
                    Arrival { datagram: buffer[..length].to_vec(), from, received_ns: monotonic_ns() };
                if sender.send(arrival).is_err() {
                    return;
                }
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            // Refusals of earlier answers say nothing about the next command.
            Err(_) => std::thread::sleep(Duration::from_millis(1)),
        }
    }
}

fn simulate(
    robot: &mut SimRobot,
    board: &mut Mainboard,
    arms: &VirtualArms,
    arrivals: &mpsc::Receiver<Arrival>,
    truth: &mut Input<Option<Truth>>,
    host: &Host<'_>,
) -> Result<(), SimRobotError> {
    realtime::run_before_others();
    let (mut inwards, mut outwards) = (Gauntlet::new(host.seed, 0), Gauntlet::new(host.seed, 1));
    let mut peer = None;
    let mut tick_ms: u32 = 0;
    let mut plan: Vec<Planned> = host.plan.to_vec();
    let mut begin_ns = monotonic_ns();
    robot.set_time_ns(begin_ns);
    if matches!(arms, VirtualArms::Bus { .. }) {
        robot.leave_bus_to_others();
    }
    while !host.stop.load(Ordering::Relaxed) {
        let end_ns = begin_ns + STATE_NS;
        sleep_until(end_ns, 0);
        let faults = faults_now(host, &mut plan, tick_ms);
        for Arrival { datagram, from, received_ns } in arrivals.try_iter() {
            peer = Some(from);
            inwards.enter(&faults, datagram, received_ns);
        }
        // The servos' goals, and motors that have just failed, do not wait for the next command of the legs.
        let arms = arms.command(robot);
        robot.send(&board.joint_command(&arms, &faults), 0);
        while let Some((datagram, due_ns)) = inwards.leave(end_ns) {
            let Some(command) = board.take(&datagram) else {
                host.counters.malformed.fetch_add(1, Ordering::Relaxed);
                continue;
            };
            if let Some(heard) = &host.heard {
                // Nobody listens any more: then nobody is told.
                let _ = heard.send(Heard { received_ns: due_ns, command: *command });
            }
            robot.send(&board.joint_command(&arms, &faults), due_ns.saturating_sub(begin_ns));
        }
        let sensors = robot.advance_by(STATE_NS)?;
        tick_ms = tick_ms.wrapping_add(1);
        if board.is_awake() && !faults.silent {
            outwards.enter(&faults, board.state(&sensors, tick_ms, &faults), end_ns);
        }
        while let Some((datagram, _)) = outwards.leave(monotonic_ns()) {
            if let Some(address) = peer {
                // A controller that has gone away is no reason to stop: it may return.
                let _ = host.socket.send_to(&datagram, address);
            }
        }
        if tick_ms.is_multiple_of(TRUTH_EVERY) {
            truth.write(Some(robot.truth()));
        }

        begin_ns = end_ns;
        let behind_ns = monotonic_ns().saturating_sub(end_ns);
        if behind_ns > STATE_NS {
            host.counters.late_exchanges.fetch_add(1, Ordering::Relaxed);
        }
        if behind_ns > MAX_BEHIND_NS {
            host.counters.lost_ns.fetch_add(behind_ns, Ordering::Relaxed);
            begin_ns += behind_ns;
            robot.set_time_ns(begin_ns);
        }
    }
    Ok(())
}

/// Switches on what the plan says, and returns what is wrong now.
fn faults_now(host: &Host<'_>, plan: &mut Vec<Planned>, tick_ms: u32) -> Faults {
    let mut faults = host.faults.lock().unwrap_or_else(PoisonError::into_inner);
    plan.retain(|planned| {
        let due = planned.at_s * 1e3 <= f64::from(tick_ms);
        if due {
            faults.set(planned.fault);
        }
        !due
    });
    *faults
}
