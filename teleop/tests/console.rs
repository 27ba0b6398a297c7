//! The console in a real browser: the station's own program, a fake robot on a real Zenoh socket.

#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a panic here is the report")]

mod browser;

use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use browser::{Browser, until};
use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::messages::{Device, Mode, OperatorCommand, Pose, Quaternion, RobotState, Vector3};
use locoman_protocol::{Endpoints, Link, Subscription};
use locoman_vision::image::GrayImage;

/// Standing: hip, thigh, calf of each leg, arms stowed.
const STAND: [f64; 18] =
    [0.0, 0.9, -1.8, 0.0, 0.9, -1.8, 0.0, 0.9, -1.8, 0.0, 0.9, -1.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// A robot that does what it is asked for, at once.
struct FakeRobot {
    last: Arc<Mutex<OperatorCommand>>,
    talks: Arc<AtomicBool>,
    _commands: Subscription,
    _link: Arc<Link>,
}

impl FakeRobot {
    fn start(endpoint: &str) -> Self {
        let endpoints = Endpoints { listen: vec![endpoint.to_owned()], connect: vec![] };
        let link = Arc::new(Link::open("locoman", &endpoints).unwrap());
        let last = Arc::new(Mutex::new(OperatorCommand::default()));
        let heard = Arc::clone(&last);
        let commands = link
            .subscribe::<OperatorCommand>(move |command| *heard.lock().unwrap() = command.message)
            .unwrap();
        let talks = Arc::new(AtomicBool::new(true));
        let (mut states, last_for_state, talking) =
            (link.sender::<RobotState>().unwrap(), Arc::clone(&last), Arc::clone(&talks));
        std::thread::spawn(move || {
            loop {
                if talking.load(Ordering::Relaxed) {
                    let command = last_for_state.lock().unwrap().clone();
                    let mode = if command.mode_request_id == 0 { Mode::Stance } else { command.mode() };
                    let state = RobotState {
                        mode: mode.into(),
                        goal: mode.into(),
                        joint_position_rad: STAND.to_vec(),
                        torso: Some(origin()),
                        torso_target: Some(origin()),
                        ..RobotState::default()
                    };
                    if states.send(monotonic_ns(), state).is_err() {
                        return;
                    }
                }
                std::thread::sleep(Duration::from_millis(10));
            }
        });
        Self { last, talks, _commands: commands, _link: link }
    }

    fn command(&self) -> OperatorCommand {
        self.last.lock().unwrap().clone()
    }
}

fn origin() -> Pose {
    Pose {
        position_m: Some(Vector3::default()),
        orientation: Some(Quaternion { w: 1.0, ..Quaternion::default() }),
    }
}

/// The station's program, ended when dropped.
struct Station(Child);

impl Drop for Station {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn free_address() -> String {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string()
}

fn start_station(console: &str, robot: &str) -> Station {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    let child = Command::new(env!("CARGO_BIN_EXE_locoman-teleop"))
        .args(["run", "--joystick", "--console", console, "--connect", robot, "--configs"])
        .arg(configs)
        .spawn()
        .unwrap();
    until("the console's port", || std::net::TcpStream::connect(console).ok());
    Station(child)
}

fn text_of(page: &mut Browser, id: &str) -> String {
    page.evaluate(&format!("document.getElementById('{id}')?.textContent"))
        .as_str()
        .unwrap_or_default()
        .into()
}

/// The 3D view shows something: the left part of the window, below the header, holds many grey levels.
fn assert_not_blank(png: &[u8]) {
    let image = GrayImage::decode(png).unwrap();
    let mut counts = [0_u32; 256];
    for y in image.height() / 8..image.height() / 2 {
        for &pixel in &image.row(y)[..image.width() as usize / 2] {
            counts[usize::from(pixel)] += 1;
        }
    }
    let levels = counts.iter().filter(|&&count| count > 20).count();
    assert!(levels > 20, "only {levels} grey levels: the picture is blank");
}

#[test]
fn a_person_sees_the_robot_asks_for_a_mode_takes_over_by_keyboard_and_sees_it_fall_silent() {
    let (console, robot_address) = (free_address(), format!("tcp/{}", free_address()));
    let robot = FakeRobot::start(&robot_address);
    let _station = start_station(&console, &robot_address);
    let mut page = Browser::open(&format!("http://{console}/"), 1600, 1000);

    until("the robot's mode", || (text_of(&mut page, "mode") == "stance").then_some(()));
    let png = page.screenshot();
    let shot = Path::new(env!("CARGO_TARGET_TMPDIR")).join("../console.png");
    std::fs::write(shot, &png).unwrap();
    assert_not_blank(&png);

    assert_eq!(robot.command().mode_request_id, 0);
    page.click("[data-mode=right_gripper]");
    until("the request", || (robot.command().mode() == Mode::RightGripper).then_some(()));
    until("the mode on the page", || (text_of(&mut page, "mode") == "right gripper").then_some(()));

    page.key("keyDown", "Space", " ");
    page.key("keyDown", "KeyW", "w");
    let forward = until("the gripper to be driven forward", || {
        let command = robot.command();
        let palm = command.right_palm.as_ref()?.position_m.as_ref()?.x;
        (command.engagement != 0 && palm > 0.002).then_some(command)
    });
    assert_eq!(forward.device(), Device::Browser);
    page.key("keyUp", "KeyW", "w");
    page.key("keyUp", "Space", " ");
    until("the release", || (robot.command().engagement == 0).then_some(()));

    robot.talks.store(false, Ordering::Relaxed);
    until("the page to say so", || text_of(&mut page, "banner").contains("Robot silent since").then_some(()));
}
