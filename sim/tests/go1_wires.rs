//! The driver against the virtual Go1: what goes over the line when something is late, lost, damaged or stopped.
mod wires;

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use locoman_protocol::clock::monotonic_ns;
use locoman_robot::go1::{LowCommand, MOTORS, WatchdogSettings, asks_for_damping};
use locoman_robot::plant::{JointCommand, Plant};
use locoman_sim::robot::board::{Faults, Heard};
use wires::{WATCHDOG, Wires, stand};

/// The first command that damps, after a time.
fn damped_after(heard: &[Heard], since_ns: u64) -> Option<u64> {
    heard
        .iter()
        .find(|heard| heard.received_ns > since_ns && asks_for_damping(&heard.command))
        .map(|heard| heard.received_ns)
}

#[test]
fn r_safe_019_when_the_controller_stalls_the_motors_hold_then_damp_and_stay_damped() {
    let mut sut = Wires::watched("standing", WatchdogSettings::default());
    let mut moving = stand();
    moving.velocity[0] = 0.01;
    sut.run(&moving, 0.5);
    let _ = sut.robot.heard().count();
    let stalled_ns = monotonic_ns();
    std::thread::sleep(Duration::from_millis(120));
    let heard: Vec<Heard> = sut.robot.heard().collect();
    let damped_ns = damped_after(&heard, stalled_ns).unwrap();
    let after_ms = (damped_ns - stalled_ns) as f64 * 1e-6;
    // 30 ms by the settings; a busy machine may be late, and is not asked to be in time here.
    assert!((20.0..500.0).contains(&after_ms), "{after_ms} ms");
    let held = heard.iter().filter(|heard| {
        let motor = heard.command.motors[0];
        motor.kp > 0 && motor.dq_rad_s == 0.0
    });
    assert!(held.count() > 3, "velocities are taken out before");
    // The controller comes back, and still believes that the robot stands.
    sut.run(&moving, 0.1);
    assert!(sut.plant.health().sender_damped);
    assert!(sut.robot.heard().all(|heard| asks_for_damping(&heard.command)));
    sut.run(&JointCommand::damping(), 0.05);
    assert!(sut.plant.health().sender_damped, "it is told for a while");
    sut.run(&JointCommand::damping(), 1.0);
    assert!(!sut.plant.health().sender_damped);
    sut.run(&moving, 0.05);
    assert!(!asks_for_damping(&sut.robot.heard().last().unwrap().command));
}

#[test]
fn r_safe_020_when_the_controller_ends_its_motors_are_damped_for_a_while() {
    let mut sut = Wires::new("standing");
    sut.run(&stand(), 0.3);
    let _ = sut.robot.heard().count();
    let Wires { plant, robot } = sut;
    let ended_ns = monotonic_ns();
    drop(plant);
    let heard: Vec<Heard> = robot.heard().collect();
    assert!(damped_after(&heard, ended_ns).is_some());
    // 500 ms of damping at 500 Hz, had no period been missed.
    let damped = heard.iter().filter(|heard| asks_for_damping(&heard.command)).count();
    assert!(damped > 100, "{damped}");
    assert!(asks_for_damping(&heard.last().unwrap().command));
}

#[test]
fn r_safe_021_the_remote_control_damps_whatever_the_controller_says() {
    let mut sut = Wires::new("standing");
    sut.run(&stand(), 0.3);
    sut.robot.set_faults(Faults { remote_stop: true, ..Faults::default() });
    sut.run(&stand(), 0.1);
    assert!(sut.plant.health().remote_stop && sut.plant.health().sender_damped);
    let _ = sut.robot.heard().count();
    sut.run(&stand(), 0.1);
    assert!(sut.robot.heard().all(|heard| asks_for_damping(&heard.command)));
    // Letting go of the buttons moves nothing by itself.
    sut.robot.set_faults(Faults::default());
    sut.run(&stand(), 0.1);
    assert!(!sut.plant.health().remote_stop && sut.plant.health().sender_damped);
}

#[test]
fn a_line_with_loss_jitter_and_damage_carries_the_robot() {
    let mut sut = Wires::new("standing");
    sut.run(&stand(), 0.3);
    let before = sut.plant.counts();
    let faults = Faults { loss: 0.05, jitter_ms: 5.0, corruption: 0.02, ..Faults::default() };
    sut.robot.set_faults(faults);
    sut.run(&stand(), 3.0);
    let (after, refused) = (sut.plant.counts(), sut.robot.counters().malformed.load(Ordering::Relaxed));
    assert!(!sut.robot.truth().unwrap().fallen && !sut.plant.health().sender_damped);
    let more = |of: fn(&locoman_robot::go1::LineCounts) -> u64| of(&after) - of(&before);
    assert!(more(|counts| counts.lost) > 20 && more(|counts| counts.reordered) > 100, "{after:?}");
    assert!(more(|counts| counts.corrupt) > 10 && refused > 5, "{after:?}, {refused} refused");
    assert!(more(|counts| counts.received) > 500, "{after:?}");
}

#[test]
fn what_the_board_says_of_itself_reaches_the_controller() {
    let mut sut = Wires::new("lying");
    sut.run(&JointCommand::damping(), 0.3);
    let well = sut.plant.health();
    assert!(!well.motor_fault && well.battery_percent > 80.0 && well.cell_v > 3.8 && well.motor_c < 60.0);
    sut.robot.set_faults(Faults {
        motor_error: Some(7),
        battery_percent: Some(8),
        cell_mv: Some(3104),
        battery_c: Some(66),
        ..Faults::default()
    });
    sut.run(&JointCommand::damping(), 0.1);
    let unwell = sut.plant.health();
    assert!(unwell.motor_fault && unwell.motor_c > 80.0);
    assert_eq!((unwell.battery_percent, unwell.battery_c), (8.0, 66.0));
    assert!((unwell.cell_v - 3.104).abs() < 1e-9);
}

#[test]
fn commands_go_out_at_a_steady_500_hz() {
    let mut sut = Wires::new("standing");
    sut.run(&stand(), 0.2);
    let _ = sut.robot.heard().count();
    let begin = Instant::now();
    sut.run(&stand(), 1.0);
    let heard: Vec<Heard> = sut.robot.heard().collect();
    let rate_hz = heard.len() as f64 / begin.elapsed().as_secs_f64();
    assert!(begin.elapsed() < WATCHDOG);
    // Periods that are missed are not made up for: never more, on a busy machine fewer.
    assert!((250.0..510.0).contains(&rate_hz), "{rate_hz} Hz");
    for heard in &heard {
        assert_eq!(heard.command.motors[MOTORS..], LowCommand::default().motors[MOTORS..]);
    }
}
