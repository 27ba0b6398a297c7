//! Who moves the robot, and how: one step of the command stream. Pure: time and inputs come from outside.
//!
//! Rules, in this order:
//! 1. A silent robot, or one that has let go, ends the engagement. A person must release the dead-man and
//!    press it again; the autopilot pauses.
//! 2. A person who holds a dead-man goes before the autopilot, and switches it off. The joystick goes
//!    before the browser.
//! 3. A change of driver, a mode request, or a body that jumps starts a new engagement, in which every
//!    displacement is zero again.
//! 4. Without a driver the command says "hold" (engagement 0); it is sent all the same.

use locoman_protocol::geometry;
use locoman_protocol::messages::{Device, Mode, OperatorCommand, Severity, Velocity};

use crate::auto::{Auto, Step};
use crate::config::Config;
use crate::ids::Ids;
use crate::map::Mapper;
use crate::motion::{Body, Motion};
use crate::observe::Observation;
use crate::robot_view::RobotView;
use crate::stick::{Drive, Hand, StickMotion};

/// The robot may need this long to answer a new engagement before its severity counts against it.
const GRACE_NS: u64 = 300_000_000;
/// Longest step that sticks are integrated over: a stalled station does not make up for lost motion.
const MAX_STEP_S: f64 = 0.05;

/// Everything that a step depends on.
#[derive(Debug, Default)]
pub struct Inputs {
    /// The robot's last word, however old.
    pub robot: Option<RobotView>,
    /// The tracker's last word, however old.
    pub seen: Option<Observation>,
    /// Gamepad at this computer.
    pub joystick: Hand,
    /// Keyboard or gamepad of the browser.
    pub browser: Hand,
    /// A mode that a person has asked for since the last step.
    pub mode: Option<Mode>,
    /// A person has switched the autopilot on or off since the last step.
    pub auto: Option<bool>,
}

/// Something worth recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// A word for the kind: `engaged`, `disengaged`, `mode`, `auto`, `stop`.
    pub name: &'static str,
    /// Why, for people.
    pub detail: String,
}

#[derive(Debug)]
enum Source {
    Tracker(Box<Mapper>),
    Sticks(Box<StickMotion>),
}

/// One uninterrupted engagement.
#[derive(Debug)]
struct Engagement {
    id: u64,
    device: Device,
    drive: Drive,
    since_ns: u64,
    source: Source,
    motion: Motion,
    capture_ns: u64,
}

/// Turns inputs into the command stream.
#[derive(Debug)]
pub struct Pilot {
    config: Config,
    ids: Ids,
    auto: Option<Auto>,
    engagement: Option<Engagement>,
    /// Joystick, browser: must be seen released before they engage.
    must_release: [bool; 2],
    request: (u64, Mode),
    last_ns: Option<u64>,
    robot_source: Option<u64>,
    notes: Vec<Note>,
    waiting_for: &'static str,
}

impl Pilot {
    /// A pilot that holds. `auto`: engage by itself in this mode.
    pub fn new(config: Config, auto: Option<Mode>) -> Self {
        Self {
            config,
            ids: Ids::new(),
            auto: auto.map(Auto::new),
            engagement: None,
            must_release: [true; 2],
            request: (0, Mode::Unspecified),
            last_ns: None,
            robot_source: None,
            notes: Vec::new(),
            waiting_for: "",
        }
    }

    /// What happened since the last call.
    pub fn take_notes(&mut self) -> Vec<Note> {
        std::mem::take(&mut self.notes)
    }

    /// Whether an autopilot acts; `None` if there is none.
    pub fn auto_enabled(&self) -> Option<bool> {
        self.auto.as_ref().map(Auto::enabled)
    }

    /// Whether a recorded operator should wait: the autopilot acts, but has not engaged.
    pub fn operator_waits(&self) -> bool {
        self.auto_enabled() == Some(true) && self.engagement.is_none()
    }

    /// Why nothing moves; empty while engaged.
    pub fn waiting_for(&self) -> &'static str {
        if self.engagement.is_some() { "" } else { self.waiting_for }
    }

    /// The command of this instant, and the capture time that it goes back to (0: none).
    pub fn step(&mut self, now_ns: u64, inputs: &Inputs) -> (OperatorCommand, u64) {
        let dt_s = self.last_ns.map_or(0.0, |last| now_ns.saturating_sub(last) as f64 * 1e-9).min(MAX_STEP_S);
        self.last_ns = Some(now_ns);
        for (hand, must_release) in
            [&inputs.joystick, &inputs.browser].into_iter().zip(&mut self.must_release)
        {
            *must_release &= hand.held;
        }
        let silent_ns = self.config.command.robot_silent_ms * 1_000_000;
        let robot =
            inputs.robot.as_ref().filter(|robot| now_ns.saturating_sub(robot.received_ns) <= silent_ns);
        let stale_ns = self.config.tracking.stale_ms * 1_000_000;
        let seen = inputs.seen.as_ref().filter(|seen| now_ns.saturating_sub(seen.capture_ns) <= stale_ns);

        self.waiting_for = "hold the dead-man to engage";
        self.watch_robot(now_ns, robot);
        self.take_requests(inputs);
        match self.driver(now_ns, robot, seen, inputs) {
            Some((device, drive)) => self.engage(now_ns, device, drive, robot, seen),
            None => self.release("dead-man released"),
        }
        self.advance(now_ns, robot, seen, inputs, dt_s);
        self.command()
    }

    /// Rule 1.
    fn watch_robot(&mut self, now_ns: u64, robot: Option<&RobotView>) {
        let Some(robot) = robot else {
            self.end(now_ns, "the robot is silent");
            return;
        };
        if self.robot_source.replace(robot.source).is_some_and(|before| before != robot.source) {
            self.end(now_ns, "the robot's program was restarted");
        }
        let Some(engagement) = &self.engagement else { return };
        let young = now_ns.saturating_sub(engagement.since_ns) < GRACE_NS;
        if robot.severity > Severity::Disengage || (robot.severity == Severity::Disengage && !young) {
            self.end(now_ns, "the robot let go");
        }
    }

    fn take_requests(&mut self, inputs: &Inputs) {
        if let Some(mode) = inputs.mode {
            self.set_auto(false, "a person asked for a mode");
            self.release("a person asked for a mode");
            self.must_release = [true; 2];
            self.ask(mode);
        }
        if let Some(on) = inputs.auto {
            self.set_auto(on, "a person's choice");
        }
    }

    /// Rule 2, and the autopilot.
    fn driver(
        &mut self,
        now_ns: u64,
        robot: Option<&RobotView>,
        seen: Option<&Observation>,
        inputs: &Inputs,
    ) -> Option<(Device, Drive)> {
        let hands = [(Device::Joystick, &inputs.joystick), (Device::Browser, &inputs.browser)];
        for (index, (device, hand)) in hands.into_iter().enumerate() {
            if hand.held {
                self.set_auto(false, "a person took over");
                if self.must_release[index] {
                    if robot.is_some() {
                        self.waiting_for = "release the dead-man once";
                    }
                    continue;
                }
                let driven = if hand.drive == Drive::Tracker { Device::Tracker } else { device };
                return Some((driven, hand.drive));
            }
        }
        let auto = self.auto.as_mut()?;
        if auto.enabled() && robot.is_some() {
            self.waiting_for = "the autopilot waits for the robot's mode and the operator";
        }
        match auto.step(now_ns, robot, seen, self.engagement.is_some()) {
            Step::Engage => Some((Device::Tracker, Drive::Tracker)),
            Step::Request(mode) => {
                self.ask(mode);
                None
            }
            Step::Wait => None,
        }
    }

    /// Rule 3: goes on with the engagement if the driver is the same, else starts one.
    fn engage(
        &mut self,
        now_ns: u64,
        device: Device,
        drive: Drive,
        robot: Option<&RobotView>,
        seen: Option<&Observation>,
    ) {
        if self.engagement.as_ref().is_some_and(|e| e.device == device && e.drive == drive) {
            return;
        }
        self.release("another device took over");
        let Some(robot) = robot else {
            self.waiting_for = "the robot is silent";
            return;
        };
        if robot.severity > Severity::Disengage {
            self.waiting_for = "the robot is in trouble";
            return;
        }
        let (source, motion, capture_ns) = match drive {
            Drive::Sticks => {
                let sticks = StickMotion::engage(&self.config.stick, robot.openings);
                (Source::Sticks(Box::new(sticks)), Motion::default(), now_ns)
            }
            Drive::Tracker => {
                let Some(seen) = seen else {
                    self.waiting_for = "the operator is not seen";
                    return;
                };
                let mut mapper = Mapper::engage(&self.config, seen, robot.openings);
                let motion = mapper.map(seen).unwrap_or_default();
                (Source::Tracker(Box::new(mapper)), motion, seen.capture_ns)
            }
        };
        let id = self.ids.next_id();
        self.note("engaged", format!("{id} by {}", name(device)));
        self.engagement =
            Some(Engagement { id, device, drive, since_ns: now_ns, source, motion, capture_ns });
    }

    /// Brings the motion of the engagement up to date.
    fn advance(
        &mut self,
        now_ns: u64,
        robot: Option<&RobotView>,
        seen: Option<&Observation>,
        inputs: &Inputs,
        dt_s: f64,
    ) {
        let Some(engagement) = &mut self.engagement else { return };
        match &mut engagement.source {
            Source::Sticks(sticks) => {
                let hand =
                    if engagement.device == Device::Joystick { &inputs.joystick } else { &inputs.browser };
                engagement.motion = {
                    let (hand, side) = robot.map_or((*hand, None), |robot| robot.driven(hand));
                    sticks.advance(&hand, side, robot.is_some_and(RobotView::walks), dt_s)
                };
                engagement.capture_ns = now_ns;
            }
            Source::Tracker(mapper) => {
                let Some(seen) = seen else {
                    engagement.motion = Motion::default();
                    return;
                };
                match mapper.map(seen) {
                    Ok(motion) => {
                        engagement.motion = motion;
                        engagement.capture_ns = seen.capture_ns;
                    }
                    Err(jump) => {
                        let (device, drive) = (engagement.device, engagement.drive);
                        self.release(&jump.to_string());
                        self.engage(now_ns, device, drive, robot, Some(seen));
                    }
                }
            }
        }
    }

    /// Rule 4.
    fn command(&self) -> (OperatorCommand, u64) {
        let (mode_request_id, mode) = self.request;
        let idle = OperatorCommand { mode_request_id, mode: mode.into(), ..OperatorCommand::default() };
        let Some(engagement) = &self.engagement else { return (idle, 0) };
        let body = |body: Body| engagement.motion.body(body).map(geometry::pose);
        let command = OperatorCommand {
            engagement: engagement.id,
            device: engagement.device.into(),
            torso: body(Body::Torso),
            right_palm: body(Body::RightPalm),
            left_palm: body(Body::LeftPalm),
            right_opening: engagement.motion.openings[0],
            left_opening: engagement.motion.openings[1],
            walk: engagement.motion.walk.map(|[forward_m_s, left_m_s, turn_rad_s]| Velocity {
                forward_m_s,
                left_m_s,
                turn_rad_s,
            }),
            ..idle
        };
        (command, engagement.capture_ns)
    }

    /// Ends the engagement against the driver's will: people must press again, the autopilot pauses.
    fn end(&mut self, now_ns: u64, why: &'static str) {
        self.waiting_for = why;
        if self.engagement.is_some() {
            self.must_release = [true; 2];
            if let Some(auto) = &mut self.auto {
                auto.disengaged(now_ns);
            }
        }
        self.release(why);
    }

    fn release(&mut self, why: &str) {
        if let Some(engagement) = self.engagement.take() {
            self.note("disengaged", format!("{}: {why}", engagement.id));
        }
    }

    fn ask(&mut self, mode: Mode) {
        self.request = (self.ids.next_id(), mode);
        self.note("mode", mode.as_str_name().to_owned());
    }

    fn set_auto(&mut self, on: bool, why: &'static str) {
        let Some(auto) = self.auto.as_mut().filter(|auto| auto.enabled() != on) else { return };
        auto.enable(on);
        self.note("auto", format!("{}: {why}", if on { "on" } else { "off" }));
    }

    fn note(&mut self, name: &'static str, detail: String) {
        self.notes.push(Note { name, detail });
    }
}

const fn name(device: Device) -> &'static str {
    match device {
        Device::Unspecified => "nobody",
        Device::Tracker => "tracker",
        Device::Joystick => "joystick",
        Device::Browser => "browser",
        Device::Trajectory => "trajectory",
    }
}

#[cfg(test)]
#[path = "pilot_tests.rs"]
mod tests;
