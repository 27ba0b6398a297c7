//! `doctor`: looks at everything that `run` needs and says what to do about what is missing.

use std::net::TcpListener;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use locoman_protocol::messages::RobotState;
use locoman_protocol::recording::Overview;
use locoman_protocol::{Endpoints, Link};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;

use crate::config::Config;
use crate::gamepad;
use crate::node::{OwnClock, StationClock, described};

/// How long to listen for a robot.
const LISTEN: Duration = Duration::from_secs(2);

/// What to look at.
#[derive(Debug)]
#[expect(missing_docs, reason = "each is the option of that name")]
pub struct Patient<'a> {
    pub configs: &'a Path,
    pub rig: &'a Path,
    pub shells: &'a Path,
    pub replay: Option<&'a Path>,
    pub console: &'a str,
    pub robot: &'a str,
    pub connect: &'a [String],
    /// On a camera node: where the station is.
    pub station: Option<&'a str>,
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Finding {
    /// As it should be.
    Good(String),
    /// Worth knowing; `run` works without.
    Note(String),
    /// `run` will fail; says what to do.
    Bad(String),
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Good(text) => write!(f, "  ok    {text}"),
            Self::Note(text) => write!(f, "  note  {text}"),
            Self::Bad(text) => write!(f, "  FAIL  {text}"),
        }
    }
}

/// Looks at everything, and reports each finding as it is made.
pub fn examine(patient: &Patient<'_>, mut report: impl FnMut(Finding)) {
    let settings = Config::read(patient.configs).map(|_| "teleop.toml".to_owned());
    report(judge(settings));
    let rig = Rig::load(patient.rig);
    let shells = ShellSet::load(patient.shells);
    report(judge(
        rig.as_ref().map(|rig| format!("{}: {} cameras", patient.rig.display(), rig.cameras.len())),
    ));
    report(judge(
        shells.as_ref().map(|set| format!("{}: {} shells", patient.shells.display(), set.shells.len())),
    ));
    if let Some(path) = patient.replay.filter(|path| path.is_file()) {
        report(recording(path));
    }
    if let Ok(rig) = &rig {
        cameras(rig, &mut report);
    }
    report(console(patient.console));
    report(match gamepad::names() {
        Ok(names) if names.is_empty() => {
            Finding::Note("no gamepad; plug one in, or use the keyboard in the console".into())
        }
        Ok(names) => Finding::Good(format!("gamepad: {}", names.join(", "))),
        Err(error) => {
            Finding::Note(format!("no gamepads can be read ({error}); use the keyboard in the console"))
        }
    });
    report(robot(patient));
    if let Some(station) = patient.station {
        report(clock(patient.robot, station));
    }
}

fn judge<E: std::fmt::Display>(outcome: Result<String, E>) -> Finding {
    match outcome {
        Ok(text) => Finding::Good(text),
        Err(error) => Finding::Bad(error.to_string()),
    }
}

fn recording(path: &Path) -> Finding {
    match Overview::read(path) {
        Ok(overview) if overview.complete => {
            let seconds = overview.end_ns.saturating_sub(overview.start_ns) as f64 * 1e-9;
            Finding::Good(format!("{}: {seconds:.1} s, {} topics", path.display(), overview.topics.len()))
        }
        Ok(_) => Finding::Bad(format!("{} is not whole; `mcap recover` saves what is good", path.display())),
        Err(error) => Finding::Bad(error.to_string()),
    }
}

fn cameras(rig: &Rig, report: &mut impl FnMut(Finding)) {
    for (camera, source) in rig.cameras.iter().zip(&rig.sources) {
        if source.remote {
            report(Finding::Note(format!(
                "camera {id}: a camera node reads it; start `locoman-teleop detect --cameras {id} --connect \
                 tcp/HOST:PORT` there, with this machine's address and the port of `run --listen`",
                id = camera.id
            )));
            continue;
        }
        let Some(device) = &source.device else { continue };
        report(match std::fs::File::open(device) {
            Ok(_) => Finding::Good(format!("camera {}: {}", camera.id, device.display())),
            Err(error) => Finding::Note(format!(
                "camera {}: {} ({error}); plug it in, and be in the group `video`; a replay needs none",
                camera.id,
                device.display()
            )),
        });
    }
}

fn console(address: &str) -> Finding {
    match TcpListener::bind(address) {
        Ok(_) => Finding::Good(format!("console address {address} is free")),
        Err(error) => Finding::Bad(format!(
            "console address {address}: {error}; end the program that uses it (`ss -ltnp`) or give another `--console HOST:PORT`"
        )),
    }
}

/// Asks a station for its clock, as a camera node does.
fn clock(robot: &str, station: &str) -> Finding {
    let asked = || -> anyhow::Result<_> {
        let link = Link::open(robot, &Endpoints::connect(&[station]))?;
        let clock = StationClock::listen(&link, OwnClock::default())?;
        let deadline = Instant::now() + LISTEN;
        clock.ask(&mut link.sender()?, || Instant::now() >= deadline);
        Ok(clock.offset())
    };
    match asked() {
        Ok(Some(offset)) => Finding::Good(format!("station at {station}: its clock: {}", described(&offset))),
        Ok(None) => Finding::Bad(format!(
            "no station answers at {station}; start `locoman-teleop run --listen {station}` there, with a rig file \
             that has `source = {{ remote = true }}`"
        )),
        Err(error) => Finding::Bad(error.to_string()),
    }
}

fn robot(patient: &Patient<'_>) -> Finding {
    let endpoints = Endpoints { listen: vec![], connect: patient.connect.to_vec() };
    let heard = Arc::new(AtomicU64::new(0));
    let count = Arc::clone(&heard);
    let listened = Link::open(patient.robot, &endpoints).and_then(|link| {
        let subscription = link.subscribe::<RobotState>(move |_| {
            count.fetch_add(1, Ordering::Relaxed);
        })?;
        let deadline = Instant::now() + LISTEN;
        while heard.load(Ordering::Relaxed) == 0 && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(20));
        }
        drop(subscription);
        Ok(link.peers())
    });
    match listened {
        Err(error) => Finding::Bad(error.to_string()),
        Ok(_) if heard.load(Ordering::Relaxed) > 0 => {
            Finding::Good(format!("robot `{}` answers at {}", patient.robot, patient.connect.join(", ")))
        }
        Ok(0) => Finding::Note(format!(
            "nobody at {}; start `locoman-robot run` (or `cargo xtask demo`), or give `--connect tcp/HOST:PORT`",
            patient.connect.join(", ")
        )),
        Ok(_) => Finding::Note(format!(
            "connected, but no robot named `{}` speaks; check `--robot` on both sides",
            patient.robot
        )),
    }
}
