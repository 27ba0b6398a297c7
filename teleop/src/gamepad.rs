//! A gamepad at this computer, read by gilrs on a thread of its own.
//!
//! Right shoulder: dead-man. Left stick: x and y, or where to walk; triggers: down and up; right stick: pitch and yaw, with the
//! left shoulder held pitch and roll; sticks pressed: open, close. Centre (Guide): torso, or foot or gripper.
//! South (A): stance, North (Y): walk, East (B): right gripper, West (X): left gripper, D-pad right and left: right and left
//! foot, D-pad up and down: walk with the right and the left arm in use, Start: lie down, Select (Back): stop, twice: damp.

use std::sync::Arc;
use std::time::Duration;

use gilrs::{Axis, Button, EventType, Gamepad, Gilrs};
use locoman_protocol::messages::Mode;

use crate::board::Board;
use crate::latest::lock;
use crate::stick::{Drive, Hand, Target};
use crate::stop::StopButton;

/// How often the sticks are read.
const PERIOD: Duration = Duration::from_millis(10);

/// Starts the thread, which ends by itself on a computer without gamepads.
pub fn start(board: Arc<Board>, stop: Arc<StopButton>) {
    let run = move || match Gilrs::new() {
        Ok(gilrs) => run(gilrs, &board, &stop),
        Err(error) => tracing::info!("no gamepads on this computer: {error}"),
    };
    if let Err(error) = std::thread::Builder::new().name("gamepad".into()).spawn(run) {
        tracing::warn!("no thread for the gamepad: {error}");
    }
}

/// Names of the gamepads that are plugged in, for `doctor`; the error says why there can be none.
pub fn names() -> Result<Vec<String>, String> {
    let gilrs = Gilrs::new().map_err(|error| error.to_string())?;
    Ok(gilrs.gamepads().map(|(_, pad)| pad.name().to_owned()).collect())
}

fn run(mut gilrs: Gilrs, board: &Board, stop: &StopButton) {
    let mut target = Target::Effector;
    while !board.stopping() {
        while let Some(event) = gilrs.next_event() {
            if let EventType::ButtonPressed(button, _) = event.event {
                pressed(button, &mut target, board, stop);
            }
        }
        // The first that holds its dead-man; one that was unplugged is not listed, and so has let go.
        let hands = gilrs.gamepads().map(|(_, pad)| hand(&pad, target));
        *lock(&board.joystick) = hands.into_iter().find(|hand| hand.held).unwrap_or_default();
        std::thread::sleep(PERIOD);
    }
}

fn pressed(button: Button, target: &mut Target, board: &Board, stop: &StopButton) {
    let mode = match button {
        Button::South => Mode::Stance,
        Button::North => Mode::Locomotion,
        Button::DPadUp => Mode::LocoManipulation,
        Button::DPadDown => Mode::Bimanual,
        Button::East => Mode::RightGripper,
        Button::West => Mode::LeftGripper,
        Button::DPadRight => Mode::RightFoot,
        Button::DPadLeft => Mode::LeftFoot,
        Button::Start => Mode::LieDown,
        Button::Select => {
            stop.press();
            return;
        }
        Button::Mode => {
            *target = if *target == Target::Torso { Target::Effector } else { Target::Torso };
            return;
        }
        _ => return,
    };
    *lock(&board.mode) = Some(mode);
}

fn hand(pad: &Gamepad<'_>, target: Target) -> Hand {
    let axis = |axis| f64::from(pad.value(axis));
    let button = |button| if pad.is_pressed(button) { 1.0 } else { 0.0 };
    let (sideways, rolls) = (axis(Axis::RightStickX), pad.is_pressed(Button::LeftTrigger));
    let trigger = |button| pad.button_data(button).map_or(0.0, |data| f64::from(data.value()));
    Hand {
        held: pad.is_pressed(Button::RightTrigger),
        drive: Drive::Sticks,
        target,
        // Sticks: up and right are positive; the robot: forward and left.
        linear: [
            axis(Axis::LeftStickY),
            -axis(Axis::LeftStickX),
            trigger(Button::RightTrigger2) - trigger(Button::LeftTrigger2),
        ],
        angular: if rolls {
            [sideways, axis(Axis::RightStickY), 0.0]
        } else {
            [0.0, axis(Axis::RightStickY), -sideways]
        },
        opening: button(Button::LeftThumb) - button(Button::RightThumb),
    }
}
