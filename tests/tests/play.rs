//! A trajectory file on the simulated robot, through real processes and real Zenoh sockets.

use std::path::Path;

use locoman_protocol::messages::Mode;
use locoman_tests::programs::{finish, root};
use locoman_tests::{Observer, Part, System};

/// There and back with gripper and torso in 3 s.
const TRAJECTORY: &str = r#"
    mode = "left_gripper"
    [[pose]]
    time_s = 1.5
    limb = { xyz = [0.03, 0.02, 0.02], rotvec = [0.1, -0.1, 0.0] }
    torso = { xyz = [0.0, 0.0, 0.01] }
    [[pose]]
    time_s = 3.0
    limb = {}
    torso = {}
"#;

#[test]
fn a_trajectory_is_played_on_the_robot_and_measured() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("there_and_back.toml");
    std::fs::write(&file, TRAJECTORY).unwrap();
    let mut system = System::new(Path::new("none"), &root().join("target/whole-system")).unwrap();
    let observer = Observer::connect(&system.endpoints()).unwrap();
    for part in [Part::Simulator, Part::Robot] {
        system.start(part).unwrap();
    }
    let [robot, _] = system.endpoints();
    let output = finish("locoman-teleop", &["play", &file.to_string_lossy(), "--connect", &robot]).unwrap();
    let (said, error) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    println!("{said}");
    assert!(output.status.success(), "{error}");
    assert!(said.contains("torso") && said.contains("limb"), "{said}");
    // 3.5 s at 100 Hz; a loaded machine may lose a few.
    let states: u32 = said.split_whitespace().rev().nth(1).and_then(|word| word.parse().ok()).unwrap();
    assert!((200..=400).contains(&states), "{said}");

    let seen = observer.seen();
    assert!(!seen.fallen);
    let state = seen.state.unwrap();
    assert_eq!((state.mode(), state.engagement), (Mode::LeftGripper, 0), "let go, in its mode");
}
