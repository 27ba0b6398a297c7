//! Watches everything that can go wrong, and says what must happen: a pure function of time and flags.
//!
//! Requirements `R-SAFE-…` stand in `SAFETY.md`; each names its test here or in the controller.

mod severity;
mod thresholds;

pub use severity::{Reason, Reasons, Severity};
pub use thresholds::Thresholds;

use crate::plant::Health;

/// A stop that somebody asked for. Latched by the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Stop {
    /// None.
    #[default]
    None,
    /// Settle on four feet, lie down, damp.
    Settle,
    /// Damp at once.
    Damp,
}

/// What the sensors are worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorHealth {
    /// A sample of now.
    Good,
    /// A sample with numbers that are none.
    NotFinite,
    /// None for this long.
    Silent {
        /// ns.
        for_ns: u64,
    },
}

/// What the supervisor looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flags {
    /// Now, on the robot's clock.
    pub now_ns: u64,
    /// When the last valid command arrived.
    pub command_ns: Option<u64>,
    /// A foot is in the air, or about to be.
    pub manipulating: bool,
    /// State of the sensors.
    pub sensors: SensorHealth,
    /// Angle between the torso's z axis and up, rad.
    pub tilt_rad: f64,
    /// The stop that is latched.
    pub stop: Stop,
    /// A foot that stands by plan has carried nothing for this long, ns.
    pub unloaded_ns: u64,
    /// The whole-body controller reported a fault.
    pub control_fault: bool,
    /// A foot that goes down finds no ground.
    pub no_ground: bool,
    /// What the robot says of itself.
    pub health: Health,
}

/// What must happen, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Assessment {
    /// The worst of the causes.
    pub severity: Severity,
    /// All causes.
    pub reasons: Reasons,
}

impl Assessment {
    fn raise(&mut self, severity: Severity, reason: Reason) {
        self.severity = self.severity.max(severity);
        self.reasons.insert(reason);
    }
}

/// Judges the situation.
pub fn assess(thresholds: &Thresholds, flags: &Flags) -> Assessment {
    let mut verdict = Assessment::default();
    judge_operator(thresholds, flags, &mut verdict);
    judge_robot(thresholds, flags, &mut verdict);
    judge_health(thresholds, &flags.health, &mut verdict);
    match flags.stop {
        Stop::None => {}
        Stop::Settle => verdict.raise(Severity::LieDown, Reason::StopSettle),
        Stop::Damp => verdict.raise(Severity::Damp, Reason::StopDamp),
    }
    verdict
}

fn judge_operator(thresholds: &Thresholds, flags: &Flags, verdict: &mut Assessment) {
    let Some(command_ns) = flags.command_ns else {
        verdict.raise(Severity::Hold, Reason::NoOperator);
        return;
    };
    let age_ms = ms(flags.now_ns.saturating_sub(command_ns));
    if age_ms >= thresholds.command_hold_ms {
        verdict.raise(Severity::Hold, Reason::CommandLate);
    }
    if age_ms >= thresholds.command_disengage_ms {
        verdict.raise(Severity::Disengage, Reason::CommandLost);
    }
    if flags.manipulating && age_ms >= thresholds.command_stand_ms {
        verdict.raise(Severity::Stand, Reason::OperatorGone);
    }
}

fn judge_robot(thresholds: &Thresholds, flags: &Flags, verdict: &mut Assessment) {
    match flags.sensors {
        SensorHealth::Good => {}
        SensorHealth::NotFinite => verdict.raise(Severity::Damp, Reason::SensorsNotFinite),
        SensorHealth::Silent { for_ns } => {
            if ms(for_ns) >= thresholds.sensors_late_ms {
                verdict.raise(Severity::Warn, Reason::SensorsLate);
            }
            if ms(for_ns) >= thresholds.sensors_lost_ms {
                verdict.raise(Severity::Disengage, Reason::SensorsLost);
            }
        }
    }
    if flags.tilt_rad >= thresholds.tilt_damp_rad || flags.tilt_rad.is_nan() {
        verdict.raise(Severity::Damp, Reason::Fallen);
    } else if flags.tilt_rad >= thresholds.tilt_hold_rad {
        verdict.raise(Severity::Stand, Reason::Tilted);
    }
    if ms(flags.unloaded_ns) >= thresholds.foot_unloaded_ms {
        verdict.raise(Severity::Warn, Reason::FootUnloaded);
    }
    if flags.no_ground {
        verdict.raise(Severity::Warn, Reason::NoGround);
    }
    if flags.control_fault {
        verdict.raise(Severity::Disengage, Reason::Control);
    }
}

fn judge_health(thresholds: &Thresholds, health: &Health, verdict: &mut Assessment) {
    if health.remote_stop {
        verdict.raise(Severity::Damp, Reason::RemoteStop);
    }
    if health.sender_damped {
        verdict.raise(Severity::Damp, Reason::SenderDamped);
    }
    if health.motor_fault {
        verdict.raise(Severity::LieDown, Reason::MotorFault);
    }
    if health.leg_power_w >= thresholds.leg_power_w {
        verdict.raise(Severity::Damp, Reason::Overpowered);
    }
    if health.motor_c >= thresholds.motor_damp_c {
        verdict.raise(Severity::Damp, Reason::MotorHot);
    } else if health.motor_c >= thresholds.motor_hot_c {
        verdict.raise(Severity::LieDown, Reason::MotorHot);
    } else if health.motor_c >= thresholds.motor_warm_c {
        verdict.raise(Severity::Warn, Reason::MotorWarm);
    }
    if health.battery_percent <= thresholds.battery_empty_percent || health.cell_v <= thresholds.cell_empty_v
    {
        verdict.raise(Severity::LieDown, Reason::BatteryEmpty);
    } else if health.battery_percent <= thresholds.battery_low_percent
        || health.cell_v <= thresholds.cell_low_v
    {
        verdict.raise(Severity::Warn, Reason::BatteryLow);
    }
    if health.battery_c >= thresholds.battery_hot_c {
        verdict.raise(Severity::LieDown, Reason::BatteryHot);
    }
    if health.servo_fault {
        verdict.raise(Severity::Disengage, Reason::ServoFault);
    }
    if health.servo_c >= thresholds.servo_hot_c {
        verdict.raise(Severity::Stand, Reason::ServoHot);
    } else if health.servo_c >= thresholds.servo_warm_c {
        verdict.raise(Severity::Warn, Reason::ServoWarm);
    }
}

fn ms(ns: u64) -> f64 {
    ns as f64 * 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// A robot that is well, with a command of just now.
    fn well() -> Flags {
        Flags {
            now_ns: 10_000 * MS,
            command_ns: Some(10_000 * MS),
            manipulating: true,
            sensors: SensorHealth::Good,
            tilt_rad: 0.02,
            stop: Stop::None,
            unloaded_ns: 0,
            control_fault: false,
            no_ground: false,
            health: Health::default(),
        }
    }

    fn says(health: Health) -> Severity {
        severity(&Flags { health, ..well() })
    }

    fn silent_for(ms: u64) -> Flags {
        Flags { command_ns: Some((10_000 - ms) * MS), ..well() }
    }

    fn severity(flags: &Flags) -> Severity {
        assess(&Thresholds::default(), flags).severity
    }

    #[test]
    fn a_robot_that_is_well_is_left_alone() {
        assert_eq!(assess(&Thresholds::default(), &well()), Assessment::default());
    }

    #[test]
    fn r_safe_001_targets_freeze_100_ms_after_the_last_command() {
        assert_eq!(severity(&silent_for(99)), Severity::None);
        assert_eq!(severity(&silent_for(100)), Severity::Hold);
    }

    #[test]
    fn r_safe_002_the_engagement_ends_500_ms_after_the_last_command() {
        assert_eq!(severity(&silent_for(499)), Severity::Hold);
        assert_eq!(severity(&silent_for(500)), Severity::Disengage);
    }

    #[test]
    fn r_safe_003_a_robot_on_three_feet_goes_back_to_four_5_s_after_the_last_command() {
        assert_eq!(severity(&silent_for(4_999)), Severity::Disengage);
        assert_eq!(severity(&silent_for(5_000)), Severity::Stand);
        let on_four_feet = Flags { manipulating: false, ..silent_for(5_000) };
        assert_eq!(severity(&on_four_feet), Severity::Disengage);
    }

    #[test]
    fn r_safe_004_a_leaning_robot_goes_back_to_four_feet_and_a_falling_one_is_damped() {
        let leaning = |tilt_rad| Flags { tilt_rad, ..well() };
        assert_eq!(severity(&leaning(0.49)), Severity::None);
        assert_eq!(severity(&leaning(0.5)), Severity::Stand);
        assert_eq!(severity(&leaning(0.9)), Severity::Damp);
        assert_eq!(severity(&leaning(f64::NAN)), Severity::Damp);
    }

    #[test]
    fn r_safe_005_silent_sensors_are_told_after_50_ms_and_end_the_engagement_after_500_ms() {
        let silent = |for_ms: u64| Flags { sensors: SensorHealth::Silent { for_ns: for_ms * MS }, ..well() };
        assert_eq!(severity(&silent(49)), Severity::None);
        assert_eq!(severity(&silent(50)), Severity::Warn);
        assert_eq!(severity(&silent(500)), Severity::Disengage);
    }

    #[test]
    fn r_safe_006_sensors_that_are_no_numbers_damp_at_once() {
        assert_eq!(severity(&Flags { sensors: SensorHealth::NotFinite, ..well() }), Severity::Damp);
    }

    #[test]
    fn r_safe_007_a_stop_outranks_everything_below_it() {
        assert_eq!(severity(&Flags { stop: Stop::Settle, ..silent_for(6_000) }), Severity::LieDown);
        assert_eq!(severity(&Flags { stop: Stop::Damp, ..well() }), Severity::Damp);
    }

    #[test]
    fn r_safe_021_the_remotes_stop_damps_at_once() {
        assert_eq!(says(Health { remote_stop: true, ..Health::default() }), Severity::Damp);
    }

    #[test]
    fn r_safe_019_motors_that_the_sender_has_damped_are_damped() {
        assert_eq!(says(Health { sender_damped: true, ..Health::default() }), Severity::Damp);
    }

    #[test]
    fn r_safe_022_a_motor_with_a_fault_lays_the_robot_down() {
        assert_eq!(says(Health { motor_fault: true, ..Health::default() }), Severity::LieDown);
    }

    #[test]
    fn r_safe_023_hot_motors_are_told_then_rest_then_are_damped() {
        let at = |motor_c| says(Health { motor_c, ..Health::default() });
        assert_eq!([59.0, 60.0, 69.0].map(at), [Severity::None, Severity::Warn, Severity::Warn]);
        assert_eq!([70.0, 79.0, 80.0].map(at), [Severity::LieDown, Severity::LieDown, Severity::Damp]);
    }

    #[test]
    fn r_safe_024_a_battery_that_runs_low_is_told_and_an_empty_or_hot_one_lays_the_robot_down() {
        let charge = |battery_percent| says(Health { battery_percent, ..Health::default() });
        assert_eq!([21.0, 20.0, 10.0].map(charge), [Severity::None, Severity::Warn, Severity::LieDown]);
        let cell = |cell_v| says(Health { cell_v, ..Health::default() });
        assert_eq!([3.31, 3.3, 3.1].map(cell), [Severity::None, Severity::Warn, Severity::LieDown]);
        assert_eq!(says(Health { battery_c: 60.0, ..Health::default() }), Severity::LieDown);
    }

    #[test]
    fn r_safe_025_lasting_overload_of_the_legs_damps() {
        assert_eq!(says(Health { leg_power_w: 999.0, ..Health::default() }), Severity::None);
        assert_eq!(says(Health { leg_power_w: 1000.0, ..Health::default() }), Severity::Damp);
    }

    #[test]
    fn r_safe_026_a_servo_with_a_fault_ends_the_engagement_and_a_hot_one_ends_manipulation() {
        assert_eq!(says(Health { servo_fault: true, ..Health::default() }), Severity::Disengage);
        let at = |servo_c| says(Health { servo_c, ..Health::default() });
        assert_eq!([59.0, 60.0, 68.0].map(at), [Severity::None, Severity::Warn, Severity::Stand]);
    }

    #[test]
    fn without_any_command_nothing_moves_and_the_reason_is_told() {
        let verdict = assess(&Thresholds::default(), &Flags { command_ns: None, ..well() });
        assert_eq!(verdict.severity, Severity::Hold);
        assert!(verdict.reasons.contains(Reason::NoOperator));
    }

    #[test]
    fn all_reasons_at_once_are_all_told() {
        let verdict = assess(
            &Thresholds::default(),
            &Flags { stop: Stop::Settle, tilt_rad: 0.6, unloaded_ns: 1_000 * MS, ..silent_for(200) },
        );
        let told: Vec<_> = verdict.reasons.iter().collect();
        assert_eq!(told, [Reason::CommandLate, Reason::Tilted, Reason::StopSettle, Reason::FootUnloaded]);
    }
}
