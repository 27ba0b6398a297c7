//! Stories: what a robot, a tracker and people do, and what must come of it.

use super::*;
use crate::observe::Shell;
use nalgebra::Isometry3;

const MS: u64 = 1_000_000;

/// A station's surroundings, advanced in steps of 10 ms.
struct Scene {
    sut: Pilot,
    now_ns: u64,
    inputs: Inputs,
    robot_talks: bool,
    palm_x_m: f64,
}

impl Scene {
    /// A robot in `mode` and an operator in view.
    fn new(mode: Mode, auto: Option<Mode>) -> Self {
        let robot = RobotView {
            received_ns: 0,
            source: 7,
            mode,
            goal: mode,
            severity: Severity::None,
            openings: [0.25, 0.5],
        };
        let inputs = Inputs { robot: Some(robot), ..Inputs::default() };
        let sut = Pilot::new(Config::default(), auto);
        Self { sut, now_ns: 1_000 * MS, inputs, robot_talks: true, palm_x_m: 0.0 }
    }

    fn step(&mut self) -> OperatorCommand {
        self.now_ns += 10 * MS;
        if let Some(robot) = self.inputs.robot.as_mut().filter(|_| self.robot_talks) {
            robot.received_ns = self.now_ns;
        }
        let mut seen = Observation {
            capture_ns: self.now_ns - 5 * MS,
            world_from_shell: [Some(Isometry3::identity()); 5],
        };
        seen.world_from_shell[Shell::RightPalm as usize] =
            Some(Isometry3::translation(self.palm_x_m, 0.0, 0.0));
        self.inputs.seen = Some(seen);
        let (command, _) = self.sut.step(self.now_ns, &self.inputs);
        self.inputs.mode = None;
        self.inputs.auto = None;
        command
    }

    fn steps(&mut self, ms: u64) -> OperatorCommand {
        (0..ms / 10).map(|_| self.step()).last().unwrap_or_default()
    }

    fn hold_browser(&mut self, drive: Drive) {
        self.inputs.browser = Hand { held: true, drive, linear: [1.0, 0.0, 0.0], ..Hand::default() };
    }

    fn robot(&mut self) -> &mut RobotView {
        self.inputs.robot.as_mut().unwrap()
    }
}

fn palm_x(command: &OperatorCommand) -> f64 {
    command.right_palm.as_ref().unwrap().position_m.as_ref().unwrap().x
}

#[test]
fn nothing_moves_until_somebody_engages() {
    let mut scene = Scene::new(Mode::RightGripper, None);
    scene.palm_x_m = 0.05;
    let command = scene.steps(1000);
    assert_eq!((command.engagement, command.right_palm), (0, None));
}

#[test]
fn a_held_dead_man_lets_the_operator_through_from_zero_and_releasing_it_holds() {
    let mut scene = Scene::new(Mode::RightGripper, None);
    scene.palm_x_m = 0.7;
    scene.step();
    scene.hold_browser(Drive::Tracker);
    let first = scene.step();
    assert_ne!(first.engagement, 0);
    assert_eq!(first.device(), Device::Tracker);
    assert_eq!(palm_x(&first), 0.0);
    assert_eq!(first.right_opening, Some(0.25), "jaws start where the robot's are");
    scene.palm_x_m = 0.75;
    assert!((palm_x(&scene.step()) - 0.05).abs() < 1e-12);
    scene.inputs.browser = Hand::default();
    assert_eq!(scene.step().engagement, 0);
    scene.palm_x_m = 0.4;
    scene.step();
    scene.hold_browser(Drive::Tracker);
    let second = scene.step();
    assert!(second.engagement > first.engagement);
    assert_eq!(palm_x(&second), 0.0);
}

#[test]
fn a_dead_man_held_since_before_the_start_does_not_engage() {
    let mut scene = Scene::new(Mode::RightGripper, None);
    scene.hold_browser(Drive::Sticks);
    assert_eq!(scene.steps(500).engagement, 0);
}

#[test]
fn the_autopilot_asks_for_its_mode_and_engages_when_it_has_arrived() {
    let mut scene = Scene::new(Mode::Stance, Some(Mode::RightGripper));
    let asked = scene.steps(1000);
    assert_eq!((asked.mode(), asked.engagement), (Mode::RightGripper, 0));
    assert_ne!(asked.mode_request_id, 0);
    scene.robot().goal = Mode::RightGripper;
    assert_eq!(scene.steps(500).engagement, 0);
    scene.robot().mode = Mode::RightGripper;
    assert_ne!(scene.step().engagement, 0);
}

#[test]
fn a_person_takes_over_from_the_autopilot_and_keeps_it_until_giving_it_back() {
    let mut scene = Scene::new(Mode::RightGripper, Some(Mode::RightGripper));
    let auto = scene.steps(100);
    assert_eq!(auto.device(), Device::Tracker);
    scene.hold_browser(Drive::Sticks);
    let person = scene.steps(1000);
    assert_eq!(person.device(), Device::Browser);
    assert!(person.engagement > auto.engagement);
    scene.inputs.browser = Hand::default();
    assert_eq!(scene.steps(2000).engagement, 0, "stays off");
    scene.inputs.auto = Some(true);
    assert_eq!(scene.step().device(), Device::Tracker);
}

#[test]
fn the_joystick_goes_before_the_browser() {
    let mut scene = Scene::new(Mode::RightGripper, None);
    scene.step();
    scene.hold_browser(Drive::Sticks);
    scene.step();
    scene.inputs.joystick = Hand { held: true, ..Hand::default() };
    assert_eq!(scene.step().device(), Device::Joystick);
}

#[test]
fn a_silent_robot_ends_the_engagement_and_a_person_must_press_again() {
    let mut scene = Scene::new(Mode::RightGripper, None);
    scene.step();
    scene.hold_browser(Drive::Tracker);
    let before = scene.step();
    scene.robot_talks = false;
    assert_eq!(scene.steps(490).engagement, before.engagement);
    assert_eq!(scene.steps(30).engagement, 0);
    assert_eq!(scene.sut.waiting_for(), "the robot is silent");
    scene.robot_talks = true;
    assert_eq!(scene.steps(100).engagement, 0, "still the same press");
    scene.inputs.browser = Hand::default();
    scene.step();
    scene.palm_x_m = 0.3;
    scene.hold_browser(Drive::Tracker);
    let after = scene.step();
    assert!(after.engagement > before.engagement);
    assert_eq!(palm_x(&after), 0.0);
}

#[test]
fn a_robot_that_was_restarted_gets_a_new_engagement_from_the_autopilot() {
    let mut scene = Scene::new(Mode::RightGripper, Some(Mode::RightGripper));
    let before = scene.steps(100);
    scene.robot().source = 8;
    assert_eq!(scene.step().engagement, 0);
    assert!(scene.steps(1500).engagement > before.engagement);
}

#[test]
fn a_robot_that_lets_go_ends_the_engagement() {
    let mut scene = Scene::new(Mode::RightGripper, Some(Mode::RightGripper));
    let before = scene.steps(1000);
    scene.robot().severity = Severity::Disengage;
    assert_eq!(scene.step().engagement, 0);
    // The severity clears only with a new engagement, so it must not prevent one.
    let after = scene.steps(1200);
    assert!(after.engagement > before.engagement);
    scene.robot().severity = Severity::LieDown;
    assert_eq!(scene.step().engagement, 0);
    assert_eq!(scene.steps(3000).engagement, 0, "but worse does");
}

#[test]
fn a_jump_of_the_operator_is_a_new_engagement_from_zero() {
    let mut scene = Scene::new(Mode::RightGripper, Some(Mode::RightGripper));
    let before = scene.steps(100);
    scene.palm_x_m = 0.05;
    let near = scene.step();
    assert_eq!(near.engagement, before.engagement);
    scene.palm_x_m = 0.5;
    let far = scene.step();
    assert!(far.engagement > before.engagement);
    assert_eq!(palm_x(&far), 0.0);
    assert!(scene.sut.take_notes().iter().any(|note| note.detail.contains("right palm jumped by 450 mm")));
}

#[test]
fn a_mode_request_of_a_person_ends_the_engagement_and_stands() {
    let mut scene = Scene::new(Mode::RightGripper, Some(Mode::RightGripper));
    assert_ne!(scene.steps(100).engagement, 0);
    scene.inputs.mode = Some(Mode::Stance);
    let command = scene.step();
    assert_eq!((command.engagement, command.mode()), (0, Mode::Stance));
    let later = scene.steps(5000);
    assert_eq!((later.engagement, later.mode_request_id), (0, command.mode_request_id));
}
