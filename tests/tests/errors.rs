//! Bad input: one clear error each, with the remedy; exit status not 0.

use std::net::{TcpListener, UdpSocket};
use std::path::Path;
use std::process::Output;

use locoman_tests::programs::{finish, root};

/// The error of a program that must have failed without a panic.
fn error_of(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success(), "must fail: {text}");
    assert_eq!(output.status.code(), Some(1), "an error, not a crash: {text}");
    assert!(!text.contains("panicked"), "{text}");
    assert_eq!(text.matches("error:").count(), 1, "one error: {text}");
    text
}

fn write(folder: &Path, name: &str, bytes: &[u8]) -> std::io::Result<String> {
    let path = folder.join(name);
    std::fs::write(&path, bytes)?;
    Ok(path.to_string_lossy().into_owned())
}

#[test]
fn a_damaged_recording_is_named_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let recording =
        write(folder.path(), "damaged.mcap", b"\x89MCAP0\r\nand then nothing that makes sense").unwrap();
    let poses = folder.path().join("poses.csv");
    let output = finish(
        "locoman-teleop",
        &[
            "track",
            &recording,
            "--rig",
            "configs/rigs/two_zed_pairs.toml",
            "--shells",
            "configs/shells/standard.toml",
            "-o",
            &poses.to_string_lossy(),
        ],
    )
    .unwrap();
    let error = error_of(&output);
    assert!(error.contains("damaged.mcap"), "{error}");
    assert!(!poses.exists(), "no half-written poses");
}

#[test]
fn a_rig_file_with_a_typo_is_named_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let rig = std::fs::read_to_string(root().join("configs/rigs/two_zed_pairs.toml")).unwrap();
    let line = 1 + rig.lines().position(|line| line.starts_with("distortion")).unwrap();
    let rig =
        write(folder.path(), "rig.toml", rig.replacen("distortion", "distorsion", 1).as_bytes()).unwrap();
    let output = finish(
        "locoman-teleop",
        &["track", "x.mcap", "--rig", &rig, "--shells", "configs/shells/standard.toml", "-o", "x.csv"],
    )
    .unwrap();
    let error = error_of(&output);
    assert!(error.contains("rig.toml") && error.contains("distorsion"), "{error}");
    assert!(error.contains(&format!("{line}")), "names line {line}: {error}");
}

#[test]
fn a_busy_plant_port_is_named() {
    let busy = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = busy.local_addr().unwrap().to_string();
    let output =
        finish("locoman-sim", &["robot", "--bind", &address, "--listen", "tcp/127.0.0.1:0"]).unwrap();
    let error = error_of(&output);
    assert!(error.contains(&address) && error.contains("--bind"), "{error}");
}

#[test]
fn a_busy_robot_endpoint_is_named() {
    let busy = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = busy.local_addr().unwrap().to_string();
    let endpoint = format!("tcp/{address}");
    let output = finish("locoman-robot", &["run", "--plant", "sim", "--listen", &endpoint]).unwrap();
    let error = error_of(&output);
    assert!(error.contains(&address) && error.contains("--listen"), "{error}");
}

#[test]
fn a_busy_console_port_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let busy = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = busy.local_addr().unwrap().to_string();
    let image = folder.path().join("unused.mcap");
    let output = finish(
        "locoman-teleop",
        &["run", "--joystick", "--console", &address, "--record", &image.to_string_lossy()],
    )
    .unwrap();
    let error = error_of(&output);
    assert!(error.contains(&address) && error.contains("--console"), "{error}");
}

#[test]
fn a_mujoco_library_that_cannot_be_brought_leaves_instructions() {
    let folder = tempfile::tempdir().unwrap();
    let output = locoman_tests::programs::program("xtask")
        .unwrap()
        .arg("setup")
        .env("XDG_CACHE_HOME", folder.path())
        .env("PIP_NO_INDEX", "1")
        .env("CI", "true")
        .output()
        .unwrap();
    let error = error_of(&output);
    assert!(error.contains("pip download") && error.contains("libmujoco"), "{error}");
}

#[test]
fn a_trajectory_with_a_wrong_time_is_named_with_its_line_and_what_to_write() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(root().join("configs/trajectories/square.toml")).unwrap();
    let line = 1 + text.lines().position(|line| line == "time_s = 4.0").unwrap();
    let text = text.replacen("time_s = 4.0", "time_s = 1.0", 1);
    let file = write(folder.path(), "wrong.toml", text.as_bytes()).unwrap();
    let output = finish("locoman-teleop", &["play", &file]).unwrap();
    let error = error_of(&output);
    let expected = format!("line {line}: time_s = 1; write a time after 2 s");
    assert!(error.contains("wrong.toml") && error.contains(&expected), "{error}");
}
