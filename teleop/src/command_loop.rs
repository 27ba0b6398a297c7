//! The command thread: at a steady rate asks the pilot, sends the command, notes what happened.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{Event, OperatorCommand, RobotState};
use locoman_protocol::pace::Pace;
use locoman_protocol::{Received, Sender, realtime};
use locoman_vision::track::TrackerSettings;

use crate::board::{Board, PilotStatus};
use crate::config::Config;
use crate::latency::Stage;
use crate::latest::lock;
use crate::pilot::{Inputs, Pilot};
use crate::recorder::{Item, Tap};
use crate::robot_view::RobotView;

/// Commands whose sending time is remembered until the robot has answered: a second's worth.
const SENT_KEPT: usize = 64;

/// What the thread sends with.
#[derive(Debug)]
pub struct Senders {
    /// The robot's command.
    pub command: Sender<OperatorCommand>,
    /// What happened.
    pub event: Sender<Event>,
}

/// Runs until the board says stop; ends with one command that says "hold".
pub fn run(mut pilot: Pilot, config: &Config, board: &Board, mut senders: Senders, tap: &Tap) {
    realtime::run_before_others();
    let period_ns = (1e9 / config.command.rate_hz) as u64;
    let silent_ns = config.command.browser_silent_ms * 1_000_000;
    let ahead_max_ns = config.tracking.ahead_max_ms * 1_000_000;
    let filter = TrackerSettings::default().filter;
    let mut pace = Pace::new(period_ns);
    let mut sent_capture_ns = 0;
    while !board.stopping() {
        let now_ns = monotonic_ns();
        let robot: Option<Arc<Received<RobotState>>> = lock(&board.robot).clone();
        let inputs = Inputs {
            robot: robot.map(|robot| RobotView::new(&robot.message, robot.received_ns)),
            seen: lock(&board.seen).as_ref().map(|seen| seen.at(now_ns, ahead_max_ns, &filter)),
            joystick: *lock(&board.joystick),
            browser: board.browser(now_ns, silent_ns),
            mode: lock(&board.mode).take(),
            auto: lock(&board.auto).take(),
        };
        let (command, capture_ns) = pilot.step(now_ns, &inputs);
        board.hold_replay.store(pilot.operator_waits(), Ordering::Relaxed);
        send(&mut senders, command, capture_ns, board, tap, &pilot);
        if capture_ns > sent_capture_ns {
            sent_capture_ns = capture_ns;
            note_age(board, capture_ns);
        }
        for note in pilot.take_notes() {
            let event = Event { name: note.name.to_owned(), detail: note.detail.clone(), ..Event::default() };
            match senders.event.send(0, event) {
                Ok(event) => tap.offer(Item::Event(event)),
                Err(error) => tracing::debug!("event not published: {error}"),
            }
            board.happened(note);
        }
        pace.wait();
    }
    let (hold, _) = Pilot::new(config.clone(), None).step(monotonic_ns(), &Inputs::default());
    send(&mut senders, hold, 0, board, tap, &pilot);
}

fn send(
    senders: &mut Senders,
    command: OperatorCommand,
    capture_ns: u64,
    board: &Board,
    tap: &Tap,
    pilot: &Pilot,
) {
    match senders.command.send(capture_ns, command) {
        Ok(command) => {
            if let Some(header) = &command.header {
                let mut sent = lock(&board.sent);
                if sent.len() == SENT_KEPT {
                    sent.pop_front();
                }
                sent.push_back((header.sequence, header.send_ns));
            }
            *lock(&board.pilot) = PilotStatus {
                command: command.clone(),
                waiting_for: pilot.waiting_for(),
                auto: pilot.auto_enabled(),
            };
            tap.offer(Item::Command(Box::new(command)));
        }
        Err(error) => tracing::warn!("command not sent: {error}"),
    }
}

/// From the pose being known to the command being sent.
fn note_age(board: &Board, capture_ns: u64) {
    let age_ns = lock(&board.tracking)
        .as_ref()
        .filter(|tracking| tracking.header.as_ref().is_some_and(|header| header.capture_ns == capture_ns))
        .map(|tracking| tracking.age_ns);
    if let Some(age_ns) = age_ns {
        let total_ns = monotonic_ns().saturating_sub(capture_ns);
        lock(&board.latency).add(Stage::Map, total_ns.saturating_sub(age_ns));
    }
}
