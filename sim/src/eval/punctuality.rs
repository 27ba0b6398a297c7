//! `loop`: how punctually a real-time loop wakes up on this machine, at 400 Hz and at 1 kHz, with the real
//! controller in it.
//!
//! The robot's sensors in single-gripper stance are recorded in lockstep first; then the same controller gets
//! them in real time, over and over, on a thread that has all that a control loop can ask for: `SCHED_FIFO`,
//! locked memory, absolute deadlines, and a clock that it watches for the last 100 µs.

use std::path::Path;

use anyhow::ensure;
use locoman_protocol::clock::{monotonic_ns, thread_cpu_ns};
use locoman_protocol::pace::Pace;
use locoman_protocol::realtime;
use locoman_robot::control::{Controller, Inputs};
use locoman_robot::joints::Side;
use locoman_robot::modes::Mode;
use locoman_robot::plant::Sensors;

use super::lockstep::{Lockstep, ticks};
use super::statistics::percentile;
use super::{Figure, Must, Report};
use crate::robot::Options;

/// What is recorded, and played over and over, s.
const RECORDED_S: f64 = 2.0;
/// Whose figures stand beside ours: a loop that does nothing.
const ANCHOR: &str = "an empty loop, same means and kind of machine";

/// Arguments of `eval loop`.
#[derive(Debug, Clone, Copy, PartialEq, clap::Args)]
pub struct Args {
    /// How long at each of the two rates, s.
    #[arg(long, default_value_t = 600.0)]
    pub seconds: f64,
}

/// What a loop saw of itself, µs.
struct Loop {
    late: Vec<f64>,
    compute: Vec<f64>,
    missed: u64,
    priority: bool,
    locked: bool,
}

/// Runs the experiment. Anything else that the machine does shows in it.
pub fn run(configs: &Path, args: Args, seed: u64) -> anyhow::Result<Report> {
    ensure!(args.seconds > 0.0 && args.seconds.is_finite(), "--seconds must be above 0");
    let (mut controller, sensors) = record(configs, seed)?;
    let mut report = Report::new("loop", seed);
    for (rate_hz, name) in [(400, "at_400_hz"), (1000, "at_1_khz")] {
        let mut timed = || run_loop(&mut controller, &sensors, rate_hz, args.seconds);
        let seen = std::thread::scope(|scope| scope.spawn(&mut timed).join());
        let Ok(seen) = seen else { anyhow::bail!("the loop at {rate_hz} Hz ended early") };
        let mode = controller.snapshot().mode;
        ensure!(
            mode == Mode::Gripper(Side::Right),
            "the controller is in {mode:?} in place of single-gripper stance"
        );
        push(&mut report, name, &seen, rate_hz == 400);
    }
    Ok(report)
}

/// A controller in single-gripper stance, and what it gets there.
fn record(configs: &Path, seed: u64) -> anyhow::Result<(Controller, Vec<Sensors>)> {
    let mut robot = Lockstep::new(configs, &Options { seed, ..Options::default() })?;
    robot.go_to(Mode::Gripper(Side::Right))?;
    robot.run(1.0)?;
    let mut sensors = Vec::new();
    for _ in 0..ticks(RECORDED_S) {
        robot.tick()?;
        sensors.extend(robot.sensors());
    }
    Ok((robot.into_controller(), sensors))
}

fn run_loop(controller: &mut Controller, sensors: &[Sensors], rate_hz: u64, seconds: f64) -> Loop {
    let period_ns = 1_000_000_000 / rate_hz;
    let count = (seconds * rate_hz as f64).ceil() as usize;
    let (mut late, mut compute, mut missed) = (vec![0.0; count], vec![0.0; count], 0);
    let (priority, locked) = (realtime::run_before_others(), realtime::lock_memory());
    let before_ns = sensors.last().map_or(0, |sensors| sensors.time_ns);
    let start_ns = monotonic_ns();
    let mut pace = Pace::new(period_ns).spinning();
    for tick in 0..count {
        let wake = pace.wait();
        let mut sensors = sensors[tick % sensors.len()];
        sensors.time_ns = before_ns + wake.deadline_ns.saturating_sub(start_ns);
        let start_cpu_ns = thread_cpu_ns();
        controller.tick(sensors.time_ns, &sensors, &Inputs::default());
        compute[tick] = (thread_cpu_ns() - start_cpu_ns) as f64 / 1e3;
        late[tick] = (wake.late_ns + wake.missed * period_ns) as f64 / 1e3;
        missed += wake.missed;
    }
    Loop { late, compute, missed, priority, locked }
}

fn push(report: &mut Report, name: &str, seen: &Loop, is_goal: bool) {
    let us = |what: &str, value: f64| Figure::new(format!("{name}.{what}"), value, "us");
    let must = |figure: Figure, limit: f64| if is_goal { figure.must(Must::AtMost(limit)) } else { figure };
    let late = |share: f64| percentile(&seen.late, share);
    let compute = |share: f64| percentile(&seen.compute, share);

    report.push(us("wake_up_late_p50", late(0.5)).reference(0.0, ANCHOR));
    report.push(must(us("wake_up_late_p99", late(0.99)).reference(37.0, ANCHOR), 60.0));
    report.push(us("wake_up_late_p999", late(0.999)).reference(281.0, ANCHOR));
    report.push(us("wake_up_late_worst", late(1.0)).reference(6275.0, ANCHOR));
    report.push(must(Figure::new(format!("{name}.missed"), seen.missed as f64, ""), 0.0));
    report.push(Figure::new(format!("{name}.ticks"), seen.late.len() as f64, ""));
    report.push(us("tick_cpu_p50", compute(0.5)));
    report.push(us("tick_cpu_p99", compute(0.99)));
    report.push(us("tick_cpu_p999", compute(0.999)));
    report.push(Figure::new(format!("{name}.real_time_priority"), f64::from(u8::from(seen.priority)), ""));
    report.push(Figure::new(format!("{name}.memory_locked"), f64::from(u8::from(seen.locked)), ""));
}
