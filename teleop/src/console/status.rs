//! The status of everything, as the page reads it: see `console/main.js`.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use locoman_protocol::Received;
use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{Mode, Pose, RobotState, Severity, ShellPose, Timing, Tracking, Verdict};
use serde::Serialize;

use super::Console;
use super::request::page_name;
use crate::board::Board;
use crate::gather::SILENT_NS;
use crate::latency::Stage;
use crate::latest::lock;
use crate::shown::{self, Shown};
use crate::sight::CameraCounters;

/// A tracking report older than this is no news.
const FRESH_NS: u64 = 500_000_000;

#[derive(Debug, Serialize)]
pub(super) struct Status {
    /// `None` before the first word.
    robot_silent_s: Option<f64>,
    robot: Option<Robot>,
    pilot: Pilot,
    tracking: TrackingStatus,
    cameras: Vec<CameraStatus>,
    latency: Vec<StageStatus>,
    events: Vec<EventStatus>,
}

#[derive(Debug, Serialize)]
struct PoseStatus {
    p: [f64; 3],
    /// w, x, y, z
    q: [f64; 4],
}

#[derive(Debug, Serialize)]
struct Robot {
    mode: String,
    goal: String,
    phase: String,
    refusal: String,
    engagement: String,
    severity: String,
    reasons: Vec<String>,
    joints: Vec<f64>,
    openings: [f64; 2],
    foot_force_n: Vec<f64>,
    torso: Option<PoseStatus>,
    torso_target: Option<PoseStatus>,
    gripper_targets: [Option<PoseStatus>; 2],
    foot_targets: [Option<PoseStatus>; 2],
    /// Whether it obeys this station.
    ours: bool,
    command_age_ms: Option<f64>,
    accepted: u64,
    rejected: u64,
    /// p50, p99, worst.
    period_ms: [f64; 3],
    compute_ms: [f64; 3],
}

#[derive(Debug, Serialize)]
struct Pilot {
    /// As text: numbers of this size are not exact in a browser. Empty: not engaged.
    engagement: String,
    device: String,
    waiting_for: &'static str,
    auto: Option<bool>,
}

#[derive(Debug, Serialize)]
struct TrackingStatus {
    fresh: bool,
    rate_hz: f64,
    dropped: u64,
    shells: Vec<ShellStatus>,
}

#[derive(Debug, Serialize)]
struct ShellStatus {
    name: String,
    verdict: &'static str,
    pose: Option<PoseStatus>,
    rms_px: f64,
    sigma_mm: f64,
    tags: u32,
    cameras: u32,
}

/// What one camera has seen of a shell: numbers of its tags, those that the pose rests on first.
#[derive(Debug, Serialize)]
struct SeenStatus {
    accepted: Vec<u32>,
    refused: Vec<u32>,
}

#[derive(Debug, Serialize)]
struct CameraStatus {
    name: String,
    /// Since the last frame; `None` before the first.
    age_ms: Option<f64>,
    silent: bool,
    frames: u64,
    dropped: u64,
    searched_whole: u64,
    read_ms: f64,
    clock: Option<ClockStatus>,
    problem: String,
    seen: SeenStatus,
}

#[derive(Debug, Serialize)]
struct ClockStatus {
    offset_ms: f64,
    error_ms: f64,
    drift_ppm: f64,
}

#[derive(Debug, Serialize)]
struct StageStatus {
    name: &'static str,
    p50_ms: Option<f64>,
    p99_ms: Option<f64>,
}

#[derive(Debug, Serialize)]
struct EventStatus {
    ago_s: f64,
    name: &'static str,
    detail: String,
}

/// Everything as of now.
pub(super) fn status(console: &Console) -> Status {
    let board = &console.board;
    let now_ns = monotonic_ns();
    let ago_s = |at_ns: u64| now_ns.saturating_sub(at_ns) as f64 * 1e-9;
    let robot = lock(&board.robot).clone();
    let tracking = lock(&board.tracking).clone();
    let pilot = lock(&board.pilot).clone();
    let latency = Stage::ALL.iter().map(|&stage| (stage, lock(&board.latency).percentiles_ns(stage)));
    let events = lock(&board.events);
    Status {
        robot_silent_s: robot.as_ref().map(|robot| ago_s(robot.received_ns)),
        robot: robot.map(|robot| robot_status(&robot, console.source)),
        pilot: Pilot {
            engagement: id(pilot.command.engagement),
            device: page_name(pilot.command.device().as_str_name(), "DEVICE_"),
            waiting_for: pilot.waiting_for,
            auto: pilot.auto,
        },
        tracking: tracking_status(tracking.as_ref(), now_ns, board.tracking_rate_hz(now_ns)),
        cameras: cameras(board, now_ns),
        latency: latency
            .map(|(stage, percentiles)| StageStatus {
                name: stage.name(),
                p50_ms: percentiles.map(|(p50, _)| ms(p50)),
                p99_ms: percentiles.map(|(_, p99)| ms(p99)),
            })
            .collect(),
        events: events
            .iter()
            .rev()
            .map(|event| EventStatus {
                ago_s: ago_s(event.at_ns),
                name: event.note.name,
                detail: event.note.detail.clone(),
            })
            .collect(),
    }
}

fn robot_status(robot: &Arc<Received<RobotState>>, source: u64) -> Robot {
    let m = &robot.message;
    let mode = |mode: Mode| page_name(mode.as_str_name(), "MODE_");
    let severity: Severity = m.severity();
    Robot {
        mode: mode(m.mode()),
        goal: mode(m.goal()),
        phase: m.phase.clone(),
        refusal: m.refusal.clone(),
        engagement: id(m.engagement),
        severity: page_name(severity.as_str_name(), "SEVERITY_"),
        reasons: m.reasons.clone(),
        joints: m.joint_position_rad.clone(),
        openings: [m.right_opening, m.left_opening],
        foot_force_n: m.foot_force_n.clone(),
        torso: pose(m.torso.as_ref()),
        torso_target: pose(m.torso_target.as_ref()),
        gripper_targets: [pose(m.right_gripper_target.as_ref()), pose(m.left_gripper_target.as_ref())],
        foot_targets: [pose(m.right_foot_target.as_ref()), pose(m.left_foot_target.as_ref())],
        ours: m.command_source == source,
        command_age_ms: (m.command_received_ns > 0)
            .then(|| ms(robot.received_ns.saturating_sub(m.command_received_ns))),
        accepted: m.commands_accepted,
        rejected: m.commands_rejected,
        period_ms: timing(m.period.as_ref()),
        compute_ms: timing(m.compute.as_ref()),
    }
}

fn tracking_status(tracking: Option<&Arc<Tracking>>, now_ns: u64, rate_hz: f64) -> TrackingStatus {
    let Some(tracking) = tracking else {
        return TrackingStatus { fresh: false, rate_hz: 0.0, dropped: 0, shells: Vec::new() };
    };
    let capture_ns = tracking.header.as_ref().map_or(0, |header| header.capture_ns);
    TrackingStatus {
        fresh: now_ns.saturating_sub(capture_ns) < FRESH_NS,
        rate_hz,
        dropped: tracking.cameras.iter().map(|camera| camera.dropped).sum(),
        shells: tracking.shells.iter().map(shell_status).collect(),
    }
}

fn cameras(board: &Board, now_ns: u64) -> Vec<CameraStatus> {
    let Some(counters) = board.counters.get() else { return Vec::new() };
    let shown = lock(&board.shown).clone();
    let cameras = counters.ids().iter().zip(&counters.cameras).enumerate();
    let status = |(index, (id, counters)): (usize, (&String, &CameraCounters))| {
        let count = |which: &AtomicU64| which.load(Ordering::Relaxed);
        let heard_ns = Some(count(&counters.heard_ns)).filter(|heard_ns| *heard_ns > 0);
        let age_ns = heard_ns.map(|heard_ns| now_ns.saturating_sub(heard_ns));
        CameraStatus {
            name: id.clone(),
            age_ms: age_ns.map(ms),
            silent: age_ns.is_none_or(|age_ns| age_ns > SILENT_NS),
            frames: count(&counters.frames),
            dropped: count(&counters.dropped),
            searched_whole: count(&counters.searched_whole),
            read_ms: ms(count(&counters.read_ns)),
            clock: counters.clock().map(|clock| ClockStatus {
                offset_ms: clock.offset_ns as f64 * 1e-6,
                error_ms: ms(clock.error_ns),
                drift_ppm: clock.drift_ppm,
            }),
            problem: problem(counters, shown.get(&index).map(Arc::as_ref)),
            seen: seen(shown.get(&index).map(Arc::as_ref)),
        }
    };
    cameras.map(status).collect()
}

/// Why the last image of a camera could not be used, or cannot be trusted; empty if it can.
fn problem(counters: &CameraCounters, shown: Option<&Shown>) -> String {
    let moved = || shown.and_then(|shown| shown.seen.moved_px).map(shown::moved);
    Some(counters.problem()).filter(|problem| !problem.is_empty()).or_else(moved).unwrap_or_default()
}

fn seen(shown: Option<&Shown>) -> SeenStatus {
    let tags = |used: bool| {
        let tags = shown.iter().flat_map(|shown| &shown.seen.tags);
        tags.filter(|tag| tag.is_used() == used).map(|tag| tag.detection.id).collect()
    };
    SeenStatus { accepted: tags(true), refused: tags(false) }
}

fn shell_status(shell: &ShellPose) -> ShellStatus {
    // The mean variance of the three positions, on the diagonal of a 6x6 matrix.
    let variance = [0, 7, 14].iter().filter_map(|&i| shell.covariance.get(i)).sum::<f64>() / 3.0;
    ShellStatus {
        name: shell.shell.clone(),
        verdict: match shell.verdict() {
            Verdict::Tracked => "tracked",
            Verdict::Predicted => "predicted",
            Verdict::Lost | Verdict::Unspecified => "lost",
        },
        pose: pose(shell.pose.as_ref()),
        rms_px: shell.rms_px,
        sigma_mm: variance.max(0.0).sqrt() * 1e3,
        tags: shell.tags,
        cameras: shell.cameras,
    }
}

fn pose(pose: Option<&Pose>) -> Option<PoseStatus> {
    let (p, q) = (pose?.position_m.as_ref()?, pose?.orientation.as_ref()?);
    Some(PoseStatus { p: [p.x, p.y, p.z], q: [q.w, q.x, q.y, q.z] })
}

fn timing(timing: Option<&Timing>) -> [f64; 3] {
    timing.map_or([0.0; 3], |t| [ms(t.p50_ns), ms(t.p99_ns), ms(t.worst_ns)])
}

fn ms(ns: u64) -> f64 {
    ns as f64 * 1e-6
}

fn id(id: u64) -> String {
    if id == 0 { String::new() } else { id.to_string() }
}
