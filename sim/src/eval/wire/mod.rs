//! `wire`: the robot's program over the real robot's datagrams, beside the same motion in lockstep.
//!
//! Program, sender and virtual robot run in real time, each as on the robot; an operator moves a gripper and the
//! torso. How even the commands arrive is measured where they arrive: at the virtual board's socket.

mod wired;

use std::path::Path;
use std::sync::atomic::Ordering;

use anyhow::ensure;
use locoman_protocol::geometry;
use locoman_protocol::messages::{Mode, OperatorCommand};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
pub use wired::Wired;

use super::demo::report as judge;
use super::drive::{Drive, Motion, Script};
use super::statistics::percentile;
use super::{Figure, Must, Report};
use crate::robot::Options;
use crate::robot::board::Heard;

/// The commands' period, µs.
const PERIOD_US: f64 = 2000.0;
/// The motion in lockstep lasts so long at most, s.
const LOCKSTEP_S: f64 = 60.0;

/// Arguments of `eval wire`.
#[derive(Debug, Clone, Copy, PartialEq, clap::Args)]
pub struct Args {
    /// How long the operator moves the robot, s.
    #[arg(long, default_value_t = 600.0)]
    pub seconds: f64,
}

/// Runs the experiment. Anything else that the machine does shows in it.
pub fn run(configs: &Path, args: Args, seed: u64) -> anyhow::Result<Report> {
    ensure!(args.seconds > 0.0 && args.seconds.is_finite(), "--seconds must be above 0");
    let options = Options { seed, ..Options::default() };
    let mut report = Report::new("wire", seed);

    let mut lockstep = Drive::new(configs, &options)?;
    let script = Script { mode: Mode::RightGripper, seconds: args.seconds.min(LOCKSTEP_S), motion };
    lockstep.run(&script)?;
    let in_process = judge(lockstep.session(), seed);

    let mut wired = Wired::start(configs, &options)?;
    wired.stand()?;
    wired.go_to(Mode::RightGripper)?;
    let heard = follow(&mut wired, args.seconds)?;
    let over_wires = judge(wired.session(), seed);

    tracing::debug!("in lockstep: {in_process}over the wires: {over_wires}");
    push_periods(&mut report, &heard);
    let counters = wired.robot.counters();
    let lost_ms = counters.lost_ns.load(Ordering::Relaxed) as f64 * 1e-6;
    report.push(Figure::new(
        "virtual_robot.late",
        counters.late_exchanges.load(Ordering::Relaxed) as f64,
        "",
    ));
    report.push(Figure::new("virtual_robot.time_given_up", lost_ms, "ms"));
    for name in ["falls", "engaged"] {
        let figure = Figure::new(format!("wires.{name}"), over_wires.value(name).unwrap_or(f64::NAN), "");
        report.push(if name == "falls" { figure.must(Must::AtMost(0.0)) } else { figure });
    }
    for name in
        ["gripper.position.mean", "gripper.rotation.mean", "torso.position.mean", "torso.rotation.mean"]
    {
        let of = |report: &Report| report.value(name).unwrap_or(f64::NAN);
        let (wires, lockstep) = (of(&over_wires), of(&in_process));
        let unit = if name.contains("rotation") { "rad" } else { "mm" };
        let must = Must::AtMost((1.1 * lockstep * 1e4).round() / 1e4);
        let figure = Figure::new(format!("wires.{name}"), wires, unit).must(must);
        report.push(figure.reference(lockstep, "the same motion in lockstep"));
    }
    for name in ["delay", "control_period.p99", "control_period.worst", "control_compute.p99"] {
        report.push(Figure::new(format!("wires.{name}"), over_wires.value(name).unwrap_or(f64::NAN), "ms"));
    }
    Ok(report)
}

/// Slow enough for a person, fast enough to show a delay: up to 0.06 m/s and 0.3 rad/s.
pub fn motion(t: f64) -> Motion {
    let wave = |period_s: f64| (std::f64::consts::TAU * t / period_s).sin();
    let swing = |period_s: f64| 0.5 - 0.5 * (std::f64::consts::TAU * t / period_s).cos();
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.05 * wave(5.0), 0.05 * wave(7.0)));
    let torso = Isometry3::from_parts(Vector3::new(0.01 * wave(6.0), 0.0, -0.02 * swing(4.0)).into(), turn);
    let palm = Isometry3::from_parts(
        Vector3::new(0.04 * swing(4.0), -0.03 * swing(3.0), 0.03 * swing(5.0)).into(),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.2 * wave(4.0), 0.0, 0.2 * wave(5.0))),
    );
    Motion { torso: Some(torso), palms: [Some(palm), None], openings: [Some(swing(6.0)), None] }
}

/// The motion as a command.
pub fn moved(wish: &OperatorCommand, t: f64) -> OperatorCommand {
    let motion = motion(t);
    let pose = |displacement: &Option<Isometry3<f64>>| displacement.as_ref().map(geometry::pose);
    OperatorCommand {
        torso: pose(&motion.torso),
        right_palm: pose(&motion.palms[0]),
        right_opening: motion.openings[0],
        ..wish.clone()
    }
}

/// Engages, moves for so long, lets go; what the board heard meanwhile.
pub fn follow(wired: &mut Wired, seconds: f64) -> anyhow::Result<Vec<Heard>> {
    wired.take_heard();
    wired.engage();
    let (rest, begin) = (wired.wish.clone(), std::time::Instant::now());
    while begin.elapsed().as_secs_f64() < seconds {
        wired.wish = moved(&rest, begin.elapsed().as_secs_f64());
        wired.step()?;
    }
    let heard = wired.take_heard();
    wired.wish = OperatorCommand { engagement: 0, ..rest };
    wired.run(0.4)?;
    Ok(heard)
}

fn push_periods(report: &mut Report, heard: &[Heard]) {
    let gaps_us: Vec<f64> = heard
        .windows(2)
        .map(|pair| (pair[1].received_ns as f64 - pair[0].received_ns as f64) * 1e-3)
        .collect();
    let errors: Vec<f64> = gaps_us.iter().map(|gap| (gap - PERIOD_US).abs()).collect();
    let span_s = gaps_us.iter().sum::<f64>() * 1e-6;
    let missed: f64 = gaps_us.iter().map(|gap| (gap / PERIOD_US).round() - 1.0).filter(|n| *n > 0.0).sum();
    report.push(Figure::new("line.rate", gaps_us.len() as f64 / span_s, "Hz").must(Must::AtLeast(499.0)));
    report.push(Figure::new("line.commands", heard.len() as f64, ""));
    report.push(Figure::new("line.periods_missed", missed, ""));
    for (name, share) in [("p50", 0.5), ("p99", 0.99), ("p999", 0.999), ("worst", 1.0)] {
        report.push(Figure::new(format!("line.period_error_{name}"), percentile(&errors, share), "us"));
    }
    for limit_ms in [3.0, 5.0, 10.0, 20.0] {
        let longer = gaps_us.iter().filter(|gap| **gap > 1e3 * limit_ms).count();
        report.push(Figure::new(format!("line.gaps_above_{limit_ms}_ms"), longer as f64, ""));
    }
}
