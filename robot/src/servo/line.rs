//! The serial line: bytes out, bytes in before a deadline.

use std::{
    fs::{self, File, OpenOptions},
    io::{self, Read, Write},
    os::{fd::AsFd, unix::fs::OpenOptionsExt},
    path::Path,
    time::Instant,
};

use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    fs::OFlags,
    termios::{ControlModes, OptionalActions, QueueSelector, ioctl_tiocexcl, tcflush, tcgetattr, tcsetattr},
};

use super::{AUTO_PORT, ServoError};

/// USB vendor and product of the U2D2, the adapter that the maker sells for these servos.
const U2D2: [&str; 2] = ["0403", "6014"];

/// A line to servos.
pub trait Line: Send {
    /// Sends all bytes.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Waits until the deadline for bytes; 0 if none came.
    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<usize>;

    /// Forgets what has come and was not taken.
    fn forget_input(&mut self) -> io::Result<()>;

    /// Changes the speed, bits a second.
    fn set_baud(&mut self, baud: u32) -> io::Result<()>;
}

/// A serial port, or a pseudo-terminal.
#[derive(Debug)]
pub struct SerialLine {
    port: File,
}

impl SerialLine {
    /// Opens a port: raw bytes, eight bits, no parity, one stop bit; no other user may open it meanwhile.
    pub fn open(port: &str, baud: u32) -> Result<Self, ServoError> {
        let opened = || -> io::Result<Self> {
            let flags = OFlags::NOCTTY | OFlags::NONBLOCK;
            let port = OpenOptions::new()
                .read(true)
                .write(true)
                .custom_flags(flags.bits().cast_signed())
                .open(port)?;
            ioctl_tiocexcl(&port)?;
            let mut line = Self { port };
            line.set_baud(baud)?;
            Ok(line)
        };
        opened().map_err(|source| ServoError::Open { port: port.to_owned(), source })
    }
}

impl Line for SerialLine {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.write_all(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<usize> {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() || !readable(&self.port, left)? {
            return Ok(0);
        }
        match self.port.read(buffer) {
            // Readable and empty: it has gone.
            Ok(0) => Err(io::ErrorKind::BrokenPipe.into()),
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => {
                Ok(0)
            }
            outcome => outcome,
        }
    }

    fn forget_input(&mut self) -> io::Result<()> {
        Ok(tcflush(&self.port, QueueSelector::IFlush)?)
    }

    fn set_baud(&mut self, baud: u32) -> io::Result<()> {
        let mut modes = tcgetattr(&self.port)?;
        modes.make_raw();
        modes.control_modes |= ControlModes::CLOCAL | ControlModes::CREAD;
        modes.control_modes -= ControlModes::CSTOPB | ControlModes::CRTSCTS;
        modes.set_speed(baud)?;
        Ok(tcsetattr(&self.port, OptionalActions::Now, &modes)?)
    }
}

/// Waits until there is something to read, or the end of the line; false if nothing came within the time.
pub fn readable(port: impl AsFd, within: std::time::Duration) -> io::Result<bool> {
    let timeout = Timespec {
        tv_sec: i64::try_from(within.as_secs()).unwrap_or(i64::MAX),
        tv_nsec: within.subsec_nanos().into(),
    };
    match poll(&mut [PollFd::new(&port, PollFlags::IN)], Some(&timeout)) {
        Ok(ready) => Ok(ready > 0),
        // Waiting goes on with what is left of the time.
        Err(rustix::io::Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

/// The port of the settings; with [`AUTO_PORT`] that of the only U2D2.
pub fn find_port(wanted: &str) -> Result<String, ServoError> {
    if wanted != AUTO_PORT {
        return Ok(wanted.to_owned());
    }
    let entries = fs::read_dir("/sys/class/tty")?;
    let mut found: Vec<String> = entries
        .filter_map(|entry| {
            let entry = entry.ok()?;
            let device = fs::canonicalize(entry.path().join("device")).ok()?;
            is_u2d2(&device).then(|| format!("/dev/{}", entry.file_name().display()))
        })
        .collect();
    match (found.len(), found.pop()) {
        (1, Some(port)) => Ok(port),
        (found, _) => Err(ServoError::Port { found }),
    }
}

/// Whether a device of the kernel's belongs to a U2D2: the USB device is one of the folders above it.
fn is_u2d2(device: &Path) -> bool {
    let holds = |folder: &Path, file: &str, expected: &str| {
        fs::read_to_string(folder.join(file)).is_ok_and(|text| text.trim() == expected)
    };
    device.ancestors().any(|folder| holds(folder, "idVendor", U2D2[0]) && holds(folder, "idProduct", U2D2[1]))
}

/// How long a port's adapter waits for more bytes before it hands over what it has, ms; nothing if it has no such
/// timer. 16 by default, which halves the bus's rate; 1 is right.
pub fn latency_timer_ms(port: &str) -> Option<u32> {
    let path = fs::canonicalize(port).ok()?;
    let name = path.file_name()?.to_str()?;
    fs::read_to_string(format!("/sys/bus/usb-serial/devices/{name}/latency_timer")).ok()?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_adapter_is_known_by_its_usb_ids_however_deep_the_port_stands() {
        let usb = tempfile::tempdir().unwrap();
        let port = usb.path().join("1-1:1.0/ttyUSB0");
        fs::create_dir_all(&port).unwrap();
        fs::write(usb.path().join("idVendor"), "0403\n").unwrap();
        fs::write(usb.path().join("idProduct"), "6014\n").unwrap();
        assert!(is_u2d2(&port));
        fs::write(usb.path().join("idProduct"), "6001\n").unwrap();
        assert!(!is_u2d2(&port));
    }

    #[test]
    fn a_port_that_is_not_there_is_told_with_its_name() {
        let error = SerialLine::open("/dev/ttyNowhere", 1_000_000).unwrap_err().to_string();
        assert!(error.contains("/dev/ttyNowhere"), "{error}");
    }
}
