//! The simulated robot behind a UDP socket: `locoman-sim robot`.

use std::{
    io::ErrorKind,
    net::{SocketAddr, UdpSocket},
    time::{Duration, Instant},
};

use super::{
    JointCommand, Plant, PlantError, Sensors,
    wire::{self, MAX_DATAGRAM},
};

/// A simulated robot at a UDP address. Its samples pace the control loop.
#[derive(Debug)]
pub struct SimPlant {
    socket: UdpSocket,
    timeout: Duration,
    malformed: u64,
}

impl SimPlant {
    /// Opens a socket towards a simulator. `timeout` is how long [`Plant::exchange`] waits for a sample.
    ///
    /// Succeeds also while no simulator runs there: it may come later.
    pub fn open(address: SocketAddr, timeout: Duration) -> Result<Self, PlantError> {
        let any_port = if address.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
        let socket = UdpSocket::bind(any_port)?;
        socket.connect(address)?;
        Ok(Self { socket, timeout, malformed: 0 })
    }

    /// Datagrams that were no samples.
    pub fn malformed(&self) -> u64 {
        self.malformed
    }

    /// Waits for a datagram until the deadline; nothing if none came.
    fn receive(&self, buffer: &mut [u8], deadline: Instant) -> Result<Option<usize>, PlantError> {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(None);
        }
        self.socket.set_read_timeout(Some(left))?;
        received(self.socket.recv(buffer))
    }

    /// The next datagram that has already arrived.
    fn drain(&self, buffer: &mut [u8]) -> Result<Option<usize>, PlantError> {
        self.socket.set_nonblocking(true)?;
        let result = received(self.socket.recv(buffer));
        self.socket.set_nonblocking(false)?;
        result
    }

    fn decode(&mut self, datagram: &[u8]) -> Option<Sensors> {
        match wire::decode::<Sensors>(datagram) {
            Ok(sensors) => Some(sensors),
            Err(_) => {
                self.malformed += 1;
                None
            }
        }
    }
}

/// A simulator that is not there (refused) or says nothing (would block, timed out) is silence, not failure.
fn received(result: std::io::Result<usize>) -> Result<Option<usize>, PlantError> {
    match result {
        Ok(length) => Ok(Some(length)),
        Err(error) => match error.kind() {
            ErrorKind::WouldBlock
            | ErrorKind::TimedOut
            | ErrorKind::ConnectionRefused
            | ErrorKind::Interrupted => Ok(None),
            _ => Err(error.into()),
        },
    }
}

impl Plant for SimPlant {
    fn exchange(&mut self, command: &JointCommand) -> Result<Sensors, PlantError> {
        let mut buffer = [0; MAX_DATAGRAM];
        if let Ok(datagram) = wire::encode(command, &mut buffer) {
            // A refusal left over from an earlier datagram says only that the simulator was away.
            match self.socket.send(datagram) {
                Err(error) if error.kind() != ErrorKind::ConnectionRefused => return Err(error.into()),
                _ => {}
            }
        }
        let deadline = Instant::now() + self.timeout;
        let mut newest = None;
        while newest.is_none() && Instant::now() < deadline {
            match self.receive(&mut buffer, deadline)? {
                Some(length) => newest = self.decode(&buffer[..length]),
                // Refused at once: wait as long as for a silent one, so that nothing spins.
                None => std::thread::sleep(Duration::from_millis(1)),
            }
        }
        while let Some(length) = self.drain(&mut buffer)? {
            newest = self.decode(&buffer[..length]).or(newest);
        }
        newest.ok_or(PlantError::Silent { waited_ms: self.timeout.as_millis() as u64 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::JointVector;

    fn sample(time_ns: u64) -> Sensors {
        Sensors {
            time_ns,
            position: JointVector::zeros(),
            velocity: JointVector::zeros(),
            torque: JointVector::zeros(),
            opening: [0.0; 2],
            attitude: [1.0, 0.0, 0.0, 0.0],
            gyro: [0.0; 3],
            accelerometer: [0.0, 0.0, 9.81],
            foot_force: [0.0; 4],
        }
    }

    #[test]
    fn of_several_samples_the_newest_is_taken_and_garbage_is_counted() {
        let simulator = UdpSocket::bind("127.0.0.1:0").unwrap();
        let mut sut = SimPlant::open(simulator.local_addr().unwrap(), Duration::from_millis(20)).unwrap();
        // The first exchange tells the simulator where the robot is.
        assert!(matches!(sut.exchange(&JointCommand::damping()), Err(PlantError::Silent { .. })));
        let mut buffer = [0; MAX_DATAGRAM];
        let (length, robot) = simulator.recv_from(&mut buffer).unwrap();
        assert!(wire::decode::<JointCommand>(&buffer[..length]).is_ok());
        simulator.send_to(b"LMS1 is not all", robot).unwrap();
        for time_ns in [1, 2, 3] {
            let datagram = wire::encode(&sample(time_ns), &mut buffer).unwrap();
            simulator.send_to(datagram, robot).unwrap();
        }
        assert_eq!(sut.exchange(&JointCommand::damping()).unwrap().time_ns, 3);
        assert_eq!(sut.malformed(), 1);
    }

    #[test]
    fn a_simulator_that_is_not_there_is_silence() {
        let gone = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let mut sut = SimPlant::open(gone, Duration::from_millis(5)).unwrap();
        for _ in 0..3 {
            assert!(matches!(
                sut.exchange(&JointCommand::damping()),
                Err(PlantError::Silent { waited_ms: 5 })
            ));
        }
    }
}
