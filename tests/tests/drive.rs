//! From recorded images to the simulated robot's motion, through real processes and real Zenoh sockets;
//! then each process is killed and started again.
//!
//! One test, because it takes real time: the story of a session.

use std::time::Duration;

use locoman_protocol::geometry::isometry;
use locoman_protocol::messages::{Mode, Severity};
use locoman_tests::observer::Seen;
use locoman_tests::{Observer, Part, System, programs};
use nalgebra::Isometry3;

/// Standing up and changing the mode take about 3 and 3 seconds; the machine may be loaded.
const PATIENCE: Duration = Duration::from_secs(60);
/// What the issue allows the others to notice a death in.
const NOTICE: Duration = Duration::from_millis(500);
/// Between a message and its arrival here, on a loaded machine.
const SLACK: Duration = Duration::from_millis(250);
/// Between two looks of 5 ms no gripper may move farther than this: a jump, not a motion.
const JUMP_M: f64 = 0.03;

fn true_gripper(seen: &Seen) -> Option<Isometry3<f64>> {
    isometry(seen.truth.as_ref()?.right_gripper.as_ref()?).ok()
}

fn engaged(seen: &Seen) -> bool {
    seen.state.as_ref().is_some_and(|state| {
        state.engagement != 0 && state.mode() == Mode::RightGripper && state.severity() <= Severity::Warn
    })
}

fn standing(seen: &Seen) -> bool {
    seen.state.as_ref().is_some_and(|state| state.mode() == Mode::Stance && state.goal() == Mode::Stance)
}

/// Waits while watching that the true gripper never jumps and the robot never falls.
fn wait_without_a_jump(
    observer: &Observer,
    what: &str,
    mut holds: impl FnMut(&Seen) -> bool,
) -> anyhow::Result<()> {
    let mut last = true_gripper(&observer.seen());
    observer
        .wait_until(what, PATIENCE, |seen| {
            if let (Some(now), Some(before)) = (true_gripper(seen), last) {
                let step_m = (now.translation.vector - before.translation.vector).norm();
                assert!(step_m < JUMP_M, "{what}: the gripper jumped by {step_m} m");
            }
            last = true_gripper(seen);
            assert!(!seen.fallen, "{what}: the robot fell");
            holds(seen)
        })
        .map(drop)
}

/// How far the true gripper travels within a time.
fn travel_m(observer: &Observer, time: Duration) -> f64 {
    let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
    let start = std::time::Instant::now();
    while start.elapsed() < time {
        if let Some(pose) = true_gripper(&observer.seen()) {
            for axis in 0..3 {
                low[axis] = low[axis].min(pose.translation.vector[axis]);
                high[axis] = high[axis].max(pose.translation.vector[axis]);
            }
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    (0..3).map(|axis| (high[axis] - low[axis]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn images_move_the_robot_and_any_process_may_die() {
    let folder = tempfile::tempdir().unwrap();
    let recording = programs::operator_recording(folder.path()).unwrap();
    let mut system = System::new(&recording, &programs::root().join("target/whole-system")).unwrap();
    let observer = Observer::connect(&system.endpoints()).unwrap();
    for part in [Part::Simulator, Part::Robot, Part::Station] {
        system.start(part).unwrap();
    }
    wait_without_a_jump(&observer, "the recorded operator is engaged", engaged).unwrap();
    let moved_m = travel_m(&observer, Duration::from_secs(6));
    assert!(moved_m > 0.03, "the gripper follows the hand: it travelled {moved_m} m");

    // The station dies: the robot disengages at once, holds, and stands on four feet by itself.
    system.kill(Part::Station).unwrap();
    let noticed = observer
        .wait_until("the robot notices the station's death", PATIENCE, |seen| {
            seen.state.as_ref().is_some_and(|state| state.severity() >= Severity::Hold)
        })
        .unwrap();
    assert!(noticed < NOTICE + SLACK, "noticed after {noticed:?}");
    wait_without_a_jump(&observer, "the robot stands without an operator", standing).unwrap();
    system.start(Part::Station).unwrap();
    wait_without_a_jump(&observer, "a new station engages", engaged).unwrap();

    // The robot's controller dies: its motors hold the last command; a new one stands, then is engaged.
    system.kill(Part::Robot).unwrap();
    let held_m = travel_m(&observer, Duration::from_secs(1));
    assert!(held_m < 0.02, "the robot holds its pose: it travelled {held_m} m");
    system.start(Part::Robot).unwrap();
    wait_without_a_jump(&observer, "a new controller stands and is engaged", engaged).unwrap();

    // The simulator dies: the robot says so at once, goes on running, and stands up the new one.
    system.kill(Part::Simulator).unwrap();
    let noticed = observer
        .wait_until("the robot notices the simulator's death", PATIENCE, |seen| {
            seen.state_age() < SLACK
                && seen.state.as_ref().is_some_and(|state| state.severity() >= Severity::Hold)
        })
        .unwrap();
    assert!(noticed < NOTICE + SLACK, "noticed after {noticed:?}");
    system.start(Part::Simulator).unwrap();
    observer.wait_until("the robot is engaged in the new simulator", PATIENCE, engaged).unwrap();
    assert!(!observer.seen().fallen);
}
