//! The robot's program over the real robot's datagrams, as processes: it stands, follows, lies down; and killed at
//! any moment, it leaves damped motors.

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::time::{Duration, Instant};

use locoman_protocol::messages::{Mode, Severity};
use locoman_tests::observer::Seen;
use locoman_tests::programs::{finish, root};
use locoman_tests::{Observer, Part, Relay, System, Wires};

/// Standing up takes about 4 seconds; the machine may be loaded.
const PATIENCE: Duration = Duration::from_secs(60);
/// What is promised: motors damped within this after the program has died.
const DAMPED_WITHIN: Duration = Duration::from_millis(50);
/// How long the sender goes on damping, by configs/robot/go1.toml.
const LINGER: Duration = Duration::from_secs(3);

/// The torso goes up and back in 2 s.
const TRAJECTORY: &str = r#"
    mode = "stance"
    [[pose]]
    time_s = 1.0
    torso = { xyz = [0.0, 0.0, -0.03] }
    [[pose]]
    time_s = 2.0
    torso = {}
"#;

fn standing(seen: &Seen) -> bool {
    seen.state.as_ref().is_some_and(|state| state.mode() == Mode::Stance && state.goal() == Mode::Stance)
}

fn torso_m(observer: &Observer) -> f64 {
    let seen = observer.seen();
    seen.truth.and_then(|truth| truth.torso).and_then(|pose| pose.position_m).map_or(f64::NAN, |at| at.z)
}

fn wired(name: &str, faults: &[&str]) -> (Relay, System, Observer) {
    let mut wires = Wires::new().unwrap();
    let relay = Relay::start(wires.board).unwrap();
    wires.seen_at = relay.address();
    wires.faults = faults.iter().map(ToString::to_string).collect();
    let system = System::on_wires(&wires, &root().join("target/whole-system").join(name)).unwrap();
    let observer = Observer::connect(&system.endpoints()).unwrap();
    (relay, system, observer)
}

/// The robot first: a program without its servos' bus does not start.
fn start(system: &mut System, observer: &Observer) {
    system.start(Part::Simulator).unwrap();
    observer.wait_until("the virtual robot is on", PATIENCE, |seen| seen.truth.is_some()).unwrap();
    system.start(Part::Robot).unwrap();
}

/// Kills the robot's program and waits until its sender has ended too; how long the motors were not damped.
fn kill(system: &mut System, relay: &Relay) -> Duration {
    relay.take();
    let killed = Instant::now();
    system.kill(Part::Robot).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let passed = relay.take();
    let first = passed.iter().position(|passed| passed.at > killed && passed.damps).unwrap();
    assert!(passed[first..].iter().all(|passed| passed.damps), "once damped, it stays so");
    passed[first].at - killed
}

#[test]
fn r_safe_020_it_stands_and_follows_over_the_wires_and_killed_at_any_moment_it_leaves_damped_motors() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("down_and_up.toml");
    std::fs::write(&file, TRAJECTORY).unwrap();
    let (relay, mut system, observer) = wired("wires", &[]);
    start(&mut system, &observer);
    observer.wait_until("the robot stands", PATIENCE, standing).unwrap();
    assert!(torso_m(&observer) > 0.2 && !observer.seen().fallen);

    let [robot, _] = system.endpoints();
    let output = finish("locoman-teleop", &["play", &file.to_string_lossy(), "--connect", &robot]).unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(!observer.seen().fallen);

    // Killed while it stands.
    let undamped = kill(&mut system, &relay);
    assert!(undamped < DAMPED_WITHIN, "{undamped:?}");
    let height = torso_m(&observer);
    assert!(height < 0.25, "the legs give way: {height} m");
    // A new program waits until the old sender has ended, then stands up from where the legs are.
    system.start(Part::Robot).unwrap();
    observer
        .wait_until("a new program stands up", PATIENCE, |seen| torso_is_up(seen) && standing(seen))
        .unwrap();

    // Killed while it lies down, a moment after it was asked to.
    stop_politely(&system);
    std::thread::sleep(Duration::from_millis(700));
    let undamped = kill(&mut system, &relay);
    assert!(undamped < DAMPED_WITHIN, "{undamped:?}");
    std::thread::sleep(LINGER + Duration::from_secs(1));
    relay.take();
    std::thread::sleep(Duration::from_millis(200));
    assert!(relay.take().is_empty(), "the sender has ended");
}

#[test]
fn r_safe_021_the_remote_controls_stop_ends_in_a_damped_robot_that_says_why() {
    let (relay, mut system, observer) = wired("wires-remote", &["remote-stop@8"]);
    start(&mut system, &observer);
    observer
        .wait_until("the remote control stops it", PATIENCE, |seen| {
            seen.state.as_ref().is_some_and(|state| {
                state.severity() == Severity::Damp
                    && state.mode() == Mode::Damped
                    && state.reasons.iter().any(|reason| reason.contains("remote control"))
            })
        })
        .unwrap();
    relay.take();
    std::thread::sleep(Duration::from_millis(200));
    let passed = relay.take();
    assert!(passed.len() > 20 && passed.iter().all(|passed| passed.damps));
}

fn torso_is_up(seen: &Seen) -> bool {
    let pose = seen.truth.as_ref().and_then(|truth| truth.torso.as_ref());
    pose.and_then(|pose| pose.position_m.as_ref()).is_some_and(|at| at.z > 0.2)
}

/// As Ctrl-C does.
fn stop_politely(system: &System) {
    let id = system.id(Part::Robot).unwrap().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &id]).status().unwrap().success());
}
