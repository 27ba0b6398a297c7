//! One control step.

use super::{
    compensation::Compensation,
    posture,
    requests::RequestLog,
    settings::RobotConfig,
    snapshot::{CommandTrace, Snapshot},
    timing::Percentiles,
};
use crate::{
    commander::{Command, Engagement, SampleClock},
    dynamics::State,
    estimator::KinematicEstimator,
    joints::JointVector,
    modes::{self, Choreography, JointGains, Machine, Mode, Phase, Progress, Refusal, Scene, Start},
    plant::{Health, JointCommand, Sensors},
    supervisor::{Assessment, SensorHealth, Stop, assess},
    wbc::{ContactSet, WbcOutput, WholeBodyController},
};

/// Shortest and longest time between samples that a step believes in, s.
const STEP_RANGE_S: (f64, f64) = (0.0005, 0.01);
/// How long the torque of the whole-body controller fades out when plain set-points take over, s.
const FADE_S: f64 = 0.5;

/// How the controller begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// Stand up as soon as there are sensors, without being asked.
    pub auto_stand: bool,
}

/// What comes from outside, besides the sensors.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Inputs {
    /// The latest accepted command.
    pub command: Option<Command>,
    /// The strongest stop asked for so far that was not taken yet.
    pub stop: Stop,
    /// What the robot says of itself.
    pub health: Health,
}

/// The controller.
pub struct Controller {
    pub(super) config: RobotConfig,
    pub(super) options: Options,
    pub(super) estimator: KinematicEstimator,
    pub(super) machine: Machine,
    pub(super) choreography: Choreography,
    pub(super) wbc: WholeBodyController,
    pub(super) compensation: Compensation,
    pub(super) output: WbcOutput,
    pub(super) engagement: Engagement,
    pub(super) requests: RequestLog,
    pub(super) clock: SampleClock,
    pub(super) stop: Stop,
    pub(super) refusal: Option<Refusal>,
    /// Joint positions of the last command.
    pub(super) desired: JointVector,
    /// The last command.
    pub(super) command: JointCommand,
    pub(super) trace: CommandTrace,
    pub(super) progress: Progress,
    pub(super) unloaded_ns: u64,
    pub(super) sample_ns: Option<u64>,
    pub(super) lost: bool,
    pub(super) stood: bool,
    /// Bounded by the last step: [`STEP_RANGE_S`].
    pub(super) dt_s: f64,
    pub(super) snapshot: Snapshot,
}

impl Controller {
    /// Takes all memory that it will need.
    pub fn new(config: RobotConfig, options: Options) -> Self {
        let control = config.control;
        let posture = control.poses.posture(&control.poses.fold_rad);
        Self {
            estimator: KinematicEstimator::new(control.estimator),
            machine: Machine::default(),
            choreography: Choreography::new(
                control.poses,
                control.motions,
                control.upright,
                config.limits,
                config.locomotion,
            ),
            wbc: WholeBodyController::new(config.wbc),
            compensation: Compensation::new(control.compensation),
            output: WbcOutput::hold(posture),
            engagement: Engagement::default(),
            requests: RequestLog::default(),
            clock: SampleClock::default(),
            stop: Stop::None,
            refusal: None,
            desired: posture,
            command: JointCommand::damping(),
            trace: CommandTrace::default(),
            progress: Progress::default(),
            unloaded_ns: 0,
            sample_ns: None,
            // The first sample is met as one after a long silence.
            lost: true,
            stood: false,
            dt_s: STEP_RANGE_S.0,
            snapshot: Snapshot::nothing_known(),
            config,
            options,
        }
    }

    /// State after the last step.
    pub fn snapshot(&self) -> &Snapshot {
        &self.snapshot
    }

    /// The last command.
    pub fn command(&self) -> &JointCommand {
        &self.command
    }

    /// Kinematics and dynamics of the last step under the whole-body controller.
    pub fn wbc(&self) -> &WholeBodyController {
        &self.wbc
    }

    /// One step with a new sample. `now_ns` is on the clock of the commands' arrival. Allocates nothing.
    pub fn tick(&mut self, now_ns: u64, sensors: &Sensors, inputs: &Inputs) -> JointCommand {
        if !sensors.is_finite() {
            return self.refuse_sensors(now_ns, inputs);
        }
        let dt_ns = self.sample_ns.map_or(0, |last| sensors.time_ns.saturating_sub(last));
        self.dt_s = (dt_ns as f64 * 1e-9).clamp(STEP_RANGE_S.0, STEP_RANGE_S.1);
        self.sample_ns = Some(sensors.time_ns);
        if std::mem::take(&mut self.lost) {
            self.meet(now_ns, sensors, inputs);
        }

        let contacts = self.choreography.setpoint().contacts;
        if self.machine.phase().is_balanced() {
            self.estimator.update(&self.config.model, sensors, &contacts, self.dt_s);
        } else {
            self.estimator.follow_tilt(sensors);
        }
        let state = self.estimator.state(sensors);

        self.latch(inputs);
        let (fresh, grip) = self.listen(now_ns, inputs);
        let assessment = self.assess(now_ns, sensors, SensorHealth::Good, inputs);
        self.decide(now_ns, sensors, &state, inputs, &assessment);

        let state = self.estimator.state(sensors);
        let scene = scene(&self.config, &state, &self.desired, &self.wbc, sensors, now_ns, self.dt_s);
        let operator =
            modes::Operator { command: inputs.command.as_ref().zip(grip), fresh, clock: &self.clock };
        self.progress = self.choreography.step(&scene, &operator);
        self.command = self.act(now_ns, &state);
        self.desired = self.command_positions(sensors);
        self.report(sensors, &state, assessment);
        self.command
    }

    /// No sample came. Returns what to send: the last command for a while, then damping.
    pub fn silent(&mut self, now_ns: u64, silent_ns: u64, inputs: &Inputs) -> JointCommand {
        self.latch(inputs);
        let health = SensorHealth::Silent { for_ns: silent_ns };
        let assessment = assess(&self.config.thresholds, &self.flags(now_ns, 0.0, health, inputs));
        if silent_ns as f64 * 1e-6 >= self.config.thresholds.sensors_lost_ms && !self.lost {
            self.lost = true;
            self.engagement.end(inputs.command.as_ref());
            // A robot that comes back is met anew; until then nothing stale may reach it.
            self.command = JointCommand::damping();
        }
        self.snapshot.assessment = assessment;
        self.snapshot.engagement = 0;
        self.command
    }

    /// Tells the loop's timing, for the snapshot.
    pub fn set_timing(&mut self, period: Percentiles, compute: Percentiles) {
        self.snapshot.period = period;
        self.snapshot.compute = compute;
    }

    /// Sensors that are no numbers: damp, and meet the robot anew after.
    fn refuse_sensors(&mut self, now_ns: u64, inputs: &Inputs) -> JointCommand {
        self.latch(inputs);
        let flags = self.flags(now_ns, 0.0, SensorHealth::NotFinite, inputs);
        self.snapshot.assessment = assess(&self.config.thresholds, &flags);
        self.snapshot.engagement = 0;
        self.engagement.end(inputs.command.as_ref());
        self.machine = Machine::default();
        self.enter_nothing();
        self.command = JointCommand::damping();
        self.command
    }

    fn enter_nothing(&mut self) {
        self.lost = true;
        self.stood = false;
        self.snapshot.mode = Mode::Damped;
        self.snapshot.goal = Mode::Damped;
        self.snapshot.phase = Phase::Damped;
    }

    /// Begins with a robot as it is found.
    fn meet(&mut self, now_ns: u64, sensors: &Sensors, inputs: &Inputs) {
        let start = posture::judge(&self.config.model, sensors);
        self.engagement.end(inputs.command.as_ref());
        self.desired = sensors.position;
        let stand = self.stop == Stop::None && (self.options.auto_stand || self.stood);
        self.machine = Machine::started(start, stand);
        self.take_up(now_ns, sensors, start);
    }

    /// Makes a new world and references from a robot as it is found, and begins the phase that is on.
    fn take_up(&mut self, now_ns: u64, sensors: &Sensors, start: Start) {
        let lifted = match start {
            Start::OnThree(side) => Some(side),
            Start::Down | Start::Standing => None,
        };
        let contacts = lifted.map_or(ContactSet::STANCE, |side| ContactSet::without(side.leg()));
        self.estimator.reset(&self.config.model, sensors, &contacts);
        self.output = WbcOutput::hold(sensors.position);
        self.compensation.restart();
        let state = self.estimator.state(sensors);
        let scene = scene(&self.config, &state, &self.desired, &self.wbc, sensors, now_ns, self.dt_s);
        self.choreography.take_up(&scene, lifted);
        self.choreography.enter(self.machine.phase(), &scene);
    }

    /// Runs the state machine, and begins what it decides.
    fn decide(
        &mut self,
        now_ns: u64,
        sensors: &Sensors,
        state: &State,
        inputs: &Inputs,
        assessment: &Assessment,
    ) {
        let mut request = inputs.command.as_ref().and_then(|command| self.requests.fresh(command));
        if request.is_some() {
            self.refusal = None;
        }
        let before = self.machine.phase();
        if request.is_some() && self.stop != Stop::None && before == Phase::Damped {
            // Taking back a stop and starting to move are two deliberate acts.
            self.stop = Stop::None;
            self.refusal = Some(Refusal::StopReleased);
            request = None;
        }
        let start = match before {
            Phase::Damped => posture::judge(&self.config.model, sensors),
            _ => Start::Down,
        };
        let tilt_rad = self.lean(sensors);
        let refusal = self.machine.step(&modes::Inputs {
            request,
            severity: assessment.severity,
            tilted: tilt_rad >= self.config.thresholds.tilt_hold_rad,
            control_fault: self.output.status.fault.is_some(),
            arrived: self.progress.arrived,
            airborne: self.progress.airborne,
            start,
        });
        self.refusal = refusal.or(self.refusal);
        let phase = self.machine.phase();
        if phase != before {
            self.change(now_ns, sensors, state, before, start);
        }
        self.stood = phase.is_balanced() || phase == Phase::StandUp;
    }

    fn change(&mut self, now_ns: u64, sensors: &Sensors, state: &State, before: Phase, start: Start) {
        let phase = self.machine.phase();
        self.engagement.interrupt();
        self.progress = Progress::default();
        if phase.is_balanced() && !before.is_balanced() {
            self.take_up(now_ns, sensors, start);
            return;
        }
        let mut state = *state;
        if let Some(new_from_old) = self.choreography.world_of(phase) {
            self.estimator.rebase(&new_from_old);
            self.choreography.rebase(&new_from_old);
            state = self.estimator.state(sensors);
        }
        let mut scene = scene(&self.config, &state, &self.desired, &self.wbc, sensors, now_ns, self.dt_s);
        if before == Phase::Damped {
            scene.desired = &sensors.position;
        }
        self.choreography.enter(phase, &scene);
    }

    /// From set-points to a joint command.
    fn act(&mut self, now_ns: u64, state: &State) -> JointCommand {
        let gains = self.config.control.gains;
        let opening = self.choreography.opening();
        let phase = self.machine.phase();
        let command = match phase {
            Phase::Damped => JointCommand { opening, ..JointCommand::damping() },
            Phase::StandUp | Phase::LieDown => {
                let (position, velocity) = self.choreography.posture(now_ns);
                let (kp, kd) = JointGains::vectors(gains.scripted_kp, gains.scripted_kd);
                let left = (1.0 - self.choreography.elapsed_s(now_ns) / FADE_S).max(0.0);
                let fading = if phase == Phase::LieDown { left } else { 0.0 };
                JointCommand { position, velocity, torque: self.output.torque * fading, kp, kd, opening }
            }
            _ => {
                let walks = phase.is_walking();
                self.wbc.set_walking(walks);
                let setpoint = self.choreography.setpoint();
                let objectives = setpoint.objectives();
                self.wbc.step(
                    &self.config.model,
                    state,
                    objectives.as_slice(),
                    &setpoint.contacts,
                    &mut self.output,
                );
                let WbcOutput { position, velocity, torque, .. } = self.output;
                let (kp, kd) = if walks {
                    JointGains::vectors(gains.walking_kp, gains.walking_kd)
                } else if setpoint.contacts.kneels() {
                    gains.kneeling()
                } else {
                    JointGains::vectors(gains.balance_kp, gains.balance_kd)
                };
                let mut command = JointCommand { position, velocity, torque, kp, kd, opening };
                self.compensation.set_legs_learn(!matches!(phase, Phase::LowerFoot(_)) && !walks);
                self.compensation.apply(
                    &self.config.model,
                    &(position - state.position),
                    &setpoint.contacts,
                    self.dt_s,
                    &mut command,
                );
                command
            }
        };
        if command.is_finite() { command } else { JointCommand::damping() }
    }

    /// Where the next scripted motion of joints begins.
    fn command_positions(&self, sensors: &Sensors) -> JointVector {
        if self.machine.phase() == Phase::Damped { sensors.position } else { self.command.position }
    }
}

fn scene<'a>(
    config: &'a RobotConfig,
    state: &'a State,
    desired: &'a JointVector,
    wbc: &WholeBodyController,
    sensors: &Sensors,
    now_ns: u64,
    dt_s: f64,
) -> Scene<'a> {
    Scene {
        model: &config.model,
        state,
        desired,
        com: *wbc.dynamics().com(),
        foot_force: sensors.foot_force,
        now_ns,
        dt_s,
    }
}
