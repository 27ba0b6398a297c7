//! `cargo xtask demo`: simulator, robot and station as separate processes, and a recorded operator.

use std::collections::hash_map::DefaultHasher;
use std::hash::Hasher;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::processes::{Processes, log_tail};
use crate::{setup, shell};

#[derive(clap::Args)]
pub struct Args {
    /// Without a browser: run, record, report.
    #[arg(long)]
    headless: bool,
    /// End after so many seconds (default: at Ctrl-C; headless: 20).
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Write what was measured as JSON.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// The mode in which the recorded operator drives: right-gripper, left-gripper, right-foot,
    /// left-foot, stance.
    #[arg(long, value_name = "MODE", default_value = "right-gripper")]
    mode: String,
    /// Address of the browser console.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8080")]
    console: String,
}

impl Args {
    /// What `cargo xtask test` runs.
    pub fn headless(seconds: f64, report: &Path) -> Self {
        Self {
            headless: true,
            seconds: Some(seconds),
            report: Some(report.to_owned()),
            mode: "right-gripper".to_owned(),
            console: "127.0.0.1:8080".to_owned(),
        }
    }
}

const HEADLESS_SECONDS: f64 = 20.0;
/// Processes start, connect and end within this beyond the time asked for.
const START_AND_END: Duration = Duration::from_secs(60);

const WHAT_TO_PRESS: &str = "
  The recorded operator drives the robot. To take over, in the browser:
    hold Space       engage (dead-man switch: let go and the robot holds)
    W S  A D  R F    move forward and back, left and right, up and down
    J L  I K  U O    turn: roll, pitch, yaw
    C V              close and open the gripper
    T                move the torso in place of the gripper or foot, and back
    1 2 3 4 5 6      stance, right gripper, left gripper, lie down, right foot, left foot
    Esc              stop: settle and lie down; twice: damp at once
  A gamepad works too: hold the right shoulder button.
  Ctrl-C here ends everything.
";

/// Where a headless demo leaves the recording of its session.
pub fn session_recording() -> PathBuf {
    folder().join("session.mcap")
}

fn folder() -> PathBuf {
    shell::target_dir().join("demo")
}

/// Builds, renders the operator's recording if there is none yet, starts everything, and waits.
pub fn run(args: &Args) -> Result<()> {
    setup::ensure(setup::Purpose::Run)?;
    shell::cargo(&["build", "--quiet", "--workspace", "--bins"])?;
    let operator = operator_recording()?;
    let places = if args.headless { Places::free()? } else { Places::usual(&args.console) };

    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    // A second call (after `cargo xtask test` ran another demo) cannot happen: one demo a process.
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))?;

    let mut processes = Processes::default();
    start(&mut processes, args, &places, &operator)?;
    if args.headless {
        wait_for_station(&mut processes, args, &interrupted)?;
    } else {
        watch(&mut processes, args, &places, &interrupted)?;
    }
    processes.end();
    if args.headless || args.report.is_some() {
        report(args)?;
    }
    Ok(())
}

/// Who listens where.
struct Places {
    plant: String,
    robot: String,
    sim: String,
    console: String,
}

impl Places {
    fn usual(console: &str) -> Self {
        Self {
            plant: "127.0.0.1:7100".into(),
            robot: "tcp/127.0.0.1:7447".into(),
            sim: "tcp/127.0.0.1:7448".into(),
            console: console.to_owned(),
        }
    }

    /// Ports that nobody uses now, so that a test disturbs nothing that runs on the machine.
    fn free() -> Result<Self> {
        // Held together, so that they differ.
        let listeners: Vec<TcpListener> =
            (0..4).map(|_| TcpListener::bind("127.0.0.1:0")).collect::<Result<_, _>>()?;
        let ports: Vec<u16> =
            listeners.iter().map(|listener| Ok(listener.local_addr()?.port())).collect::<Result<_>>()?;
        Ok(Self {
            plant: format!("127.0.0.1:{}", ports[0]),
            robot: format!("tcp/127.0.0.1:{}", ports[1]),
            sim: format!("tcp/127.0.0.1:{}", ports[2]),
            console: format!("127.0.0.1:{}", ports[3]),
        })
    }
}

fn start(processes: &mut Processes, args: &Args, places: &Places, operator: &Path) -> Result<()> {
    let mut sim = shell::program("locoman-sim");
    sim.args(["robot", "--bind", &places.plant, "--listen", &places.sim]);
    processes.start("simulator", &mut sim, &folder())?;

    let mut robot = shell::program("locoman-robot");
    robot.args(["run", "--plant", "sim", "--sim", &places.plant, "--listen", &places.robot]);
    processes.start("robot", &mut robot, &folder())?;

    let mut station = shell::program("locoman-teleop");
    station.arg("run").arg("--replay").arg(operator);
    station.args(["--connect", &places.robot, "--connect", &places.sim]);
    station.args(["--console", &places.console, "--auto-engage", &args.mode]);
    if args.headless || args.report.is_some() {
        station.arg("--record").arg(session_recording());
    }
    if let Some(seconds) = args.seconds.or(args.headless.then_some(HEADLESS_SECONDS)) {
        station.args(["--seconds", &seconds.to_string()]);
    }
    processes.start("station", &mut station, &folder())
}

/// Headless: the station ends by itself; any other process that ends first is an error.
fn wait_for_station(processes: &mut Processes, args: &Args, interrupted: &AtomicBool) -> Result<()> {
    let seconds = args.seconds.unwrap_or(HEADLESS_SECONDS);
    let deadline = Instant::now() + Duration::from_secs_f64(seconds) + START_AND_END;
    loop {
        match processes.ended()? {
            Some((name, true)) if name == "station" => return Ok(()),
            Some((name, _)) => bail!("the {name} ended early:\n{}", log_tail(&folder(), &name)),
            None => {}
        }
        if interrupted.load(Ordering::Relaxed) {
            bail!("interrupted");
        }
        if Instant::now() > deadline {
            bail!("the station did not end in time:\n{}", log_tail(&folder(), "station"));
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// With a browser: until Ctrl-C, or the station's end.
fn watch(processes: &mut Processes, args: &Args, places: &Places, interrupted: &AtomicBool) -> Result<()> {
    let url = format!("http://{}", places.console);
    wait_for_console(processes, places)?;
    shell::say(&format!("\n  Console: {url}\n  Logs: {}{WHAT_TO_PRESS}", folder().display()));
    open_browser(&url);
    let mut gone: Option<String> = None;
    while !interrupted.load(Ordering::Relaxed) {
        if let Some((name, success)) = processes.ended()? {
            if name == "station" && success && args.seconds.is_some() {
                return Ok(());
            }
            if gone.as_deref() != Some(&name) {
                shell::say(&format!("the {name} has ended; the others hold. Ctrl-C ends the demo."));
                gone = Some(name);
            }
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    Ok(())
}

fn wait_for_console(processes: &mut Processes, places: &Places) -> Result<()> {
    let deadline = Instant::now() + START_AND_END;
    while std::net::TcpStream::connect(&places.console).is_err() {
        processes.all_alive(&folder())?;
        if Instant::now() > deadline {
            bail!("the console does not answer:\n{}", log_tail(&folder(), "station"));
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    Ok(())
}

/// Behind the others in line for the processor: drawing in software must not take it from the tracker.
fn open_browser(url: &str) {
    let there =
        Command::new("xdg-open").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    let mut command = Command::new("nice");
    command.args(["xdg-open", url]).stdout(Stdio::null()).stderr(Stdio::null());
    if there.is_err() || command.spawn().is_err() {
        shell::say(&format!("  (no xdg-open here: open {url} in a browser)"));
    }
}

/// Judges the session's recording.
fn report(args: &Args) -> Result<()> {
    let file = args.report.clone().unwrap_or_else(|| folder().join("report.json"));
    let mut eval = shell::program("locoman-sim");
    eval.args(["eval", "demo", "--recording"]).arg(session_recording()).arg("--json").arg(file);
    shell::run(&mut eval)
}

/// Renders the operator once for each state of the files that decide how it looks.
pub fn operator_recording() -> Result<PathBuf> {
    std::fs::create_dir_all(folder())?;
    let mut hasher = DefaultHasher::new();
    for part in ["configs/rigs", "configs/shells", "configs/scenes", "sim/src/operator"] {
        hash_files(Path::new(part), &mut hasher)?;
    }
    let recording = folder().join(format!("operator-{:016x}.mcap", hasher.finish()));
    if !recording.exists() {
        shell::say("rendering the operator's recording (once, a few minutes)");
        shell::run(shell::program("locoman-sim").args(["operator", "--output"]).arg(&recording))?;
    }
    Ok(recording)
}

fn hash_files(path: &Path, hasher: &mut DefaultHasher) -> Result<()> {
    if !path.is_dir() {
        hasher.write(path.as_os_str().as_encoded_bytes());
        hasher.write(&std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?);
        return Ok(());
    }
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(path)?.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    entries.sort();
    entries.iter().try_for_each(|entry| hash_files(entry, hasher))
}
