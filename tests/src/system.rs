//! Simulator, robot and station as processes that can be killed and started again.

use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use anyhow::{Context, Result};

use crate::programs::program;

/// A process of the system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// `locoman-sim robot`
    Simulator,
    /// `locoman-robot run`
    Robot,
    /// `locoman-teleop run`
    Station,
}

/// The processes; killed when dropped.
pub struct System {
    plant: String,
    robot: String,
    sim: String,
    console: String,
    recording: PathBuf,
    logs: PathBuf,
    wires: Option<Wires>,
    children: [Option<Child>; 3],
}

/// The real robot's wires in place of the simulator's own.
#[derive(Debug, Clone)]
pub struct Wires {
    /// Where the virtual robot's board listens.
    pub board: SocketAddr,
    /// Where the robot's program believes it to be: a relay, or the board itself.
    pub seen_at: SocketAddr,
    /// From where the program speaks.
    pub local: SocketAddr,
    /// Faults of the virtual robot.
    pub faults: Vec<String>,
}

impl Wires {
    /// Free ports, nothing in between, no faults.
    pub fn new() -> Result<Self> {
        let sockets = (0..2).map(|_| UdpSocket::bind("127.0.0.1:0")).collect::<Result<Vec<_>, _>>()?;
        let (board, local) = (sockets[0].local_addr()?, sockets[1].local_addr()?);
        Ok(Self { board, seen_at: board, local, faults: Vec::new() })
    }
}

impl System {
    /// Picks free ports; starts nothing yet. Logs go to `logs`.
    pub fn new(recording: &Path, logs: &Path) -> Result<Self> {
        let listeners = (0..4).map(|_| TcpListener::bind("127.0.0.1:0")).collect::<Result<Vec<_>, _>>()?;
        let ports = listeners.iter().map(TcpListener::local_addr).collect::<Result<Vec<_>, _>>()?;
        std::fs::create_dir_all(logs)?;
        Ok(Self {
            plant: ports[0].to_string(),
            robot: format!("tcp/{}", ports[1]),
            sim: format!("tcp/{}", ports[2]),
            console: ports[3].to_string(),
            recording: recording.to_owned(),
            logs: logs.to_owned(),
            wires: None,
            children: [None, None, None],
        })
    }

    /// The same over the real robot's wires. The robot stands up by itself.
    pub fn on_wires(wires: &Wires, logs: &Path) -> Result<Self> {
        let mut system = Self::new(Path::new("none"), logs)?;
        system.wires = Some(wires.clone());
        Ok(system)
    }

    /// Id of a part's process.
    pub fn id(&self, part: Part) -> Option<u32> {
        self.children[part as usize].as_ref().map(Child::id)
    }

    /// Where robot and simulator publish.
    pub fn endpoints(&self) -> [String; 2] {
        [self.robot.clone(), self.sim.clone()]
    }

    /// Starts a part.
    pub fn start(&mut self, part: Part) -> Result<()> {
        let mut command = match part {
            Part::Simulator => {
                let mut command = program("locoman-sim")?;
                command.args(["robot", "--listen", &self.sim]);
                match &self.wires {
                    None => command.args(["--bind", &self.plant]),
                    Some(wires) => {
                        let faults = wires.faults.iter().flat_map(|fault| ["--fault", fault]);
                        command.args(["--wires", &wires.board.to_string()]).args(faults);
                        command.arg("--servos").arg(self.logs.join("servos"))
                    }
                };
                command
            }
            Part::Robot => {
                let mut command = program("locoman-robot")?;
                command.args(["run", "--listen", &self.robot]);
                match &self.wires {
                    None => command.args(["--plant", "sim", "--sim", &self.plant]),
                    Some(Wires { seen_at, local, .. }) => command
                        .args(["--plant", "go1", "--auto-stand", "true"])
                        .args(["--go1", &seen_at.to_string(), "--go1-local", &local.to_string()])
                        .arg("--servo-port")
                        .arg(self.logs.join("servos/bus"))
                        .arg("--servo-zeros")
                        .arg(self.logs.join("servos/zeros.toml")),
                };
                command
            }
            Part::Station => {
                let mut command = program("locoman-teleop")?;
                command.arg("run").arg("--replay").arg(&self.recording);
                command.args(["--connect", &self.robot, "--connect", &self.sim, "--console", &self.console]);
                command.args(["--auto-engage", "right-gripper"]);
                command
            }
        };
        let log = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(self.logs.join(format!("{part:?}.log")))?;
        let child = command
            .stdin(Stdio::null())
            .stdout(log.try_clone()?)
            .stderr(log)
            .spawn()
            .with_context(|| format!("cannot start {part:?}"))?;
        self.children[part as usize] = Some(child);
        Ok(())
    }

    /// Kills a part without warning (SIGKILL).
    pub fn kill(&mut self, part: Part) -> Result<()> {
        if let Some(mut child) = self.children[part as usize].take() {
            child.kill()?;
            child.wait()?;
        }
        Ok(())
    }
}

impl Drop for System {
    fn drop(&mut self) {
        for part in [Part::Station, Part::Robot, Part::Simulator] {
            // Already gone is as good.
            let _ = self.kill(part);
        }
    }
}
