//! `locoman-sim robot`.

use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use locoman_protocol::{Endpoints, Link};
use triple_buffer::triple_buffer;

use super::machine::{Options, SimRobot};
use super::publish::publish;
use super::server::{Counters, serve};

/// Arguments of `locoman-sim robot`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Where commands come in (UDP).
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:7100")]
    pub bind: SocketAddr,
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
    let mut robot = SimRobot::new(configs, &options)?;
    let socket = UdpSocket::bind(args.bind).with_context(|| {
        format!(
            "cannot take commands on UDP {}: stop what uses that port, or choose another with --bind",
            args.bind
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
        let outcome = serve(&mut robot, &socket, &mut truth, &counters, &stop);
        stop.store(true, Ordering::Relaxed);
        let published =
            publisher.join().map_err(|_| anyhow::anyhow!("the thread that publishes the truth died"))?;
        outcome?;
        Ok(published?)
    })
}
