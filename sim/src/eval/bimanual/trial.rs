//! One robot that sits up, works, is pushed, reaches up, and comes down.

use std::path::Path;

use locoman_robot::control::RobotConfig;
use locoman_robot::joints::{JOINTS, JointVector, Side};
use locoman_robot::model::Model;
use locoman_robot::modes::Mode;
use locoman_robot::trajectory::{Trajectory, Waypoint};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::film::Frame;
use crate::eval::body::{Body, align};
use crate::eval::lockstep::{Lockstep, ticks};
use crate::robot::{Disturbance, EXCHANGE_S, Options};

/// Longest time on the way up or down, s.
const PATIENCE_S: f64 = 30.0;
const REST_S: f64 = 1.0;
const ALIGN_S: f64 = 0.25;
/// The grippers go through so many random poses, each that far from the start and so long from the one before.
const POSES: usize = 4;
const POSE_S: f64 = 2.0;
const POSITION_M: f64 = 0.05;
const ROTATION_RAD: f64 = 0.25;
/// A push on a gripper, and how long it is watched afterwards, s.
const PUSH_N: f64 = 30.0;
const PUSH_S: f64 = 0.2;
const RECOVERY_S: f64 = 2.0;
/// Up, back to above the shoulder, and the time for it.
const UP: [f64; 3] = [-0.3, 0.0, 0.62];
const UP_S: f64 = 4.0;
/// Time between two pictures on the way up, s.
const FILM_S: f64 = 1.1;

/// How it went.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Time from four feet to upright, if it came there, s.
    pub up_s: Option<f64>,
    /// And back.
    pub down_s: Option<f64>,
    /// Still upright after pushes on both grippers, in six directions each.
    pub survived_pushes: bool,
    /// Mean distance of both grippers from where they should be, and the greatest, mm.
    pub position_mm: f64,
    /// mm
    pub greatest_mm: f64,
    /// Mean angle, and the greatest, rad.
    pub rotation_rad: f64,
    /// rad
    pub greatest_rad: f64,
    /// Greatest height of a gripper above the floor, m.
    pub height_m: f64,
    /// Greatest change of a leg joint's commanded torque from tick to tick, and greatest torque, as shares of its limit.
    pub torque_step: f64,
    /// The same change while it is pushed.
    pub pushed_step: f64,
    /// See above.
    pub torque: f64,
    /// On the way up, and where it reaches highest.
    pub film: Vec<Frame>,
}

/// A robot that is watched.
struct Trial {
    sut: Lockstep,
    model: Model,
    last: Option<JointVector>,
    pushed: bool,
    outcome: Outcome,
}

/// Plays everything; ends early where the robot falls.
pub fn play(configs: &Path, profile: &str, seed: u64) -> anyhow::Result<Outcome> {
    let options = Options { profile: profile.into(), posture: "standing".into(), seed, ..Options::default() };
    let config = RobotConfig::load(configs)?;
    let model = config.model.clone();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut sut = Lockstep::with_config(configs, config, &options)?;
    let coefficient = random.random_range(0.5..1.0);
    sut.plant_mut().disturb(&Disturbance::Friction { foot: None, coefficient })?;
    sut.go_to(Mode::Stance)?;
    let mut trial = Trial { sut, model, last: None, pushed: false, outcome: Outcome::default() };
    trial.run(&mut random, seed)?;
    Ok(trial.outcome)
}

impl Trial {
    fn run(&mut self, random: &mut ChaCha8Rng, seed: u64) -> anyhow::Result<()> {
        self.outcome.up_s = self.go_to(Mode::Bimanual)?;
        if self.outcome.up_s.is_none() {
            tracing::warn!("seed {seed}: did not sit up: {:?}", self.sut.snapshot().phase);
            return Ok(());
        }
        self.work(random)?;
        self.reach_up()?;
        self.outcome.survived_pushes = self.pushed()?;
        if !self.outcome.survived_pushes {
            tracing::warn!("seed {seed}: pushed over");
            return Ok(());
        }
        self.outcome.down_s = self.go_to(Mode::Stance)?;
        if self.outcome.down_s.is_none() {
            tracing::warn!("seed {seed}: did not come down: {:?}", self.sut.snapshot().phase);
        }
        Ok(())
    }

    /// One step; whether the robot has not fallen.
    fn tick(&mut self) -> anyhow::Result<bool> {
        self.sut.tick()?;
        let torque = self.torque();
        for joint in 0..JOINTS.min(12) {
            let limit = self.model.max_torque[joint];
            self.outcome.torque = self.outcome.torque.max(torque[joint].abs() / limit);
            let step = self.last.map_or(0.0, |last| (torque[joint] - last[joint]).abs());
            let worst =
                if self.pushed { &mut self.outcome.pushed_step } else { &mut self.outcome.torque_step };
            *worst = worst.max(step / limit);
        }
        self.last = Some(torque);
        Ok(!self.sut.truth().fallen)
    }

    /// What the command asks of the legs, for the joints as they were when it was computed.
    fn torque(&self) -> JointVector {
        let command = self.sut.controller().command();
        let snapshot = self.sut.snapshot();
        command.torque
            + command.kp.component_mul(&(command.position - snapshot.joint_position))
            + command.kd.component_mul(&(command.velocity - snapshot.joint_velocity))
    }

    fn ticks(&mut self, seconds: f64) -> anyhow::Result<bool> {
        for _ in 0..ticks(seconds) {
            if !self.tick()? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn film(&mut self, caption: String) {
        self.outcome.film.push(Frame::take(&self.sut, &self.model, caption));
    }

    /// How long it took, if it came there.
    fn go_to(&mut self, mode: Mode) -> anyhow::Result<Option<f64>> {
        self.sut.release();
        self.sut.request(mode);
        for tick in 1..=ticks(PATIENCE_S) {
            if !self.tick()? {
                return Ok(None);
            }
            if mode == Mode::Bimanual && (tick - 1).is_multiple_of(ticks(FILM_S)) {
                self.film(format!("{:.1} s", (tick - 1) as f64 * EXCHANGE_S));
            }
            if self.sut.snapshot().mode == mode && self.sut.snapshot().goal == mode {
                return Ok(Some(tick as f64 * EXCHANGE_S));
            }
        }
        Ok(None)
    }

    /// Both grippers go through random poses.
    fn work(&mut self, random: &mut ChaCha8Rng) -> anyhow::Result<()> {
        self.ticks(REST_S - ALIGN_S)?;
        let sim_from_world = align(&mut self.sut, ALIGN_S)?;
        let anchors = Side::ALL.map(|side| Body::Gripper(side).reference(&self.sut));
        let mut number = |most: f64| random.random_range(-most..most);
        let mut pose = || {
            let position = Vector3::from_fn(|_, _| number(POSITION_M));
            Isometry3::new(position, Vector3::from_fn(|_, _| number(ROTATION_RAD)))
        };
        let waypoints = (1..=POSES)
            .map(|place| Waypoint { limbs: [pose(), pose()], ..Waypoint::still(POSE_S * place as f64) });
        let Some(trajectory) = Trajectory::new(waypoints) else { return Ok(()) };
        self.sut.engage(&trajectory)?;
        let (mut distances, mut angles) = (Vec::new(), Vec::new());
        for tick in 1..=ticks(trajectory.duration_s()) {
            if !self.tick()? {
                break;
            }
            let sample = trajectory.at(tick as f64 * EXCHANGE_S);
            for side in Side::ALL {
                let wanted = sample.limbs[side.index()].displacing(&anchors[side.index()]).pose();
                let truth = Body::Gripper(side).truth(self.sut.truth(), &sim_from_world);
                distances.push(1e3 * (wanted.translation.vector - truth.translation.vector).norm());
                angles.push(wanted.rotation.angle_to(&truth.rotation));
            }
        }
        let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len().max(1) as f64;
        let greatest = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
        self.outcome.position_mm = mean(&distances);
        self.outcome.greatest_mm = greatest(&distances);
        self.outcome.rotation_rad = mean(&angles);
        self.outcome.greatest_rad = greatest(&angles);
        Ok(())
    }

    /// The right gripper goes as high as it can, pointing up, and comes back.
    fn reach_up(&mut self) -> anyhow::Result<()> {
        self.sut.release();
        self.ticks(0.5)?;
        let up = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -std::f64::consts::FRAC_PI_2);
        let mut high = Waypoint::still(UP_S);
        high.limbs[Side::Right.index()] = Isometry3::from_parts(Vector3::from(UP).into(), up);
        let hold = Waypoint { time_s: UP_S + 1.0, ..high };
        let Some(trajectory) = Trajectory::new([high, hold, Waypoint::still(2.0 * UP_S + 1.0)]) else {
            return Ok(());
        };
        self.sut.engage(&trajectory)?;
        for tick in 0..ticks(trajectory.duration_s() + 0.5) {
            if !self.tick()? {
                break;
            }
            if tick == ticks(UP_S + 0.5) {
                self.film("reaches up".into());
            }
            let height = self.sut.truth().world_from_gripper[Side::Right.index()].translation.z;
            self.outcome.height_m = self.outcome.height_m.max(height);
        }
        Ok(())
    }

    /// Each gripper is pushed along each axis in both directions.
    fn pushed(&mut self) -> anyhow::Result<bool> {
        self.sut.release();
        self.pushed = true;
        for side in Side::ALL {
            for axis in 0..3 {
                for sign in [1.0, -1.0] {
                    let force = Vector3::ith(axis, sign * PUSH_N);
                    self.sut.plant_mut().disturb(&Disturbance::push_gripper(side, force, PUSH_S))?;
                    if !self.ticks(PUSH_S + RECOVERY_S)? {
                        tracing::warn!("pushed over by {force:.0?} N at the {side:?} gripper");
                        return Ok(false);
                    }
                }
            }
        }
        self.pushed = false;
        Ok(self.sut.snapshot().mode == Mode::Bimanual)
    }
}
