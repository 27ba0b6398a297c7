//! Between the controller and the sender: commands one way, states the other, each a datagram of its own.
//!
//! A pair of sockets of one machine that keeps datagrams apart and tells when the other end is closed, also by a
//! process that was killed (`SOCK_SEQPACKET`). A command travels as the very bytes that go to the motors, checksum
//! included; a state as the board's bytes behind a head of our own ([`Report`]). Nothing waits but [`FeedEnd::wait`].

use std::{
    io::ErrorKind,
    os::{fd::OwnedFd, unix::net::UnixDatagram},
    time::Duration,
};

use socket2::{Domain, Socket, Type};

use super::{LowCommand, LowState, bytes, command, line::LineCounts, state, watchdog::Verdict};
use crate::go1::Checksum;

/// One end.
#[derive(Debug)]
pub struct FeedEnd(UnixDatagram);

/// What came in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Arrival<T> {
    /// The newest of what had arrived.
    New(T),
    /// Nothing yet.
    Nothing,
    /// The other end is gone.
    Ended,
}

/// A state, and how the line does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// When it was sampled, ns of the monotonic clock.
    pub sample_ns: u64,
    /// When it was read from the socket, ns of the monotonic clock.
    pub received_ns: u64,
    /// How late the last command went out, ns.
    pub late_ns: u64,
    /// Periods in which no command went out because the sender was held up.
    pub missed: u64,
    /// What has gone over the line.
    pub counts: LineCounts,
    /// What the sender does.
    pub verdict: Verdict,
    /// The state.
    pub state: LowState,
}

/// Eleven numbers of eight bytes, one byte; then the state.
const HEAD: usize = 8 * 12 + 1;
const REPORT: usize = HEAD + state::LENGTH;

/// A pair of ends: the controller's, the sender's.
pub fn pair() -> std::io::Result<(FeedEnd, FeedEnd)> {
    let (ours, theirs) = Socket::pair(Domain::UNIX, Type::SEQPACKET, None)?;
    Ok((FeedEnd::new(ours.into())?, FeedEnd::new(theirs.into())?))
}

impl FeedEnd {
    /// An end that another process has left to this one.
    pub fn new(socket: OwnedFd) -> std::io::Result<Self> {
        let socket = UnixDatagram::from(socket);
        socket.set_nonblocking(true)?;
        Ok(Self(socket))
    }

    /// The socket, to be left to another process.
    pub fn into_fd(self) -> OwnedFd {
        self.0.into()
    }

    /// Sends a command; false if the other end is gone. One that does not keep up misses it.
    pub fn send_command(&self, command: &LowCommand) -> bool {
        self.send(&command.encode(Checksum::Plain))
    }

    /// Sends a state; false if the other end is gone. One that does not keep up misses it.
    pub fn send_report(&self, report: &Report, raw_state: &[u8; state::LENGTH]) -> bool {
        self.send(&report.encode(raw_state))
    }

    /// The newest command that has arrived. What is no command is passed over.
    pub fn newest_command(&self) -> Arrival<LowCommand> {
        let mut buffer = [0; command::LENGTH + 1];
        self.newest(&mut buffer, |bytes| LowCommand::decode(bytes).ok().map(|(command, _)| command))
    }

    /// The newest state that has arrived. What is no state is passed over.
    pub fn newest_report(&self) -> Arrival<Report> {
        let mut buffer = [0; REPORT + 1];
        self.newest(&mut buffer, Report::decode)
    }

    /// Waits until there is something to read, or the other end is gone, or the time is over.
    pub fn wait(&self, timeout: Duration) {
        use std::os::fd::AsRawFd;
        let timeout = libc::timespec {
            tv_sec: libc::time_t::try_from(timeout.as_secs()).unwrap_or(libc::time_t::MAX),
            tv_nsec: libc::c_long::from(timeout.subsec_nanos()),
        };
        let mut poll = libc::pollfd { fd: self.0.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        // SAFETY: both pointers are to live locals, one of them to one entry; no signal mask is set. Whatever it
        // returns, the next read tells what there is.
        unsafe { libc::ppoll(&raw mut poll, 1, &raw const timeout, std::ptr::null()) };
    }

    fn send(&self, datagram: &[u8]) -> bool {
        match self.0.send(datagram) {
            Ok(_) => true,
            Err(error) => matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted),
        }
    }

    fn newest<T>(&self, buffer: &mut [u8], decode: impl Fn(&[u8]) -> Option<T>) -> Arrival<T> {
        let mut newest = None;
        loop {
            match self.0.recv(buffer) {
                // No datagram of ours is empty: the end of the connection.
                Ok(0) => return Arrival::Ended,
                Ok(length) => newest = decode(&buffer[..length]).or(newest),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    return newest.map_or(Arrival::Nothing, Arrival::New);
                }
                Err(_) => return Arrival::Ended,
            }
        }
    }
}

impl Report {
    fn numbers(&self) -> [u64; 12] {
        let LineCounts { sent, unsent, received, lost, reordered, repeated, corrupt, foreign } = self.counts;
        let Self { sample_ns, received_ns, late_ns, missed, .. } = *self;
        [
            sample_ns,
            received_ns,
            late_ns,
            missed,
            sent,
            unsent,
            received,
            lost,
            reordered,
            repeated,
            corrupt,
            foreign,
        ]
    }

    fn encode(&self, raw_state: &[u8; state::LENGTH]) -> [u8; REPORT] {
        let mut raw = [0; REPORT];
        for (place, number) in self.numbers().into_iter().enumerate() {
            bytes::put(&mut raw, 8 * place, number.to_le_bytes());
        }
        raw[HEAD - 1] = self.verdict as u8;
        raw[HEAD..].copy_from_slice(raw_state);
        raw
    }

    fn decode(raw: &[u8]) -> Option<Self> {
        let raw: &[u8; REPORT] = raw.try_into().ok()?;
        let [
            sample_ns,
            received_ns,
            late_ns,
            missed,
            sent,
            unsent,
            received,
            lost,
            reordered,
            repeated,
            corrupt,
            foreign,
        ] = std::array::from_fn(|place| u64::from_le_bytes(bytes::take(raw, 8 * place)));
        let (state, _) = LowState::decode(&raw[HEAD..]).ok()?;
        Some(Self {
            sample_ns,
            received_ns,
            late_ns,
            missed,
            counts: LineCounts { sent, unsent, received, lost, reordered, repeated, corrupt, foreign },
            verdict: *Verdict::ALL.get(usize::from(raw[HEAD - 1]))?,
            state,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::go1::{Battery, MotorState, SLOTS};

    fn report() -> (Report, [u8; state::LENGTH]) {
        let state = LowState {
            opening: [4; 20],
            quaternion_wxyz: [1.0, 0.0, 0.0, 0.0],
            gyroscope_rad_s: [0.1; 3],
            accelerometer_m_s2: [0.0, 0.0, 9.81],
            rpy_rad: [0.0; 3],
            imu_temperature_c: 30,
            motors: [MotorState { mode: 10, q_rad: 0.5, ..MotorState::default() }; SLOTS],
            battery: Battery { charge_percent: 87, ..Battery::default() },
            feet: [7; 8],
            tick_ms: 9,
            remote_bytes: [0; 40],
            reserve: [0; 4],
        };
        let report = Report {
            sample_ns: 1,
            received_ns: 2,
            late_ns: 3,
            missed: 4,
            counts: LineCounts {
                sent: 5,
                unsent: 6,
                received: 7,
                lost: 8,
                reordered: 9,
                repeated: 10,
                corrupt: 11,
                foreign: 12,
            },
            verdict: Verdict::DampRemote,
            state,
        };
        (report, state.encode(Checksum::Encrypted))
    }

    #[test]
    fn both_ways_the_newest_arrives_as_it_was_sent() {
        let (controller, sender) = pair().unwrap();
        assert_eq!(sender.newest_command(), Arrival::Nothing);
        assert!(controller.send_command(&LowCommand::damping(1.0)));
        assert!(controller.send_command(&LowCommand::damping(2.0)));
        assert_eq!(sender.newest_command(), Arrival::New(LowCommand::damping(2.0)));
        let (report, raw) = report();
        assert!(sender.send_report(&report, &raw));
        controller.wait(Duration::from_secs(5));
        assert_eq!(controller.newest_report(), Arrival::New(report));
    }

    #[test]
    fn an_end_that_is_closed_is_noticed_and_one_that_is_slow_misses_some() {
        let (controller, sender) = pair().unwrap();
        for _ in 0..10_000 {
            assert!(controller.send_command(&LowCommand::default()));
        }
        assert!(matches!(sender.newest_command(), Arrival::New(_)));
        drop(controller);
        assert_eq!(sender.newest_command(), Arrival::Ended);
        let (report, raw) = report();
        assert!(!sender.send_report(&report, &raw));
    }
}
