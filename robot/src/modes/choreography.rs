//! Moves the robot through the phases: what each body's reference is, from the instant a phase begins.
//!
//! Every motion begins at the reference as it is and moves (never at a measurement), so that phases may be
//! interrupted by each other without a step.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::{
    driving::{Driving, Operator},
    leg_return::LegReturn,
    mode::{Effector, Phase},
    posture_motion::PostureMotion,
    scene::Scene,
    setpoint::Setpoint,
    settings::{MotionSettings, PoseSettings},
};
use crate::{
    commander::{Limits, PointMotion, PoseMotion, PoseReference},
    estimator::heading,
    joints::{JointVector, Leg, Side},
    kinematics::torso_from_frame,
    model::Frame,
    wbc::PointReference,
};

/// Samples in a row that must feel the ground.
const TOUCH_SAMPLES: u32 = 4;
/// Share of the foot's lifting after which its arm unfolds: in the air.
const UNFOLD_AFTER: f64 = 0.4;

/// How far a phase has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Progress {
    /// Its motion has ended where it should.
    pub arrived: bool,
    /// The foot that lifts is off the ground.
    pub airborne: bool,
    /// The foot has gone as deep as it may, and felt no ground.
    pub no_ground: bool,
}

impl Progress {
    fn on_four_feet(arrived: bool) -> Self {
        Self { arrived, ..Self::default() }
    }

    fn on_three_feet(arrived: bool) -> Self {
        Self { arrived, airborne: true, ..Self::default() }
    }
}

/// The motions of the phase that is on.
#[derive(Debug, Clone)]
pub struct Choreography {
    poses: PoseSettings,
    motions: MotionSettings,
    phase: Phase,
    entered_ns: u64,
    setpoint: Setpoint,
    posture: PostureMotion,
    torso: PoseMotion,
    arms: [PointMotion; 2],
    foot: PointMotion,
    leg: LegReturn,
    driving: Driving,
    /// Samples in a row that have felt the ground.
    touching: u32,
}

impl Choreography {
    /// At rest, damped.
    pub fn new(poses: PoseSettings, motions: MotionSettings, limits: Limits) -> Self {
        let identity = Isometry3::identity();
        let stand = poses.posture(&poses.stand_rad);
        Self {
            setpoint: Setpoint::standing(&identity, Side::ALL.map(|side| poses.stow(side))),
            posture: PostureMotion::new(&stand, &stand, &stand, 1.0, 1.0),
            torso: PoseMotion::new(&PoseReference::hold(&identity), &identity, 1.0),
            arms: Side::ALL.map(|side| PointMotion::hold(poses.stow(side))),
            foot: PointMotion::hold(Vector3::zeros()),
            leg: LegReturn::hold(poses.stand_rad),
            driving: Driving::new(limits, &stand),
            touching: 0,
            phase: Phase::Damped,
            entered_ns: 0,
            poses,
            motions,
        }
    }

    /// References of a phase in which the whole-body controller works.
    pub fn setpoint(&self) -> &Setpoint {
        &self.setpoint
    }

    /// Openings asked of the grippers right, left.
    pub fn opening(&self) -> [f64; 2] {
        self.driving.opening()
    }

    /// Joint positions and velocities of a phase without the whole-body controller.
    pub fn posture(&self, now_ns: u64) -> (JointVector, JointVector) {
        self.posture.sample(self.elapsed_s(now_ns))
    }

    /// Seconds in this phase.
    pub fn elapsed_s(&self, now_ns: u64) -> f64 {
        now_ns.saturating_sub(self.entered_ns) as f64 * 1e-9
    }

    /// The move of the world that a phase begins with: to the place and heading of the torso's target.
    pub fn world_of(&self, phase: Phase) -> Option<Isometry3<f64>> {
        matches!(phase, Phase::Stance | Phase::LiftFoot(_)).then(|| {
            let torso = self.setpoint.torso.pose();
            Isometry3::from_parts(torso.translation, heading(&torso.rotation)).inverse()
        })
    }

    /// Expresses all references in another world.
    pub fn rebase(&mut self, new_from_old: &Isometry3<f64>) {
        self.setpoint = self.setpoint.rebased(new_from_old);
    }

    /// Takes up a robot as it is found, all feet on the ground or one front foot lifted: references where the
    /// bodies are.
    pub fn take_up(&mut self, scene: &Scene<'_>, lifted: Option<Side>) {
        let arms = Side::ALL.map(|side| scene.desired_arm(side));
        self.setpoint = Setpoint::standing(&scene.state.world_from_torso, arms);
        if let Some(side) = lifted {
            self.setpoint.lift(side, PointReference::hold(scene.foot(side.leg())));
            self.setpoint.contacts = self.setpoint.row().contacts();
        }
    }

    /// Begins a phase.
    pub fn enter(&mut self, phase: Phase, scene: &Scene<'_>) {
        self.phase = phase;
        self.entered_ns = scene.now_ns;
        self.touching = 0;
        let MotionSettings { fold_s, stand_s, lie_down_s, .. } = self.motions;
        let fold = self.poses.posture(&self.poses.fold_rad);
        let stand = self.poses.posture(&self.poses.stand_rad);
        match phase {
            Phase::Damped => {}
            Phase::StandUp => {
                self.posture = PostureMotion::new(scene.desired, &fold, &stand, fold_s, stand_s);
            }
            Phase::LieDown => {
                self.posture = PostureMotion::new(scene.desired, &fold, &fold, lie_down_s, 0.0);
            }
            Phase::Recentre => {
                self.move_torso(&scene.middle_of_feet(self.poses.stand_height_m));
                self.stow_arms(scene);
            }
            Phase::Stance => self.driving.begin_stance(&self.setpoint),
            Phase::ShiftTorso(effector) => {
                let shift = self.poses.shift(effector.side());
                self.move_torso(&Isometry3::from_parts(shift.into(), UnitQuaternion::identity()));
                self.stow_arms(scene);
            }
            Phase::LiftFoot(effector) => self.begin_lift(effector, scene),
            Phase::SingleFoot(side) => self.driving.begin_foot(side, &mut self.setpoint, scene),
            Phase::SingleGripper(side) => self.driving.begin_gripper(side, &mut self.setpoint, scene),
            Phase::Stow(side) => self.begin_stow(side, scene, &stand),
            Phase::LowerFoot(side) => self.begin_lowering(side, scene),
        }
    }

    fn begin_lift(&mut self, effector: Effector, scene: &Scene<'_>) {
        let side = effector.side();
        self.move_torso(&Isometry3::identity());
        let foot = self.foot_reference(side, scene);
        let rise = (scene.landing(side).z + self.poses.lift_m - foot.position.z).max(0.0);
        let up = foot.position + rise * Vector3::z();
        self.foot = PointMotion::new(&foot, &up, self.motions.lift_s);
        let arm = match effector {
            Effector::Foot(side) => self.poses.stow(side),
            Effector::Gripper(side) => self.poses.ready(side),
        };
        self.move_arm(side, &arm, scene);
    }

    fn begin_stow(&mut self, side: Side, scene: &Scene<'_>, stand: &JointVector) {
        self.move_torso(&Isometry3::identity());
        let foot = self.foot_reference(side, scene);
        let torso = self.setpoint.torso.pose();
        let (hover_m, arm_s) = (self.poses.hover_m, self.motions.arm_s);
        self.leg = LegReturn::new(scene, side, &foot, &torso, stand, hover_m, arm_s);
        self.move_arm(side, &self.poses.stow(side), scene);
    }

    fn begin_lowering(&mut self, side: Side, scene: &Scene<'_>) {
        self.move_torso(&Isometry3::identity());
        let foot = self.foot_reference(side, scene);
        let depth = self.poses.hover_m + self.motions.search_m;
        let deepest = scene.landing(side) - self.motions.search_m * Vector3::z();
        // The motion is fastest, 1.875 times its mean, about where the ground should be.
        self.foot = PointMotion::new(&foot, &deepest, 1.875 * depth / self.motions.lower_m_s);
    }

    /// One step of the phase that is on.
    pub fn step(&mut self, scene: &Scene<'_>, operator: &Operator<'_>) -> Progress {
        let elapsed_s = self.elapsed_s(scene.now_ns);
        let load_step = scene.dt_s / self.motions.load_s;
        self.driving.move_jaws(scene.dt_s);
        match self.phase {
            Phase::Damped => Progress::default(),
            Phase::StandUp => {
                Progress::on_four_feet(elapsed_s > self.posture.duration_s() + self.motions.settle_s)
            }
            Phase::LieDown => Progress::on_four_feet(elapsed_s > self.posture.duration_s()),
            Phase::Recentre => {
                self.play(elapsed_s);
                for leg in Leg::ALL {
                    self.setpoint.load(leg, 1.0, load_step);
                }
                let arms_over = self.arms.iter().all(|motion| elapsed_s >= motion.duration_s());
                Progress::on_four_feet(self.torso.is_over(elapsed_s) && arms_over)
            }
            Phase::Stance => {
                self.driving.step(operator, scene, &mut self.setpoint);
                Progress::on_four_feet(true)
            }
            Phase::ShiftTorso(effector) => {
                self.play(elapsed_s);
                let may_lift = scene.may_lift(effector.side(), self.motions.lift_margin_m);
                Progress::on_four_feet(self.torso.is_over(elapsed_s) && may_lift)
            }
            Phase::LiftFoot(effector) => self.lift(effector, elapsed_s, load_step),
            Phase::SingleFoot(_) | Phase::SingleGripper(_) => {
                self.driving.step(operator, scene, &mut self.setpoint);
                Progress::on_three_feet(true)
            }
            Phase::Stow(side) => {
                let foot = self.leg.sample(scene, elapsed_s, |at_s| self.torso.sample(at_s).pose());
                self.play_lifted(side, elapsed_s, elapsed_s, foot);
                Progress::on_three_feet(elapsed_s >= self.motions.arm_s)
            }
            Phase::LowerFoot(side) => self.lower(side, elapsed_s, load_step, scene),
        }
    }

    /// Unloads the foot, then lifts it and unfolds the arm.
    fn lift(&mut self, effector: Effector, elapsed_s: f64, load_step: f64) -> Progress {
        let MotionSettings { load_s, lift_s, arm_s, .. } = self.motions;
        let (side, leg) = (effector.side(), effector.side().leg());
        if self.setpoint.contacts.contains(leg) {
            self.setpoint.torso = self.torso.sample(elapsed_s);
            self.setpoint.load(leg, 0.0, load_step);
        }
        if self.setpoint.contacts.contains(leg) {
            return Progress::default();
        }
        let lifting_s = elapsed_s - load_s;
        let foot = self.foot.sample(lifting_s);
        self.play_lifted(side, elapsed_s, lifting_s - UNFOLD_AFTER * lift_s, foot);
        let over_s = match effector {
            Effector::Foot(_) => lift_s,
            Effector::Gripper(_) => UNFOLD_AFTER * lift_s + arm_s,
        };
        Progress::on_three_feet(lifting_s >= over_s)
    }

    /// Lowers the foot until it feels the ground, then loads it.
    fn lower(&mut self, side: Side, elapsed_s: f64, load_step: f64, scene: &Scene<'_>) -> Progress {
        let leg = side.leg();
        if self.touching < TOUCH_SAMPLES {
            self.play_lifted(side, elapsed_s, f64::INFINITY, self.foot.sample(elapsed_s));
            let felt = scene.foot_force[leg.index()] > self.motions.touch_n;
            self.touching = if felt { self.touching + 1 } else { 0 };
            let no_ground = elapsed_s >= self.foot.duration_s();
            return Progress { no_ground, ..Progress::on_three_feet(false) };
        }
        self.setpoint.stand();
        self.setpoint.hold_arm(side, PointReference::hold(self.poses.stow(side)));
        self.setpoint.load(leg, 1.0, load_step);
        Progress::on_four_feet(self.setpoint.contacts.share(leg) >= 1.0)
    }

    /// Torso and arms on their motions, four feet on the ground.
    fn play(&mut self, elapsed_s: f64) {
        self.setpoint.torso = self.torso.sample(elapsed_s);
        self.setpoint.stand();
        for side in Side::ALL {
            self.setpoint.hold_arm(side, self.arms[side.index()].sample(elapsed_s));
        }
    }

    /// Torso and arm on their motions, one foot in the air.
    fn play_lifted(&mut self, side: Side, elapsed_s: f64, arm_elapsed_s: f64, foot: PointReference) {
        self.setpoint.torso = self.torso.sample(elapsed_s);
        self.setpoint.lift(side, foot);
        self.setpoint.hold_arm(side, self.arms[side.index()].sample(arm_elapsed_s));
    }

    fn move_torso(&mut self, goal: &Isometry3<f64>) {
        let start = &self.setpoint.torso;
        let distance = (goal.translation.vector - start.point.position).norm();
        let angle = start.rotation.orientation.angle_to(&goal.rotation);
        let MotionSettings { torso_s, torso_m_s, torso_rad_s, .. } = self.motions;
        let duration_s = torso_s.max(distance / torso_m_s).max(angle / torso_rad_s);
        self.torso = PoseMotion::new(start, goal, duration_s);
    }

    fn stow_arms(&mut self, scene: &Scene<'_>) {
        for side in Side::ALL {
            self.move_arm(side, &self.poses.stow(side), scene);
        }
    }

    /// Begins an arm's motion; one that followed its gripper's pose begins at the desired joints.
    fn move_arm(&mut self, side: Side, goal: &Vector3<f64>, scene: &Scene<'_>) {
        let desired = PointReference::hold(scene.desired_arm(side));
        let start = self.setpoint.arm(side).copied().unwrap_or(desired);
        self.arms[side.index()] = PointMotion::new(&start, goal, self.motions.arm_s);
    }

    /// Reference of a foot: its own if it has one, else where the desired joints take it.
    fn foot_reference(&self, side: Side, scene: &Scene<'_>) -> PointReference {
        if let Some(foot) = self.setpoint.foot(side.leg()) {
            return *foot;
        }
        let torso_from_foot = torso_from_frame(scene.model, scene.desired, Frame::Foot(side.leg()));
        PointReference::hold((self.setpoint.torso.pose() * torso_from_foot).translation.vector)
    }
}
