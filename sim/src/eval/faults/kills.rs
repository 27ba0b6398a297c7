//! The robot's program dies, at random instants of standing up, standing and moving; or it stalls; or its sender dies.

use std::path::Path;

use anyhow::{Context, ensure};
use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::Mode;
use locoman_robot::go1::asks_for_damping;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::eval::statistics::percentile;
use crate::eval::wire::Wired;
use crate::eval::{Figure, Must, Report};
use crate::robot::Options;
use crate::robot::board::Heard;

/// What is promised, ms.
const DAMPED_WITHIN_MS: f64 = 50.0;
/// A kill comes within so long after the program has begun to command, s: standing up takes 3.3 s.
const LATEST_KILL_S: f64 = 6.0;
/// How long is listened after a kill, s.
const LISTEN_S: f64 = 0.3;

/// Kills, stalls, and the sender's death.
pub fn run(configs: &Path, kills: u32, seed: u64, report: &mut Report) -> anyhow::Result<()> {
    if kills > 0 {
        killed(configs, kills, seed, report)?;
    }
    stalled(configs, seed, report)?;
    sender_killed(configs, seed, report)
}

fn killed(configs: &Path, kills: u32, seed: u64, report: &mut Report) -> anyhow::Result<()> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut wired = Wired::start(configs, &Options { seed, ..Options::default() })?;
    let (mut undamped_ms, mut stiff_again) = (Vec::new(), 0.0);
    let mut while_stiff = 0.0;
    for kill in 0..kills {
        if kill > 0 {
            wired.start_program()?;
        }
        // The sender of the program before still damps; the new one waits for its end.
        wired
            .wait("the robot speaks", |state| state.mode() == Mode::Damped || state.mode() == Mode::Stance)?;
        wired.run(random.random::<f64>() * LATEST_KILL_S)?;
        wired.forget();
        wired.run(0.05)?;
        let before = wired.take_heard();
        let killed_ns = wired.kill_program()?;
        wired.run(LISTEN_S)?;
        let after = wired.take_heard();
        let stiff = before.last().is_some_and(|heard| !asks_for_damping(&heard.command));
        while_stiff += f64::from(u8::from(stiff));
        undamped_ms.push(undamped(&after, killed_ns));
        let damped =
            after.iter().skip_while(|it| it.received_ns < killed_ns || !asks_for_damping(&it.command));
        stiff_again += damped.filter(|heard| !asks_for_damping(&heard.command)).count() as f64;
        tracing::info!(kill, stiff, "undamped for {:.2} ms", undamped_ms[undamped_ms.len() - 1]);
    }
    let ms = |name: &str, share: f64| Figure::new(name, percentile(&undamped_ms, share), "ms");
    report.push(Figure::new("kill.times", f64::from(kills), ""));
    report.push(Figure::new("kill.while_stiff", while_stiff, ""));
    report.push(ms("kill.undamped_p50", 0.5));
    report.push(ms("kill.undamped_worst", 1.0).must(Must::AtMost(DAMPED_WITHIN_MS)));
    report.push(Figure::new("kill.stiff_after_damping", stiff_again, "").must(Must::AtMost(0.0)));
    Ok(())
}

/// From this time to the first damping command, ms; not a number if there is none.
fn undamped(heard: &[Heard], since_ns: u64) -> f64 {
    heard
        .iter()
        .find(|heard| heard.received_ns > since_ns && asks_for_damping(&heard.command))
        .map_or(f64::NAN, |heard| (heard.received_ns - since_ns) as f64 * 1e-6)
}

/// The program is stopped as a debugger would, with all its threads.
fn stalled(configs: &Path, seed: u64, report: &mut Report) -> anyhow::Result<()> {
    let mut wired = Wired::start(configs, &Options { seed, ..Options::default() })?;
    wired.stand()?;
    wired.forget();
    let id = wired.program_id().context("no program runs")?;
    signal(id, "STOP")?;
    let since_ns = monotonic_ns();
    wired.run(LISTEN_S)?;
    let heard = wired.take_heard();
    signal(id, "CONT")?;
    report.push(
        Figure::new("stall.undamped", undamped(&heard, since_ns), "ms").must(Must::AtMost(DAMPED_WITHIN_MS)),
    );
    // It notices that it has been damped, and does not spring up.
    wired.wait("it is told", |state| state.reasons.iter().any(|reason| reason.contains("sender")))?;
    wired.run(1.0)?;
    let stiff = wired.take_heard().iter().filter(|heard| !asks_for_damping(&heard.command)).count();
    report.push(Figure::new("stall.stiff_after_it", stiff as f64, "").must(Must::AtMost(0.0)));
    Ok(())
}

/// The sender is killed: the program starts another, and the robot stands on.
fn sender_killed(configs: &Path, seed: u64, report: &mut Report) -> anyhow::Result<()> {
    let mut wired = Wired::start(configs, &Options { seed, ..Options::default() })?;
    wired.stand()?;
    wired.run(0.5)?;
    wired.forget();
    let id = wired.program_id().context("no program runs")?;
    let children = std::fs::read_to_string(format!("/proc/{id}/task/{id}/children"))?;
    let sender = children.split_whitespace().next().context("the program has no sender")?;
    signal(sender.parse()?, "KILL")?;
    wired.run(2.0)?;
    let heard = wired.take_heard();
    let gaps = heard.windows(2).map(|pair| (pair[1].received_ns - pair[0].received_ns) as f64 * 1e-6);
    report.push(Figure::new("sender_killed.gap", gaps.fold(0.0, f64::max), "ms").must(Must::AtMost(100.0)));
    let fallen = wired.robot.truth().is_none_or(|truth| truth.fallen);
    report.push(Figure::new("sender_killed.falls", f64::from(u8::from(fallen)), "").must(Must::AtMost(0.0)));
    Ok(())
}

fn signal(process: u32, name: &str) -> anyhow::Result<()> {
    let status =
        std::process::Command::new("kill").arg(format!("-{name}")).arg(process.to_string()).status()?;
    ensure!(status.success(), "cannot send {name} to process {process}");
    Ok(())
}
