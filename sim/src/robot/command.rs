//! `locoman-sim robot`.

use std::net::{SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use anyhow::Context;
use locoman_protocol::{Endpoints, Link};
use triple_buffer::triple_buffer;

use super::board::{self, Host, Planned, VirtualRobot};
use super::machine::Options;
use super::publish::publish;
use super::server::{Counters, serve};

/// Arguments of `locoman-sim robot`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Where commands come in (UDP).
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:7100")]
    pub bind: SocketAddr,
    /// Behave as a real Go1 whose motor board listens here (UDP), in place of `--bind`: for `locoman-robot run --plant
    /// go1 --go1 ADDRESS`.
    #[arg(long, value_name = "ADDRESS", conflicts_with = "bind")]
    pub wires: Option<SocketAddr>,
    /// With `--wires`: eight virtual servos too, their port at DIR/bus and their zero angles in DIR/zeros.toml, for
    /// `locoman-robot run --servo-port DIR/bus --servo-zeros DIR/zeros.toml`. Without, the arms stay folded.
    #[arg(long, value_name = "DIR", requires = "wires")]
    pub servos: Option<PathBuf>,
    /// With `--wires`: what goes wrong, as NAME=VALUE or NAME=VALUE@SECONDS, such as loss=0.05, jitter-ms=5,
    /// motor-error=3@20, battery-percent=8@20, remote-stop@20; may be given more than once.
    #[arg(long, value_name = "FAULT", requires = "wires")]
    pub fault: Vec<Planned>,
    /// Zenoh endpoint at which others find the simulator's truth.
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/127.0.0.1:7448")]
    pub listen: String,
    /// Name of the robot in the message keys.
    #[arg(long, value_name = "NAME", default_value = "locoman")]
    pub robot: String,
    /// Imperfections: a profile of scenes/robot.toml (`hw` or `ideal`).
    #[arg(long, default_value = "hw")]
    pub profile: String,
    /// How it begins: a posture of scenes/robot.toml (`lying` or `standing`).
    #[arg(long, default_value = "lying")]
    pub posture: String,
    /// Seed of everything random: noise, and what the controller's model has wrong.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// Runs `locoman-sim robot` until Ctrl-C.
pub fn run(args: &Args, configs: &Path) -> anyhow::Result<()> {
    let options = Options {
        profile: args.profile.clone(),
        posture: args.posture.clone(),
        seed: args.seed,
        ..Options::default()
    };
    let VirtualRobot { mut robot, mut board, arms } = match &args.servos {
        None => VirtualRobot::new(configs, &options)?,
        Some(folder) => with_servos(configs, &options, folder)?,
    };
    let address = args.wires.unwrap_or(args.bind);
    let socket = UdpSocket::bind(address).with_context(|| {
        format!(
            "cannot take commands on UDP {address}: stop what uses that port, or choose another with --bind or --wires"
        )
    })?;
    let link = Link::open(&args.robot, &Endpoints::listen(&args.listen))?;

    let stop = Arc::new(AtomicBool::new(false));
    let on_signal = Arc::clone(&stop);
    ctrlc::set_handler(move || on_signal.store(true, Ordering::Relaxed)).context("cannot catch Ctrl-C")?;

    let (mut truth, mut truth_out) = triple_buffer(&None);
    let counters = Counters::default();
    tracing::info!(commands = %socket.local_addr()?, truth = %args.listen, profile = %args.profile, "the robot is up");
    std::thread::scope(|scope| {
        let publisher = scope.spawn(|| publish(&link, &mut truth_out, &counters, &stop));
        let outcome = if args.wires.is_some() {
            let faults = Mutex::default();
            let (socket, counters, stop, seed) = (&socket, &counters, stop.as_ref(), args.seed);
            let host = Host { socket, faults: &faults, plan: &args.fault, heard: None, counters, stop, seed };
            board::serve(&mut robot, &mut board, &arms, &mut truth, &host)
        } else {
            serve(&mut robot, &socket, &mut truth, &counters, &stop)
        };
        stop.store(true, Ordering::Relaxed);
        let published =
            publisher.join().map_err(|_| anyhow::anyhow!("the thread that publishes the truth died"))?;
        outcome?;
        Ok(published?)
    })
}

/// A robot with servos; where they are and their zeros are put into the folder.
fn with_servos(configs: &Path, options: &Options, folder: &Path) -> anyhow::Result<VirtualRobot> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let (robot, line) = VirtualRobot::with_servos(configs, options, Some(folder.join("bus")))?;
    line.zeros.save(&folder.join("zeros.toml"))?;
    Ok(robot)
}
