//! One fault of the virtual robot, and what must come of it.

use std::path::Path;

use locoman_protocol::messages::{Mode, Severity};
use locoman_robot::go1::asks_for_damping;

use crate::eval::wire::{Wired, follow};
use crate::eval::{Figure, Must};
use crate::robot::Options;
use crate::robot::board::Faults;

/// What must come of a fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// The robot goes on following its operator, standing.
    GoesOn,
    /// It tells, and goes on.
    Told,
    /// It lies down by itself and damps.
    LiesDown,
    /// Its motors are damped at once.
    Damped,
}

/// A fault.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Its name in the figures.
    pub name: &'static str,
    /// What is wrong.
    pub faults: fn() -> Faults,
    /// A word of the reason that the robot must give.
    pub reason: &'static str,
    /// What must come of it.
    pub outcome: Outcome,
}

/// From a fault to a state message that tells it: a period of the line, a control step, a period of the state
/// messages (10 ms), the network and our own look (10 ms), ms.
const TELLING_MS: f64 = 40.0;
/// From a fault to the first damping command: a state, an answer in the next period, and one to spare, ms.
const DAMPING_MS: f64 = 10.0;
/// From standing to lying, s: 2.5 s by the settings, and what came before.
const LYING_S: f64 = 6.0;
/// How long a robot goes on that must, s.
const GOING_S: f64 = 20.0;

/// All of them.
pub const CASES: &[Case] = &[
    Case {
        name: "loss_5_percent_jitter_5_ms",
        faults: || Faults { loss: 0.05, jitter_ms: 5.0, ..Faults::default() },
        reason: "",
        outcome: Outcome::GoesOn,
    },
    Case {
        name: "damage_5_percent",
        faults: || Faults { corruption: 0.05, ..Faults::default() },
        reason: "",
        outcome: Outcome::GoesOn,
    },
    Case {
        name: "delay_3_ms_each_way",
        faults: || Faults { delay_ms: 3.0, ..Faults::default() },
        reason: "",
        outcome: Outcome::GoesOn,
    },
    Case {
        name: "motor_warm",
        faults: || Faults { motor_c: Some(62), ..Faults::default() },
        reason: "motor is warm",
        outcome: Outcome::Told,
    },
    Case {
        name: "motor_hot",
        faults: || Faults { motor_c: Some(72), ..Faults::default() },
        reason: "motor is too hot",
        outcome: Outcome::LiesDown,
    },
    Case {
        name: "motor_very_hot",
        faults: || Faults { motor_c: Some(81), ..Faults::default() },
        reason: "motor is too hot",
        outcome: Outcome::Damped,
    },
    Case {
        name: "battery_low",
        faults: || Faults { battery_percent: Some(18), ..Faults::default() },
        reason: "battery is low",
        outcome: Outcome::Told,
    },
    Case {
        name: "battery_empty",
        faults: || Faults { battery_percent: Some(9), ..Faults::default() },
        reason: "battery is empty",
        outcome: Outcome::LiesDown,
    },
    Case {
        name: "cell_empty",
        faults: || Faults { cell_mv: Some(3072), ..Faults::default() },
        reason: "battery is empty",
        outcome: Outcome::LiesDown,
    },
    Case {
        name: "battery_hot",
        faults: || Faults { battery_c: Some(62), ..Faults::default() },
        reason: "battery is too hot",
        outcome: Outcome::LiesDown,
    },
    Case {
        name: "motor_error",
        faults: || Faults { motor_error: Some(7), ..Faults::default() },
        reason: "motor protects itself",
        outcome: Outcome::LiesDown,
    },
    Case {
        name: "remote_stop",
        faults: || Faults { remote_stop: true, ..Faults::default() },
        reason: "remote control",
        outcome: Outcome::Damped,
    },
    Case {
        name: "board_silent",
        faults: || Faults { silent: true, ..Faults::default() },
        reason: "no state from the robot",
        outcome: Outcome::Damped,
    },
];

/// A robot that stands meets the fault.
pub fn run(case: &Case, configs: &Path, seed: u64) -> anyhow::Result<Vec<Figure>> {
    let mut wired = Wired::start(configs, &Options { seed, ..Options::default() })?;
    wired.stand()?;
    wired.run(0.5)?;
    wired.forget();
    let name = |what: &str| format!("{}.{what}", case.name);
    match case.outcome {
        Outcome::GoesOn => {
            wired.go_to(Mode::RightGripper)?;
            wired.set_faults((case.faults)());
            follow(&mut wired, GOING_S)?;
            let states = &wired.session().states;
            let damps = states.iter().filter(|state| state.severity() >= Severity::Stand).count();
            Ok(vec![count(name("falls"), falls(&wired)), count(name("states_that_end_motion"), damps as f64)])
        }
        Outcome::Told | Outcome::LiesDown => {
            wired.set_faults((case.faults)());
            let told_s = wired.wait(case.reason, |state| tells(&state.reasons, case.reason))?;
            let mut figures = vec![milliseconds(name("told_after"), told_s * 1e3, TELLING_MS)];
            if case.outcome == Outcome::Told {
                wired.run(1.0)?;
            } else {
                let lies_s = wired.wait("it lies, damped", |state| state.phase == "damped")?;
                figures.push(Figure::new(name("lies_after"), lies_s, "s").must(Must::AtMost(LYING_S)));
            }
            figures.push(count(name("falls"), falls(&wired)));
            Ok(figures)
        }
        Outcome::Damped => {
            wired.take_heard();
            let since_ns = wired.set_faults((case.faults)());
            let told_s = wired.wait(case.reason, |state| tells(&state.reasons, case.reason))?;
            wired.run(0.2)?;
            let heard = wired.take_heard();
            let damped = heard.iter().find(|it| it.received_ns > since_ns && asks_for_damping(&it.command));
            let after_ms = damped.map_or(f64::NAN, |it| (it.received_ns - since_ns) as f64 * 1e-6);
            let silence = (case.faults)().silent;
            // A robot that says nothing is lost after 500 ms.
            let more_ms = if silence { 500.0 } else { 0.0 };
            Ok(vec![
                milliseconds(name("told_after"), told_s * 1e3, more_ms + TELLING_MS),
                milliseconds(name("damped_after"), after_ms, more_ms + DAMPING_MS + more_ms * 0.05),
            ])
        }
    }
}

fn tells(reasons: &[String], word: &str) -> bool {
    reasons.iter().any(|reason| reason.contains(word))
}

/// How often it lay while it should stand.
fn falls(wired: &Wired) -> f64 {
    crate::eval::demo::report(wired.session(), 0).value("falls").unwrap_or(f64::NAN)
}

fn count(name: String, value: f64) -> Figure {
    Figure::new(name, value, "").must(Must::AtMost(0.0))
}

fn milliseconds(name: String, value: f64, most: f64) -> Figure {
    Figure::new(name, value, "ms").must(Must::AtMost(most))
}
