//! What is sent to the motors while the controller is late, dead, or overruled: a pure function of time.
//!
//! The motor board keeps its last command for ever, so silence is no way to stop. Three steps:
//!
//! | age of the last command | what is sent |
//! |---|---|
//! | up to `hold_ms` | the command as it is: a control step may be late |
//! | up to `damp_ms` | the same positions and torques with velocities zero: the robot stands on, but goes nowhere |
//! | beyond, or the controller has ended | damping |
//!
//! The torque stays while it holds: it carries the robot, and without it the legs would give way by a hand's breadth
//! before damping could soften that. Damping stays in force until the controller itself asks for damping: one that
//! comes back after 60 ms still believes that the robot stands. So does the chord of the remote control, which is
//! obeyed here whatever the controller says.

use serde::Deserialize;

use super::{LowCommand, command::MOTORS};

/// `[watchdog]` of `go1.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WatchdogSettings {
    /// Without a new command for so long: hold.
    pub hold_ms: f64,
    /// Without a new command for so long: damp.
    pub damp_ms: f64,
    /// Damping goes on for so long after the controller has ended.
    pub linger_ms: f64,
    /// Damping, N m s/rad.
    pub damping_kd: f64,
}

impl Default for WatchdogSettings {
    fn default() -> Self {
        Self { hold_ms: 10.0, damp_ms: 30.0, linger_ms: 3000.0, damping_kd: 3.0 }
    }
}

/// What the sender does, the worst last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Verdict {
    /// Sends the controller's command.
    #[default]
    Follow,
    /// Sends the last command without its velocities.
    Hold,
    /// Damps because the controller was late, until it asks for damping.
    DampLate,
    /// Damps because the remote control asked for it, until the controller does and the chord is let go.
    DampRemote,
    /// Damps because the controller has ended, for good.
    DampEnded,
}

impl Verdict {
    /// All of them, in order.
    pub const ALL: [Self; 5] = [Self::Follow, Self::Hold, Self::DampLate, Self::DampRemote, Self::DampEnded];

    /// Whether the motors are damped without the controller.
    pub fn damps(self) -> bool {
        self >= Self::DampLate
    }
}

/// What the watchdog looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Signs {
    /// Age of the controller's last command, ns.
    pub age_ns: u64,
    /// The last command asks for damping: no stiffness, no torque.
    pub asks_for_damping: bool,
    /// The chord of the remote control is pressed.
    pub chord: bool,
    /// The controller has ended.
    pub ended: bool,
}

/// Remembers whether it has damped.
#[derive(Debug, Clone, Copy)]
pub struct Watchdog {
    settings: WatchdogSettings,
    verdict: Verdict,
}

impl Watchdog {
    /// Follows, to begin with.
    pub fn new(settings: WatchdogSettings) -> Self {
        Self { settings, verdict: Verdict::Follow }
    }

    /// Judges the present period.
    pub fn judge(&mut self, signs: &Signs) -> Verdict {
        let age_ms = signs.age_ns as f64 * 1e-6;
        let now = if signs.ended {
            Verdict::DampEnded
        } else if signs.chord {
            Verdict::DampRemote
        } else if age_ms >= self.settings.damp_ms {
            Verdict::DampLate
        } else if age_ms >= self.settings.hold_ms {
            Verdict::Hold
        } else {
            Verdict::Follow
        };
        let latched = self.verdict.damps() && !(signs.asks_for_damping && now <= Verdict::Hold);
        self.verdict = if latched { now.max(self.verdict) } else { now };
        self.verdict
    }

    /// What to send by the last verdict, given the controller's last command.
    pub fn outgoing(&self, last: &LowCommand) -> LowCommand {
        match self.verdict {
            Verdict::Follow => *last,
            Verdict::Hold => held(last),
            Verdict::DampLate | Verdict::DampRemote | Verdict::DampEnded => {
                LowCommand::damping(self.settings.damping_kd as f32)
            }
        }
    }
}

fn held(last: &LowCommand) -> LowCommand {
    let mut held = *last;
    for motor in &mut held.motors[..MOTORS] {
        motor.dq_rad_s = 0.0;
    }
    held
}

/// Whether a command asks for nothing but resistance to motion.
pub fn asks_for_damping(command: &LowCommand) -> bool {
    command.motors[..MOTORS].iter().all(|motor| motor.kp == 0 && motor.tau == 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{go1::Limits, plant::JointCommand};

    const STANDING: Signs = Signs { age_ns: 0, asks_for_damping: false, chord: false, ended: false };

    fn sut() -> Watchdog {
        Watchdog::new(WatchdogSettings::default())
    }

    fn aged(ms: u64) -> Signs {
        Signs { age_ns: ms * 1_000_000, ..STANDING }
    }

    #[test]
    fn r_safe_019_a_late_controller_first_holds_then_damps_before_50_ms() {
        let mut sut = sut();
        let verdicts = [0, 9, 10, 29, 30].map(|ms| sut.judge(&aged(ms)));
        assert_eq!(
            verdicts,
            [Verdict::Follow, Verdict::Follow, Verdict::Hold, Verdict::Hold, Verdict::DampLate]
        );
    }

    #[test]
    fn r_safe_019_damping_stays_until_the_controller_asks_for_it() {
        let mut sut = sut();
        sut.judge(&aged(41));
        assert_eq!(sut.judge(&STANDING), Verdict::DampLate);
        assert_eq!(sut.judge(&Signs { asks_for_damping: true, ..STANDING }), Verdict::Follow);
        assert_eq!(sut.judge(&STANDING), Verdict::Follow);
    }

    #[test]
    fn r_safe_020_the_end_of_the_controller_damps_at_once_and_for_good() {
        let mut sut = sut();
        assert_eq!(sut.judge(&Signs { ended: true, ..STANDING }), Verdict::DampEnded);
        assert_eq!(sut.judge(&STANDING), Verdict::DampEnded);
    }

    #[test]
    fn r_safe_021_the_remotes_chord_damps_whatever_the_controller_says() {
        let mut sut = sut();
        let chord = Signs { chord: true, ..STANDING };
        assert_eq!(sut.judge(&chord), Verdict::DampRemote);
        assert_eq!(sut.judge(&STANDING), Verdict::DampRemote);
        // Asking for damping releases nothing while the chord is pressed.
        assert_eq!(sut.judge(&Signs { asks_for_damping: true, ..chord }), Verdict::DampRemote);
        assert_eq!(sut.judge(&Signs { asks_for_damping: true, ..STANDING }), Verdict::Follow);
    }

    #[test]
    fn holding_keeps_the_torques_that_carry_the_robot_and_stops_its_motion() {
        let mut wish = JointCommand::damping();
        wish.kp.fill(60.0);
        wish.velocity.fill(1.0);
        wish.torque.fill(5.0);
        let command = Limits::default().apply(&wish);
        let mut sut = sut();
        sut.judge(&aged(20));
        let sent = sut.outgoing(&command);
        for (sent, wanted) in sent.motors[..MOTORS].iter().zip(&command.motors) {
            assert_eq!((sent.dq_rad_s, sent.tau, sent.kp), (0.0, wanted.tau, wanted.kp));
        }
        sut.judge(&aged(50));
        assert!(asks_for_damping(&sut.outgoing(&command)) && !asks_for_damping(&command));
    }
}
