//! Moves the robot through the phases: what each body's reference is, from the instant a phase begins.
//!
//! Every motion begins at the reference as it is and moves (never at a measurement), so that phases may be
//! interrupted by each other without a step.

use nalgebra::{Isometry3, Vector3};

use super::{
    driving::{Driving, Operator},
    foot_path::{Descent, Lift},
    leg_return::LegReturn,
    mode::{Effector, Phase},
    posture_motion::PostureMotion,
    scene::Scene,
    setpoint::Setpoint,
    settings::{MotionSettings, PoseSettings, UprightSettings},
    shift::Shift,
    touch_down::{Felt, TouchDown},
    upright::{Node, Path, Upright},
};
use crate::{
    commander::{Limits, PointMotion, PoseMotion, PoseReference},
    estimator::heading,
    joints::{JointVector, Leg, Side},
    kinematics::{leg_towards, of_leg, torso_from_frame},
    locomotion::LocomotionSettings,
    model::Frame,
    wbc::PointReference,
};

/// Share of the foot's lifting after which its arm unfolds: in the air.
const UNFOLD_AFTER: f64 = 0.4;
/// Time in which a foot takes up its speed towards the ground, s.
const LOWER_RAMP_S: f64 = 0.1;
/// Time in which a foot that goes down comes to above its landing point, s.
const OVER_S: f64 = 0.4;
/// Least duration of an arm's motion, s.
const LEAST_ARM_S: f64 = 0.3;

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

    fn on_two_feet(arrived: bool) -> Self {
        Self { arrived, airborne: true, ..Self::default() }
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
    shift: Shift,
    lift: Lift,
    leg: LegReturn,
    touch_down: TouchDown,
    /// The foot that goes down is on the ground.
    landed: bool,
    /// Since when the foot that lifts is off the ground, s in the phase.
    airborne_s: Option<f64>,
    driving: Driving,
    sitting: UprightSettings,
    /// Since the robot left its four feet to sit up.
    upright: Option<Upright>,
}

impl Choreography {
    /// At rest, damped.
    pub fn new(
        poses: PoseSettings,
        motions: MotionSettings,
        sitting: UprightSettings,
        limits: Limits,
        walking: LocomotionSettings,
    ) -> Self {
        let identity = Isometry3::identity();
        let stand = poses.posture(&poses.stand_rad);
        Self {
            setpoint: Setpoint::standing(&identity, Side::ALL.map(|side| poses.stow(side))),
            posture: PostureMotion::new(&stand, &stand, &stand, 1.0, 1.0),
            torso: PoseMotion::new(&PoseReference::hold(&identity), &identity, 1.0),
            arms: Side::ALL.map(|side| PointMotion::hold(poses.stow(side))),
            shift: Shift::none(),
            lift: Lift::hold(Vector3::zeros()),
            leg: LegReturn::hold(poses.stand_rad),
            touch_down: TouchDown::new(Descent::hold(Vector3::zeros())),
            landed: false,
            airborne_s: None,
            driving: Driving::new(limits, walking, &stand),
            sitting,
            upright: None,
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
        self.upright = None;
        if let Some(side) = lifted {
            self.setpoint.lift(side, PointReference::hold(scene.foot(side.leg())));
            self.setpoint.contacts = self.setpoint.row().contacts();
        }
    }

    /// Begins a phase.
    pub fn enter(&mut self, phase: Phase, scene: &Scene<'_>) {
        self.phase = phase;
        self.entered_ns = scene.now_ns;
        self.landed = false;
        self.airborne_s = None;
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
                self.upright = None;
                self.move_torso(&scene.middle_of_feet(self.poses.stand_height_m));
                self.stow_arms(scene);
            }
            Phase::Stance => self.driving.begin_stance(&self.setpoint, scene),
            Phase::ShiftTorso(effector) => {
                self.shift = Shift::plan(&self.poses, scene, effector);
                let goal = self.shift.torso;
                self.move_torso(&goal);
                self.stow_arms(scene);
            }
            Phase::LiftFoot(effector) => self.begin_lift(effector, scene),
            Phase::SingleFoot(side) => self.driving.begin_foot(side, &mut self.setpoint, scene),
            Phase::SingleGripper(side) => self.driving.begin_gripper(side, &mut self.setpoint, scene),
            Phase::Walk => self.driving.begin_walk(None, &self.setpoint, scene),
            Phase::WalkHolding(arms) => self.driving.begin_walk(Some(arms), &self.setpoint, scene),
            Phase::Unfold(arms) => {
                self.move_torso(&self.setpoint.torso.pose());
                for side in Side::ALL {
                    let posture =
                        if arms.contain(side) { self.poses.carry(side) } else { self.poses.stow(side) };
                    self.move_arm(side, &posture, scene);
                }
            }
            Phase::Halt => self.stow_arms(scene),
            Phase::Gather => {
                if scene.astray(&self.sitting.stance_m) > self.sitting.astray_m {
                    self.driving.begin_gathering(self.sitting.stance_m, &self.setpoint, scene);
                } else {
                    self.driving.begin_stance(&self.setpoint, scene);
                }
            }
            // Half-way down it goes up again along the same path.
            Phase::Kneel if self.upright.is_some() => {}
            Phase::Kneel => {
                let path = Path::plan(&self.poses, &self.sitting, scene);
                self.upright = Some(Upright::begin(path, self.sitting, &self.setpoint));
            }
            Phase::SitUp | Phase::GetUp => {}
            Phase::Bimanual => self.driving.begin_bimanual(&mut self.setpoint, scene),
            Phase::SitDown => {
                if let Some(upright) = &mut self.upright {
                    upright.take_up(&self.motions, scene);
                }
            }
            Phase::Stow(side) => self.begin_stow(side, scene, &stand),
            Phase::LowerFoot(side) => self.begin_lowering(side, scene),
        }
    }

    fn begin_lift(&mut self, effector: Effector, scene: &Scene<'_>) {
        let side = effector.side();
        self.move_torso(&Isometry3::identity());
        let foot = self.foot_reference(side, scene);
        let place = scene.landing(side) + self.poses.lift(effector) * Vector3::z();
        self.lift = Lift::new(&foot, &place, self.motions.lift_s);
        self.move_arm(side, &self.poses.arm(effector), scene);
    }

    fn begin_stow(&mut self, side: Side, scene: &Scene<'_>, stand: &JointVector) {
        self.move_torso(&Isometry3::identity());
        let foot = self.foot_reference(side, scene);
        let torso = self.setpoint.torso.pose();
        self.move_arm(side, &self.poses.stow(side), scene);
        let hover = scene.landing(side) + self.poses.hover_m * Vector3::z();
        let goal = leg_towards(scene.model, stand, side.leg(), &hover);
        let way = (goal - of_leg(scene.desired, side.leg())).amax();
        // Arm and leg take the same time: the arm folds over the ground as the foot comes down to it.
        let MotionSettings { torso_s, leg_rad_s, .. } = self.motions;
        let duration_s = (way / leg_rad_s).max(torso_s).max(self.arms[side.index()].duration_s());
        self.leg = LegReturn::new(scene, side, &foot, &torso, &goal, duration_s);
    }

    fn begin_lowering(&mut self, side: Side, scene: &Scene<'_>) {
        self.move_torso(&Isometry3::identity());
        let foot = self.foot_reference(side, scene);
        let MotionSettings { search_m, lower_m_s, .. } = self.motions;
        let deepest = scene.landing(side) - search_m * Vector3::z();
        let descent = Descent::new(&foot, &deepest, lower_m_s, LOWER_RAMP_S, OVER_S);
        self.touch_down = TouchDown::new(descent);
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
                Progress::on_four_feet(self.torso.is_over(elapsed_s) && self.arms_rest(elapsed_s))
            }
            Phase::Stance => {
                self.driving.step(operator, scene, &mut self.setpoint);
                Progress::on_four_feet(true)
            }
            Phase::Walk | Phase::WalkHolding(_) => {
                self.driving.step(operator, scene, &mut self.setpoint);
                Progress::on_four_feet(true)
            }
            Phase::Unfold(_) => {
                self.play(elapsed_s);
                Progress::on_four_feet(self.torso.is_over(elapsed_s) && self.arms_rest(elapsed_s))
            }
            Phase::Halt => {
                self.driving.halt(scene, &mut self.setpoint);
                for side in Side::ALL {
                    self.setpoint.hold_arm(side, self.arms[side.index()].sample(elapsed_s));
                }
                Progress::on_four_feet(self.driving.is_halted() && self.arms_rest(elapsed_s))
            }
            Phase::Gather => {
                self.driving.halt(scene, &mut self.setpoint);
                Progress::on_four_feet(self.driving.is_halted())
            }
            Phase::Kneel | Phase::SitDown => self.sit(Node::Kneel, scene),
            Phase::SitUp => self.sit(Node::Upright, scene),
            Phase::GetUp => self.sit(Node::Stand, scene),
            Phase::Bimanual => {
                if let Some(upright) = &mut self.upright {
                    upright.hold(scene, &mut self.setpoint);
                }
                self.driving.step(operator, scene, &mut self.setpoint);
                Progress::on_two_feet(true)
            }
            Phase::ShiftTorso(effector) => {
                self.play(elapsed_s);
                let may_lift = self.shift.may_lift(scene, effector, self.motions.lift_margin_m);
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
                Progress::on_three_feet(elapsed_s >= self.leg.duration_s())
            }
            Phase::LowerFoot(side) => self.lower(side, elapsed_s, load_step, scene),
        }
    }

    /// On the way to sitting upright or back.
    fn sit(&mut self, goal: Node, scene: &Scene<'_>) -> Progress {
        let Some(upright) = &mut self.upright else { return Progress::default() };
        Progress::on_two_feet(upright.step(goal, &self.motions, scene, &mut self.setpoint))
    }

    /// Unloads the foot, then lifts it and unfolds the arm.
    fn lift(&mut self, effector: Effector, elapsed_s: f64, load_step: f64) -> Progress {
        let (side, leg) = (effector.side(), effector.side().leg());
        if self.setpoint.contacts.contains(leg) {
            self.setpoint.torso = self.torso.sample(elapsed_s);
            self.setpoint.load(leg, 0.0, load_step);
        }
        if self.setpoint.contacts.contains(leg) {
            return Progress::default();
        }
        let lifting_s = elapsed_s - *self.airborne_s.get_or_insert(elapsed_s);
        let unfolding_s = lifting_s - UNFOLD_AFTER * self.motions.lift_s;
        self.play_lifted(side, elapsed_s, unfolding_s, self.lift.sample(lifting_s));
        let arm_s = self.arms[side.index()].duration_s();
        let over =
            self.torso.is_over(elapsed_s) && lifting_s >= self.lift.duration_s() && unfolding_s >= arm_s;
        Progress::on_three_feet(over)
    }

    /// Lowers the foot until it feels the ground, then loads it.
    fn lower(&mut self, side: Side, elapsed_s: f64, load_step: f64, scene: &Scene<'_>) -> Progress {
        let leg = side.leg();
        if !self.landed {
            let (foot, felt) = self.touch_down.step(scene, leg, self.motions.touch_n);
            self.play_lifted(side, elapsed_s, f64::INFINITY, foot);
            self.landed = felt == Felt::Ground;
            return Progress { no_ground: felt == Felt::NoGround, ..Progress::on_three_feet(false) };
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

    fn arms_rest(&self, elapsed_s: f64) -> bool {
        self.arms.iter().all(|motion| elapsed_s >= motion.duration_s())
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
        let way = (goal - start.position).amax() / std::f64::consts::PI;
        let duration_s = (self.motions.arm_s * way).max(LEAST_ARM_S);
        self.arms[side.index()] = PointMotion::new(&start, goal, duration_s);
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
