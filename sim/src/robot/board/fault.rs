//! What goes wrong with the virtual robot on demand: on its line, in its motors, its battery, and on the remote
//! control.
//!
//! `NAME=VALUE` switches a fault on, `NAME=VALUE@SECONDS` at so many seconds after the start; the last one stands.

use std::str::FromStr;

/// Everything that is wrong now.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Faults {
    /// Share of the datagrams that are lost, each way, 0 to 1.
    pub loss: f64,
    /// Time that every datagram takes longer, each way, ms.
    pub delay_ms: f64,
    /// Greatest time that a datagram takes longer beyond that, ms: datagrams overtake each other.
    pub jitter_ms: f64,
    /// Share of the datagrams with a bit turned round, each way, 0 to 1.
    pub corruption: f64,
    /// The board sends no states.
    pub silent: bool,
    /// This motor (0 to 11) protects itself: it gives no torque and says so.
    pub motor_error: Option<usize>,
    /// All motors are so hot, °C.
    pub motor_c: Option<i8>,
    /// The battery's charge, percent.
    pub battery_percent: Option<u8>,
    /// Voltage of the battery's weakest cell, mV.
    pub cell_mv: Option<u32>,
    /// The battery is so hot, °C.
    pub battery_c: Option<i8>,
    /// Somebody presses L2 and B on the remote control.
    pub remote_stop: bool,
}

/// One of them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(missing_docs, reason = "the fields of the same names in `Faults` say it")]
pub enum Fault {
    Loss(f64),
    DelayMs(f64),
    JitterMs(f64),
    Corruption(f64),
    Silent(bool),
    MotorError(usize),
    MotorC(i8),
    BatteryPercent(u8),
    CellMv(u32),
    BatteryC(i8),
    RemoteStop(bool),
}

impl Faults {
    /// With one more.
    pub fn set(&mut self, fault: Fault) {
        match fault {
            Fault::Loss(share) => self.loss = share,
            Fault::DelayMs(ms) => self.delay_ms = ms,
            Fault::JitterMs(ms) => self.jitter_ms = ms,
            Fault::Corruption(share) => self.corruption = share,
            Fault::Silent(on) => self.silent = on,
            Fault::MotorError(motor) => self.motor_error = Some(motor),
            Fault::MotorC(degrees) => self.motor_c = Some(degrees),
            Fault::BatteryPercent(percent) => self.battery_percent = Some(percent),
            Fault::CellMv(mv) => self.cell_mv = Some(mv),
            Fault::BatteryC(degrees) => self.battery_c = Some(degrees),
            Fault::RemoteStop(on) => self.remote_stop = on,
        }
    }
}

/// A fault and when it begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planned {
    /// Which.
    pub fault: Fault,
    /// After the start, s.
    pub at_s: f64,
}

impl FromStr for Planned {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (fault, at_s) = match text.split_once('@') {
            Some((fault, at_s)) => (fault, number(at_s, 0.0, f64::MAX)?),
            None => (text, 0.0),
        };
        Ok(Self { fault: fault.parse()?, at_s })
    }
}

impl FromStr for Fault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').unwrap_or((text, "true"));
        Ok(match name {
            "loss" => Self::Loss(number(value, 0.0, 1.0)?),
            "delay-ms" => Self::DelayMs(number(value, 0.0, 1e4)?),
            "jitter-ms" => Self::JitterMs(number(value, 0.0, 1e4)?),
            "corruption" => Self::Corruption(number(value, 0.0, 1.0)?),
            "silent" => Self::Silent(number(value, false, true)?),
            "motor-error" => Self::MotorError(number(value, 0, 11)?),
            "motor-c" => Self::MotorC(number(value, i8::MIN, i8::MAX)?),
            "battery-percent" => Self::BatteryPercent(number(value, 0, 100)?),
            "cell-mv" => Self::CellMv(number(value, 0, 5000)?),
            "battery-c" => Self::BatteryC(number(value, i8::MIN, i8::MAX)?),
            "remote-stop" => Self::RemoteStop(number(value, false, true)?),
            _ => {
                return Err(format!(
                    "no fault is named `{name}`; there are loss, delay-ms, jitter-ms, corruption, silent, \
                     motor-error, motor-c, battery-percent, cell-mv, battery-c, remote-stop"
                ));
            }
        })
    }
}

fn number<T: Copy + FromStr + PartialOrd + std::fmt::Display>(
    text: &str,
    low: T,
    high: T,
) -> Result<T, String> {
    match text.parse() {
        Ok(value) if (&low..=&high).contains(&&value) => Ok(value),
        _ => Err(format!("`{text}` is not within {low} to {high}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_named_with_its_value_and_its_time() {
        assert_eq!("loss=0.05".parse(), Ok(Planned { fault: Fault::Loss(0.05), at_s: 0.0 }));
        assert_eq!("motor-error=3@12.5".parse(), Ok(Planned { fault: Fault::MotorError(3), at_s: 12.5 }));
        assert_eq!("remote-stop".parse(), Ok(Planned { fault: Fault::RemoteStop(true), at_s: 0.0 }));
    }

    #[test]
    fn what_cannot_be_is_refused_with_what_can() {
        for wrong in ["loss=1.5", "loss=nan", "motor-error=12", "lost=0.1", "loss=0.1@-1", ""] {
            assert!(wrong.parse::<Planned>().is_err(), "{wrong}");
        }
        assert!("rain=1".parse::<Planned>().unwrap_err().contains("jitter-ms"));
    }
}
