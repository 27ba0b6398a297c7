//! The virtual bus as others see it: a pseudo-terminal that takes as long as a real line would.

use std::f64::consts::PI;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::{OpenOptionsExt, symlink};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::{pace::sleep_until, realtime};
use locoman_robot::servo::registers::{self as reg, baud_code, kept_settings};
use locoman_robot::servo::wire::{Scanner, timing};
use locoman_robot::servo::{Angles, Place, SERVOS, ServoSettings, Zeros, readable};
use rustix::fs::OFlags;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use super::chain::{Chain, Reply};
use super::fault::ServoFault;
use super::servo::{JointMotion, ServoGoal, VirtualServo};
use super::table::Table;

/// How often the thread looks whether it should end.
const STOP_CHECK: Duration = Duration::from_millis(50);

/// How the virtual bus is.
#[derive(Debug, Clone)]
pub struct VirtualBusSetup {
    /// Ids, directions, baud rate and ranges.
    pub settings: ServoSettings,
    /// Encoder counts at joint angle 0.
    pub zero_counts: [i32; SERVOS],
    /// Where the joints stand at first, rad.
    pub positions_rad: [f64; SERVOS],
    /// Version of the servos' program: from 46 on they know the fast sync read.
    pub firmware: u8,
    /// The servos are as the maker delivers them: id 1, 57,600 baud.
    pub new_servos: bool,
    /// Bytes take as long as on a real line.
    pub line_time: bool,
    /// A name for the pseudo-terminal that stays the same: a link that is made anew.
    pub link: Option<PathBuf>,
}

impl Default for VirtualBusSetup {
    /// Servos that are set up, assembled as the authors' robot, arms folded, jaws closed.
    fn default() -> Self {
        let folded = -PI;
        Self {
            settings: ServoSettings::default(),
            // Joint 1 of either arm stands at count 0 when it is folded, at -pi.
            zero_counts: [2048, 0, 0, 2048, 0, 0, 0, 0],
            positions_rad: [folded, -0.05, 0.0, folded, 0.05, 0.0, 0.02, 0.02],
            firmware: 52,
            new_servos: false,
            line_time: true,
            link: None,
        }
    }
}

/// Why there is no virtual bus.
#[derive(Debug, thiserror::Error)]
pub enum VirtualBusError {
    /// No pseudo-terminal.
    #[error("cannot make a pseudo-terminal: {0}; is /dev/pts mounted?")]
    Terminal(#[from] io::Error),
    /// The link could not be made.
    #[error("cannot link {link} to the pseudo-terminal: {source}")]
    Link {
        /// The link.
        link: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The thread did not start.
    #[error("cannot start the virtual bus's thread: {0}")]
    Thread(io::Error),
}

/// A bus that answers until it is dropped.
#[derive(Debug)]
pub struct VirtualBus {
    chain: Arc<Mutex<Chain>>,
    zeros: Zeros,
    path: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl VirtualBus {
    /// Makes the pseudo-terminal and answers on it.
    pub fn open(setup: &VirtualBusSetup) -> Result<Self, VirtualBusError> {
        let (line, other_end, terminal) = pair()?;
        let path = match &setup.link {
            None => terminal,
            Some(link) => {
                relink(Path::new(&terminal), link)
                    .map_err(|source| VirtualBusError::Link { link: link.clone(), source })?;
                link.display().to_string()
            }
        };
        let zeros = Zeros::with_counts(&setup.settings, setup.zero_counts);
        let chain = Arc::new(Mutex::new(Chain { servos: servos(setup, &zeros) }));
        let stop = Arc::new(AtomicBool::new(false));
        let worker = Worker {
            line,
            _other_end: other_end,
            chain: Arc::clone(&chain),
            stop: Arc::clone(&stop),
            line_time: setup.line_time,
        };
        let thread = thread::Builder::new()
            .name("virtual servos".into())
            .spawn(move || worker.run())
            .map_err(VirtualBusError::Thread)?;
        Ok(Self { chain, zeros, path, stop, thread: Some(thread) })
    }

    /// What the driver opens.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// The zeros' file of these servos, as a person would have found it.
    pub fn zeros(&self) -> Zeros {
        self.zeros
    }

    /// Takes in what the joints do, in the order of places; from then on the servos do not move by themselves.
    pub fn feed(&self, motions: &[JointMotion; SERVOS]) {
        for (servo, motion) in lock(&self.chain).servos.iter_mut().zip(motions) {
            servo.feed(*motion);
        }
    }

    /// What the servos have been told, in the order of places.
    pub fn goals(&self) -> [ServoGoal; SERVOS] {
        let now_ns = monotonic_ns();
        let mut chain = lock(&self.chain);
        std::array::from_fn(|index| {
            chain.servos[index].step(now_ns);
            chain.servos[index].goal()
        })
    }

    /// Where the joints are, in the order of places.
    pub fn motions(&self) -> [JointMotion; SERVOS] {
        let chain = lock(&self.chain);
        std::array::from_fn(|index| chain.servos[index].motion())
    }

    /// Something happens to one servo.
    pub fn inject(&self, place: Place, fault: ServoFault) {
        lock(&self.chain).servos[place.index()].inject(fault);
    }
}

impl Drop for VirtualBus {
    /// The line goes, as when the adapter is pulled out.
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A thread that died has answered nobody any more: nothing is left to do.
            let _ = thread.join();
        }
    }
}

fn servos(setup: &VirtualBusSetup, zeros: &Zeros) -> Vec<VirtualServo> {
    let servo = |place: Place| {
        let mut table = Table::new(setup.firmware);
        if !setup.new_servos {
            table.put(reg::ID, setup.settings.id(place).into());
            table.put(reg::BAUD_RATE, baud_code(setup.settings.baud).unwrap_or_default().into());
            for (register, value) in kept_settings() {
                table.put_any(register, value);
            }
        }
        let angles = Angles::new(zeros.of(place), setup.settings.range_rad(place));
        VirtualServo::new(table, angles, setup.settings.motor, setup.positions_rad[place.index()])
    };
    Place::ALL.map(servo).into()
}

/// A new pseudo-terminal that passes all bytes as they are: our end, the other one, and its path.
fn pair() -> io::Result<(File, File, String)> {
    let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    grantpt(&ours)?;
    unlockpt(&ours)?;
    let path = ptsname(&ours, Vec::new())?.to_string_lossy().into_owned();
    let flags = OFlags::NOCTTY.bits().cast_signed();
    let other = OpenOptions::new().read(true).write(true).custom_flags(flags).open(&path)?;
    let mut modes = tcgetattr(&other)?;
    modes.make_raw();
    tcsetattr(&other, OptionalActions::Now, &modes)?;
    Ok((ours.into(), other, path))
}

/// Makes the link anew, at once: nobody ever finds none.
fn relink(terminal: &Path, link: &Path) -> io::Result<()> {
    let mut name = link.file_name().unwrap_or_default().to_owned();
    name.push(".new");
    let fresh = link.with_file_name(name);
    if fresh.is_symlink() {
        std::fs::remove_file(&fresh)?;
    }
    symlink(terminal, &fresh)?;
    std::fs::rename(&fresh, link)
}

struct Worker {
    line: File,
    /// Kept open, so that the line lives on between two drivers.
    _other_end: File,
    chain: Arc<Mutex<Chain>>,
    stop: Arc<AtomicBool>,
    line_time: bool,
}

impl Worker {
    fn run(mut self) {
        realtime::run_before_others();
        let mut scanner = Scanner::default();
        let mut buffer = [0; 1024];
        // When the last bit on the line has passed.
        let mut free_ns = 0;
        while !self.stop.load(Ordering::Relaxed) {
            match readable(&self.line, STOP_CHECK) {
                Ok(true) => {}
                Ok(false) => continue,
                Err(_) => return,
            }
            let Ok(bytes) = self.line.read(&mut buffer) else { return };
            // At a speed that is none, nobody hears anything.
            let Some(baud) = self.baud() else { continue };
            free_ns = free_ns.max(monotonic_ns()) + self.line_ns(bytes, baud);
            scanner.push(&buffer[..bytes]);
            while let Some(packet) = scanner.next_packet() {
                let Reply { bytes, delay } = lock(&self.chain).answer(&packet, baud, monotonic_ns());
                if !bytes.is_empty() {
                    free_ns += self.line_ns(bytes.len(), baud) + delay.as_nanos() as u64;
                    sleep_until(free_ns, 0);
                    // Nobody may be there to read any more; the next driver starts anew.
                    let _ = self.line.write_all(&bytes);
                }
            }
        }
    }

    /// The speed that the other side has set.
    fn baud(&self) -> Option<u32> {
        tcgetattr(&self.line).ok().map(|modes| modes.output_speed()).filter(|baud| *baud > 0)
    }

    /// How long so many bytes take, ns.
    fn line_ns(&self, bytes: usize, baud: u32) -> u64 {
        if self.line_time { timing::bytes_ns(bytes, baud) } else { 0 }
    }
}

/// The chain of servos; that of a thread that died is whole too, for each packet is answered whole.
fn lock(chain: &Mutex<Chain>) -> MutexGuard<'_, Chain> {
    chain.lock().unwrap_or_else(PoisonError::into_inner)
}
