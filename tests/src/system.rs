//! Simulator, robot and station as processes that can be killed and started again.

use std::net::TcpListener;
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
    children: [Option<Child>; 3],
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
            children: [None, None, None],
        })
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
                command.args(["robot", "--bind", &self.plant, "--listen", &self.sim]);
                command
            }
            Part::Robot => {
                let mut command = program("locoman-robot")?;
                command.args(["run", "--plant", "sim", "--sim", &self.plant, "--listen", &self.robot]);
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
