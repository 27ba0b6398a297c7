//! `play`: a trajectory from a file, on the robot, and how well the robot followed.
//!
//! ```text
//! file ──► Performance: mode, engage, play, release ──► OperatorCommand, 60 Hz ──► robot
//!               ▲                                                                  │
//!               └──────────────────── RobotState ─────► Score ◄────────────────────┘
//! ```

mod performance;
mod score;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{OperatorCommand, RobotState};
use locoman_protocol::trajectory::TrajectoryFile;
use locoman_protocol::{Endpoints, Link, Received};

use crate::latest::lock;
pub use performance::{End, Performance};
pub use score::{BodyScore, Score};

/// Commands a second.
const RATE_HZ: f64 = 60.0;
/// A state older than this says nothing about now.
const STALE_NS: u64 = 500_000_000;
/// How long the release is repeated: one lost message must not keep the robot engaged.
const RELEASE: Duration = Duration::from_millis(200);

/// What to play, and where.
#[derive(Debug, Clone)]
pub struct Options {
    /// The trajectory.
    pub file: PathBuf,
    /// Name of the robot.
    pub robot: String,
    /// Where it listens.
    pub endpoints: Endpoints,
    /// Let go after this time, wherever the robot is then.
    pub seconds: Option<f64>,
}

/// Plays a file and gives back how well it was followed. Setting `interrupted` lets go at once.
pub fn run(options: &Options, interrupted: &AtomicBool) -> Result<Score> {
    let file = TrajectoryFile::read(&options.file)?;
    let link = Link::open(&options.robot, &options.endpoints)?;
    let heard: Arc<Mutex<Vec<Received<RobotState>>>> = Arc::default();
    let _states = {
        let heard = Arc::clone(&heard);
        link.subscribe::<RobotState>(move |state| lock(&heard).push(state))?
    };
    let mut sender = link.sender::<OperatorCommand>()?;
    let mut performance = Performance::new(&file, link.source());
    let mut score = Score::new(file.mode);
    let begin = Instant::now();
    let mut latest: Option<Received<RobotState>> = None;
    let end = loop {
        for state in std::mem::take(&mut *lock(&heard)) {
            if performance.is_playing(&state.message) {
                score.add(&state.message);
            }
            latest = Some(state);
        }
        let now_ns = monotonic_ns();
        let robot = latest.as_ref().filter(|state| now_ns.saturating_sub(state.received_ns) < STALE_NS);
        let (command, end) = performance.step(now_ns, robot.map(|state| &state.message));
        if let Err(error) = sender.send(now_ns, command) {
            tracing::warn!("command not sent: {error}");
        }
        if let Some(end) = end {
            break Some(end);
        }
        let too_long = options.seconds.is_some_and(|seconds| begin.elapsed().as_secs_f64() >= seconds);
        if interrupted.load(Ordering::Relaxed) || too_long {
            break None;
        }
        std::thread::sleep(Duration::from_secs_f64(1.0 / RATE_HZ));
    };
    let released = Instant::now();
    while released.elapsed() < RELEASE {
        // The session may be gone by now; then there is nobody to tell.
        let _ = sender.send(monotonic_ns(), performance.release());
        std::thread::sleep(Duration::from_secs_f64(1.0 / RATE_HZ));
    }
    match end {
        Some(End::Played) => Ok(score),
        Some(End::Failed(reason)) => bail!("{}: {reason}", options.file.display()),
        None => {
            bail!(
                "{}: let go after {:.1} s, before its end",
                options.file.display(),
                begin.elapsed().as_secs_f64()
            )
        }
    }
}
