//! How long each stage takes, from the sensor's exposure to the robot's motors.

use std::collections::HashMap;

use super::session::{Session, capture_ns};

/// Durations of one stage, ms.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Name within the report.
    pub name: &'static str,
    /// One for each message.
    pub durations_ms: Vec<f64>,
}

/// All stages, in the order in which a frame passes them.
pub fn stages(session: &Session) -> Vec<Stage> {
    let tracking = |name, duration: fn(&locoman_protocol::messages::Tracking) -> u64| Stage {
        name,
        durations_ms: session.trackings.iter().map(|t| ms(duration(t))).collect(),
    };
    // A stick has no exposure: its commands have no capture time.
    let seen =
        session.commands.iter().filter_map(|command| command.header.as_ref()).filter(|h| h.capture_ns != 0);
    let capture_to_sent = seen.map(|header| ms(header.send_ns.saturating_sub(header.capture_ns))).collect();

    let sent_at: HashMap<(u64, u64), u64> = session
        .commands
        .iter()
        .filter_map(|command| command.header.as_ref())
        .map(|header| ((header.source, header.sequence), header.send_ns))
        .collect();
    let (mut sent_to_received, mut received_to_applied, mut capture_to_applied) = (vec![], vec![], vec![]);
    let mut last = (0, 0);
    for state in &session.states {
        let command = (state.command_source, state.command_sequence);
        // The state repeats the command that it acted on last.
        if command == last || state.command_applied_ns == 0 {
            continue;
        }
        last = command;
        if let Some(sent_ns) = sent_at.get(&command) {
            sent_to_received.push(ms(state.command_received_ns.saturating_sub(*sent_ns)));
        }
        received_to_applied.push(ms(state.command_applied_ns.saturating_sub(state.command_received_ns)));
        if state.command_capture_ns != 0 {
            capture_to_applied.push(ms(state.command_applied_ns.saturating_sub(state.command_capture_ns)));
        }
    }
    vec![
        tracking("decode", |t| t.decode_ns),
        tracking("detect", |t| t.detect_ns),
        tracking("solve", |t| t.solve_ns),
        tracking("capture_to_tracked", |t| t.age_ns),
        Stage { name: "capture_to_sent", durations_ms: capture_to_sent },
        Stage { name: "sent_to_received", durations_ms: sent_to_received },
        Stage { name: "received_to_applied", durations_ms: received_to_applied },
        Stage { name: "capture_to_applied", durations_ms: capture_to_applied },
    ]
}

/// Pose updates a second, from the first to the last.
pub fn tracker_rate_hz(session: &Session) -> f64 {
    let mut times: Vec<u64> = session.trackings.iter().map(|t| capture_ns(&t.header)).collect();
    times.sort_unstable();
    times.dedup();
    match times.as_slice() {
        [first, .., last] => (times.len() - 1) as f64 / ((last - first) as f64 * 1e-9),
        _ => f64::NAN,
    }
}

/// Frames of all cameras, and how many of them nobody took: the counts of the last report.
pub fn frames(session: &Session) -> (u64, u64) {
    let cameras = session.trackings.last().map(|t| t.cameras.as_slice()).unwrap_or_default();
    cameras.iter().fold((0, 0), |(frames, dropped), c| (frames + c.frames, dropped + c.dropped))
}

fn ms(ns: u64) -> f64 {
    ns as f64 * 1e-6
}
