//! The robot's program as a process, over the real robot's datagrams, against a virtual robot of this process; with
//! an operator on the network. Real time.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::link::Subscription;
use locoman_protocol::messages::{Header, Mode, OperatorCommand, RobotState};
use locoman_protocol::pace::Pace;
use locoman_protocol::{Endpoints, Link, Sender};

use crate::eval::demo::Session;
use crate::robot::board::{Faults, Heard, HostedRobot, VirtualRobot};
use crate::robot::{Options, publish};

/// Time between two looks at everything, ns.
const STEP_NS: u64 = 10_000_000;
/// Looks between two of the operator's commands: 50 Hz.
const COMMAND_EVERY: u64 = 2;
/// Nothing takes longer.
const PATIENCE_S: f64 = 40.0;

/// The whole of it; ends when dropped.
pub struct Wired {
    /// The virtual robot.
    pub robot: HostedRobot,
    configs: PathBuf,
    /// Where the servos' port and zeros are.
    servos: PathBuf,
    listen: String,
    local: String,
    program: Option<Child>,
    _link: Link,
    operator: Sender<OperatorCommand>,
    _subscription: Subscription,
    arrived: mpsc::Receiver<RobotState>,
    /// What the operator says.
    pub wish: OperatorCommand,
    /// Whether he says it.
    pub speaks: bool,
    engagements: u64,
    session: Session,
    heard: Vec<Heard>,
    pace: Pace,
    step: u64,
}

impl Wired {
    /// Switches a robot on and starts its program, which stands it up.
    pub fn start(configs: &Path, options: &Options) -> anyhow::Result<Self> {
        let servos = servos_folder();
        std::fs::create_dir_all(&servos)
            .with_context(|| format!("cannot make the folder {}", servos.display()))?;
        let (robot, line) = VirtualRobot::with_servos(configs, options, Some(servos.join("bus")))?;
        line.zeros.save(&servos.join("zeros.toml"))?;
        let robot = HostedRobot::start(robot, options.seed)?;
        let listen = format!("tcp/{}", TcpListener::bind("127.0.0.1:0")?.local_addr()?);
        let local = std::net::UdpSocket::bind("127.0.0.1:0")?.local_addr()?.to_string();
        let link = Link::open("locoman", &Endpoints::connect(std::slice::from_ref(&listen)))?;
        let (tell, arrived) = mpsc::channel();
        let subscription = link.subscribe::<RobotState>(move |received| {
            // Nobody listens any more: the end.
            let _ = tell.send(received.message);
        })?;
        let operator = link.sender()?;
        let mut wired = Self {
            robot,
            configs: configs.to_owned(),
            servos,
            listen,
            local,
            program: None,
            _link: link,
            operator,
            _subscription: subscription,
            arrived,
            wish: OperatorCommand::default(),
            speaks: true,
            engagements: 0,
            session: Session::default(),
            heard: Vec::new(),
            pace: Pace::new(STEP_NS),
            step: 0,
        };
        wired.start_program()?;
        Ok(wired)
    }

    /// Starts the robot's program.
    pub fn start_program(&mut self) -> anyhow::Result<()> {
        let path = std::env::current_exe()?.with_file_name("locoman-robot");
        let child = Command::new(&path)
            .args(["--log", "warn,zenoh=error", "--configs"])
            .arg(&self.configs)
            .args(["run", "--plant", "go1", "--auto-stand", "true", "--listen", &self.listen])
            .args(["--go1", &self.robot.address().to_string(), "--go1-local", &self.local])
            .arg("--servo-port")
            .arg(self.servos.join("bus"))
            .arg("--servo-zeros")
            .arg(self.servos.join("zeros.toml"))
            .stdin(Stdio::null())
            .spawn()
            .with_context(|| {
                format!("cannot start {}: build it by `cargo build --workspace --bins`", path.display())
            })?;
        self.program = Some(child);
        Ok(())
    }

    /// Id of the program's process.
    pub fn program_id(&self) -> Option<u32> {
        self.program.as_ref().map(Child::id)
    }

    /// Kills the program without warning; when, ns.
    pub fn kill_program(&mut self) -> anyhow::Result<u64> {
        let killed_ns = monotonic_ns();
        if let Some(mut program) = self.program.take() {
            program.kill()?;
            program.wait()?;
        }
        Ok(killed_ns)
    }

    /// Looks at everything once, after its time.
    pub fn step(&mut self) -> anyhow::Result<()> {
        self.pace.wait();
        self.step += 1;
        if self.speaks && self.step.is_multiple_of(COMMAND_EVERY) {
            let command = self.operator.send(monotonic_ns(), self.wish.clone())?;
            self.session.commands.push(command);
        }
        self.session.states.extend(self.arrived.try_iter());
        self.heard.extend(self.robot.heard());
        if let Some(truth) = self.robot.truth() {
            let mut message = publish::message(&truth);
            message.header = Some(Header { capture_ns: truth.time_ns, ..Header::default() });
            self.session.truths.push(message);
        }
        Ok(())
    }

    /// Looks at everything for some time.
    pub fn run(&mut self, seconds: f64) -> anyhow::Result<()> {
        let deadline = Instant::now() + Duration::from_secs_f64(seconds);
        while Instant::now() < deadline {
            self.step()?;
        }
        Ok(())
    }

    /// Waits until a state of after now is so, and returns how long that took, s.
    pub fn wait(&mut self, what: &str, mut is_so: impl FnMut(&RobotState) -> bool) -> anyhow::Result<f64> {
        let (begin, seen) = (Instant::now(), self.session.states.len());
        while begin.elapsed().as_secs_f64() < PATIENCE_S {
            self.step()?;
            if self
                .session
                .states
                .last()
                .is_some_and(|state| self.session.states.len() > seen && is_so(state))
            {
                return Ok(begin.elapsed().as_secs_f64());
            }
        }
        let last = self.state();
        bail!(
            "waited {PATIENCE_S} s in vain for: {what}; the robot: {:?} {} {:?}",
            last.mode(),
            last.phase,
            last.reasons
        )
    }

    /// The operator engages, by a number of its own.
    pub fn engage(&mut self) {
        self.engagements += 1;
        self.wish.engagement = self.engagements;
    }

    /// Waits until it stands on four feet.
    pub fn stand(&mut self) -> anyhow::Result<()> {
        self.reach(Mode::Stance)
    }

    /// Asks for a mode and waits until it is reached.
    pub fn go_to(&mut self, mode: Mode) -> anyhow::Result<()> {
        self.wish.mode_request_id += 1;
        self.wish.mode = mode.into();
        self.reach(mode)
    }

    fn reach(&mut self, mode: Mode) -> anyhow::Result<()> {
        self.wait(&format!("{mode:?}"), |state| state.mode() == mode && state.goal() == mode)?;
        Ok(())
    }

    /// Changes what goes wrong; when, ns.
    pub fn set_faults(&mut self, faults: Faults) -> u64 {
        self.robot.set_faults(faults);
        monotonic_ns()
    }

    /// The last state; an empty one before the first.
    pub fn state(&self) -> RobotState {
        self.session.states.last().cloned().unwrap_or_default()
    }

    /// Everything that was said.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The commands that the board took since the last call.
    pub fn take_heard(&mut self) -> Vec<Heard> {
        self.heard.extend(self.robot.heard());
        std::mem::take(&mut self.heard)
    }

    /// Forgets what was said.
    pub fn forget(&mut self) {
        self.session = Session::default();
        self.heard.clear();
    }
}

impl Drop for Wired {
    fn drop(&mut self) {
        // Already gone is as good.
        let _ = self.kill_program();
        let _ = std::fs::remove_dir_all(&self.servos);
    }
}

/// A folder for one robot's servos.
fn servos_folder() -> PathBuf {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    std::env::temp_dir().join(format!("locoman-servos-{}-{number}", std::process::id()))
}
