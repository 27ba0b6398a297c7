//! `locoman-sim eval demo`: what a recorded session says about the whole system.

mod following;
mod latency;
mod session;
mod track;

use std::path::Path;

pub use following::{Body, Errors, Following, judge};
use locoman_protocol::messages::{Mode, RobotState, SimTruth};
pub use session::Session;

use super::report::{Figure, Must, Report};
use super::statistics::{mean, percentile};
use session::capture_ns;

/// Reads a session and judges it.
pub fn run(recording: &Path, seed: u64) -> anyhow::Result<Report> {
    let session = Session::read(recording)?;
    if session.states.is_empty() || session.truths.is_empty() {
        anyhow::bail!(
            "{}: {} robot states and {} truths: not a session with a simulated robot; record one with \
             `cargo xtask demo --headless`",
            recording.display(),
            session.states.len(),
            session.truths.len()
        );
    }
    Ok(report(&session, seed))
}

/// All figures of a session.
pub fn report(session: &Session, seed: u64) -> Report {
    let mut report = Report::new("demo", seed);
    let following = judge(session);
    report.push(Figure::new("falls", falls(session), "").must(Must::AtMost(0.0)));
    report.push(Figure::new("engaged", following.engaged_s, "s"));
    report.push(Figure::new("delay", 1e3 * following.delay_s, "ms"));
    let paper = "paper, gripper with torso, by its own estimator";
    let [torso, gripper, foot] = &following.commanded;
    if foot.position.is_empty() {
        report.push(millimetres("gripper.position", gripper).must(Must::AtMost(5.0)).reference(1.89, paper));
        report.push(radians("gripper.rotation", gripper).must(Must::AtMost(0.08)).reference(0.047, paper));
    } else {
        let paper = "paper, foot with torso, by its own estimator";
        report.push(millimetres("foot.position", foot).must(Must::AtMost(5.0)).reference(1.10, paper));
    }
    report.push(millimetres("torso.position", torso).must(Must::AtMost(5.0)).reference(2.38, paper));
    report.push(radians("torso.rotation", torso).must(Must::AtMost(0.03)).reference(0.016, paper));
    for (what, [torso, gripper, foot]) in [("target", &following.target), ("estimate", &following.estimate)] {
        if foot.position.is_empty() {
            report.push(millimetres(&format!("{what}.gripper.position"), gripper));
            report.push(radians(&format!("{what}.gripper.rotation"), gripper));
        } else {
            report.push(millimetres(&format!("{what}.foot.position"), foot));
        }
        report.push(millimetres(&format!("{what}.torso.position"), torso));
        report.push(radians(&format!("{what}.torso.rotation"), torso));
    }
    for stage in latency::stages(session) {
        for (suffix, share) in [("p50", 0.5), ("p99", 0.99)] {
            let value = percentile(&stage.durations_ms, share);
            report.push(Figure::new(format!("latency.{}.{suffix}", stage.name), value, "ms"));
        }
    }
    report
        .push(Figure::new("tracker.rate", latency::tracker_rate_hz(session), "Hz").must(Must::AtLeast(20.0)));
    let (frames, dropped) = latency::frames(session);
    report.push(Figure::new("frames.total", frames as f64, ""));
    report.push(Figure::new("frames.dropped", dropped as f64, ""));
    control_period(session, &mut report);
    let last = session.states.last().cloned().unwrap_or_default();
    report.push(Figure::new("commands.accepted", last.commands_accepted as f64, ""));
    report.push(Figure::new("commands.rejected", last.commands_rejected as f64, ""));
    report.push(Figure::new("force_fallbacks", last.force_fallbacks as f64, ""));
    report
}

fn millimetres(name: &str, errors: &Errors) -> Figure {
    Figure::new(format!("{name}.mean"), 1e3 * mean(&errors.position), "mm")
}

fn radians(name: &str, errors: &Errors) -> Figure {
    Figure::new(format!("{name}.mean"), mean(&errors.rotation), "rad")
}

/// How often the robot fell while it was to stand. Lying down on purpose is not a fall.
fn falls(session: &Session) -> f64 {
    let mut states = session.states.iter().peekable();
    let mut latest: Option<&RobotState> = None;
    let mut was_down = false;
    let mut falls = 0.0;
    let mut by_time: Vec<&SimTruth> = session.truths.iter().collect();
    by_time.sort_by_key(|truth| capture_ns(&truth.header));
    for truth in by_time {
        while let Some(state) = states.next_if(|state| capture_ns(&state.header) <= capture_ns(&truth.header))
        {
            latest = Some(state);
        }
        let standing = latest
            .is_some_and(|state| !matches!(state.mode(), Mode::Unspecified | Mode::Damped | Mode::LieDown));
        let down = truth.fallen && standing;
        if down && !was_down {
            falls += 1.0;
        }
        was_down = down;
    }
    falls
}

/// Percentiles of the robot's control period since somebody first moved it. The robot gives percentiles of
/// each last second; the median second stands for all, and the worst is the worst.
fn control_period(session: &Session, report: &mut Report) {
    let engaged = session.states.iter().skip_while(|state| state.engagement == 0);
    let timings: Vec<_> =
        engaged.filter_map(|state| state.period).filter(|timing| timing.count > 0).collect();
    let of = |value: fn(&locoman_protocol::messages::Timing) -> u64| -> Vec<f64> {
        timings.iter().map(|timing| value(timing) as f64 * 1e-6).collect()
    };
    report.push(Figure::new("control_period.p50", percentile(&of(|t| t.p50_ns), 0.5), "ms"));
    report.push(Figure::new("control_period.p99", percentile(&of(|t| t.p99_ns), 0.5), "ms"));
    report.push(Figure::new("control_period.worst", percentile(&of(|t| t.worst_ns), 1.0), "ms"));
    let compute: Vec<_> =
        session.states.iter().filter_map(|state| state.compute).filter(|t| t.count > 0).collect();
    let p99: Vec<f64> = compute.iter().map(|timing| timing.p99_ns as f64 * 1e-6).collect();
    let p50: Vec<f64> = compute.iter().map(|timing| timing.p50_ns as f64 * 1e-6).collect();
    report.push(Figure::new("control_compute.p50", percentile(&p50, 0.5), "ms"));
    report.push(Figure::new("control_compute.p99", percentile(&p99, 0.5), "ms"));
}
