//! The UDP socket towards the motor board: sends commands, reads the newest state, counts what goes wrong.
//!
//! States carry no sequence number, but the board's milliseconds since it began: they come once each millisecond.
//! A gap in them is loss; a step back is a datagram that was overtaken; the same again is nothing new. After a step
//! back by more than [`RESTART_MS`] the board has begun anew.

use std::{
    io::ErrorKind,
    net::{SocketAddr, UdpSocket},
};

use locoman_protocol::clock::monotonic_ns;

use super::{Checksum, DatagramError, LowCommand, LowState, state};

/// Overtaken datagrams are never so old, ms.
const RESTART_MS: u32 = 1_000;
/// Longer than any datagram of the board.
const BUFFER: usize = 2_048;
/// States read in one period at most: a flood must not keep commands from going out.
const MOST_AT_ONCE: usize = 64;

/// What has gone over the line since it was opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LineCounts {
    /// Commands sent.
    pub sent: u64,
    /// Commands that the system refused to send.
    pub unsent: u64,
    /// States that were newer than all before.
    pub received: u64,
    /// States that should have come by the board's clock, and had not when a later one came.
    pub lost: u64,
    /// States that came after a later one.
    pub reordered: u64,
    /// States with the time of the one before.
    pub repeated: u64,
    /// Datagrams with a wrong checksum.
    pub corrupt: u64,
    /// Datagrams that are something else.
    pub foreign: u64,
}

/// A state as it came in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Received {
    /// The state.
    pub state: LowState,
    /// Its bytes.
    pub raw: [u8; state::LENGTH],
    /// When it was read, ns of the monotonic clock.
    pub received_ns: u64,
    /// How its checksum was written.
    pub checksum: Checksum,
}

/// The line to one board.
#[derive(Debug)]
pub struct Line {
    socket: UdpSocket,
    checksum: Checksum,
    last_tick_ms: Option<u32>,
    counts: LineCounts,
}

impl Line {
    /// Takes the local port and addresses the board; nothing is sent yet. The board may come later.
    pub fn open(board: SocketAddr, local: SocketAddr, checksum: Checksum) -> std::io::Result<Self> {
        let socket = UdpSocket::bind(local)?;
        socket.connect(board)?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, checksum, last_tick_ms: None, counts: LineCounts::default() })
    }

    /// Sends a command. Never waits.
    pub fn send(&mut self, command: &LowCommand) {
        match self.socket.send(&command.encode(self.checksum)) {
            Ok(_) => self.counts.sent += 1,
            // The network is away or a refusal of an earlier datagram has arrived: the next one may get through.
            Err(_) => self.counts.unsent += 1,
        }
    }

    /// The newest of the states that have arrived since the last call, if any was new. Never waits.
    pub fn newest(&mut self) -> Option<Received> {
        let mut newest = None;
        let mut buffer = [0; BUFFER];
        for _ in 0..MOST_AT_ONCE {
            match self.socket.recv(&mut buffer) {
                Ok(length) => newest = self.judge(&buffer[..length]).or(newest),
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                // Refusals while no board is there.
                Err(_) => {}
            }
        }
        newest
    }

    /// What has gone over the line.
    pub fn counts(&self) -> LineCounts {
        self.counts
    }

    /// The port that it has.
    pub fn local(&self) -> std::io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    fn judge(&mut self, datagram: &[u8]) -> Option<Received> {
        let (state, checksum) = match LowState::decode(datagram) {
            Ok(decoded) => decoded,
            Err(DatagramError::Checksum { .. }) => {
                self.counts.corrupt += 1;
                return None;
            }
            Err(_) => {
                self.counts.foreign += 1;
                return None;
            }
        };
        let raw = *datagram.first_chunk()?;
        if let Some(last) = self.last_tick_ms {
            let ahead = state.tick_ms.wrapping_sub(last);
            let behind = last.wrapping_sub(state.tick_ms);
            if ahead == 0 {
                self.counts.repeated += 1;
                return None;
            }
            if behind < RESTART_MS {
                self.counts.reordered += 1;
                // It had been counted as lost.
                self.counts.lost = self.counts.lost.saturating_sub(1);
                return None;
            }
            if ahead < u32::MAX / 2 {
                self.counts.lost += u64::from(ahead - 1);
            }
        }
        self.last_tick_ms = Some(state.tick_ms);
        self.counts.received += 1;
        Some(Received { state, raw, received_ns: monotonic_ns(), checksum })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::go1::{Battery, MotorState, SLOTS};

    fn state(tick_ms: u32) -> Vec<u8> {
        let state = LowState {
            opening: [0; 20],
            quaternion_wxyz: [1.0, 0.0, 0.0, 0.0],
            gyroscope_rad_s: [0.0; 3],
            accelerometer_m_s2: [0.0, 0.0, 9.81],
            rpy_rad: [0.0; 3],
            imu_temperature_c: 30,
            motors: [MotorState::default(); SLOTS],
            battery: Battery::default(),
            feet: [0; 8],
            tick_ms,
            remote_bytes: [0; 40],
            reserve: [0; 4],
        };
        let mut raw = state.encode(Checksum::Plain).to_vec();
        raw.resize(state::SENT, 0);
        raw
    }

    fn pair() -> (UdpSocket, Line) {
        let board = UdpSocket::bind("127.0.0.1:0").unwrap();
        let any = SocketAddr::from(([127, 0, 0, 1], 0));
        let sut = Line::open(board.local_addr().unwrap(), any, Checksum::Plain).unwrap();
        board.connect(sut.local().unwrap()).unwrap();
        (board, sut)
    }

    #[test]
    fn the_newest_state_is_taken_and_everything_else_is_counted() {
        let (board, mut sut) = pair();
        for tick_ms in [10, 13, 12, 13, 14] {
            board.send(&state(tick_ms)).unwrap();
        }
        let mut damaged = state(15);
        damaged[100] ^= 1;
        board.send(&damaged).unwrap();
        board.send(b"hello").unwrap();
        assert_eq!(sut.newest().unwrap().state.tick_ms, 14);
        assert_eq!(
            sut.counts(),
            LineCounts {
                received: 3,
                lost: 1,
                reordered: 1,
                repeated: 1,
                corrupt: 1,
                foreign: 1,
                ..LineCounts::default()
            }
        );
        assert_eq!(sut.newest(), None);
    }

    #[test]
    fn a_board_that_begins_anew_is_met_anew() {
        let (board, mut sut) = pair();
        board.send(&state(100_000)).unwrap();
        assert!(sut.newest().is_some());
        board.send(&state(3)).unwrap();
        assert_eq!(sut.newest().unwrap().state.tick_ms, 3);
        assert_eq!((sut.counts().lost, sut.counts().reordered), (0, 0));
    }

    #[test]
    fn a_clock_that_runs_over_after_49_days_goes_on() {
        let (board, mut sut) = pair();
        board.send(&state(u32::MAX)).unwrap();
        board.send(&state(1)).unwrap();
        assert_eq!(sut.newest().unwrap().state.tick_ms, 1);
        assert_eq!((sut.counts().received, sut.counts().lost), (2, 1));
    }

    #[test]
    fn a_board_that_is_not_there_is_silence() {
        let (board, mut sut) = pair();
        drop(board);
        for _ in 0..5 {
            sut.send(&LowCommand::damping(3.0));
            assert_eq!(sut.newest(), None);
        }
        let counts = sut.counts();
        assert_eq!(counts.sent + counts.unsent, 5);
    }
}
