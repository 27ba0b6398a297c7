//! Moves the robot through the phases: what each body's reference is, from the instant a phase begins.
//!
//! Every motion begins at the reference as it is and moves (never at a measurement), so that phases may be
//! interrupted by each other without a step.

use nalgebra::{Isometry3, UnitQuaternion, Vector2, Vector3};

use super::{
    mode::Phase,
    setpoint::{ArmGoal, Setpoint},
    settings::{MotionSettings, PoseSettings},
};
use crate::{
    commander::{
        Command, DrivenBody, Grip, Limits, PointMotion, PoseMotion, PoseReference, RateLimits, Reach,
        SampleClock, from_above, push_inside,
    },
    dynamics::State,
    estimator::heading,
    joints::{JointVector, Leg, Side},
    kinematics::{leg_towards, torso_from_frame},
    model::{Frame, Model},
    wbc::PointReference,
};

/// What the motions look at.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// The robot.
    pub model: &'a Model,
    /// Where it is, by the estimator.
    pub state: &'a State,
    /// Joint positions asked for in the last step.
    pub desired: &'a JointVector,
    /// Centre of mass in the world.
    pub com: Vector3<f64>,
    /// Vertical forces of the feet, N.
    pub foot_force: [f64; 4],
    /// Now.
    pub now_ns: u64,
    /// Since the last step, s.
    pub dt_s: f64,
}

impl Scene<'_> {
    fn foot(&self, leg: Leg) -> Vector3<f64> {
        let torso_from_foot = torso_from_frame(self.model, &self.state.position, Frame::Foot(leg));
        (self.state.world_from_torso * torso_from_foot).translation.vector
    }

    fn desired_arm(&self, side: Side) -> Vector3<f64> {
        self.desired.fixed_rows::<3>(side.first_arm_joint()).into_owned()
    }
}

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

/// The motions of the phase that is on.
#[derive(Debug, Clone)]
pub struct Choreography {
    poses: PoseSettings,
    motions: MotionSettings,
    limits: Limits,
    phase: Phase,
    entered_ns: u64,
    setpoint: Setpoint,
    posture: PostureMotion,
    torso_motion: PoseMotion,
    arm_motions: [PointMotion; 2],
    foot_motion: PointMotion,
    leg_motion: PointMotion,
    torso: DrivenBody,
    gripper: DrivenBody,
    gripper_start: Vector3<f64>,
    reach: Reach,
    opening: [f64; 2],
    opening_goal: [f64; 2],
    touched_ns: Option<u64>,
    touching: u32,
}

/// Samples in a row that must feel the ground.
const TOUCH_SAMPLES: u32 = 4;

/// Joints on their way to one posture, and from there to another.
#[derive(Debug, Clone, Copy)]
struct PostureMotion {
    /// Legs, then arms.
    first: [PointMotion; 6],
    second: [PointMotion; 6],
}

impl PostureMotion {
    fn new(from: &JointVector, via: &JointVector, to: &JointVector, first_s: f64, second_s: f64) -> Self {
        let stage = |from: &JointVector, to: &JointVector, duration_s: f64| {
            std::array::from_fn(|limb| {
                let start = PointReference::hold(from.fixed_rows::<3>(3 * limb).into_owned());
                PointMotion::new(&start, &to.fixed_rows::<3>(3 * limb).into_owned(), duration_s)
            })
        };
        Self { first: stage(from, via, first_s), second: stage(via, to, second_s) }
    }

    fn duration_s(&self) -> f64 {
        self.first[0].duration_s() + self.second[0].duration_s()
    }

    fn sample(&self, elapsed_s: f64) -> (JointVector, JointVector) {
        let first_s = self.first[0].duration_s();
        let (stage, at_s) =
            if elapsed_s < first_s { (&self.first, elapsed_s) } else { (&self.second, elapsed_s - first_s) };
        let (mut position, mut velocity) = (JointVector::zeros(), JointVector::zeros());
        for (limb, motion) in stage.iter().enumerate() {
            let sample = motion.sample(at_s);
            position.fixed_rows_mut::<3>(3 * limb).copy_from(&sample.position);
            velocity.fixed_rows_mut::<3>(3 * limb).copy_from(&sample.velocity);
        }
        (position, velocity)
    }
}

impl Choreography {
    /// At rest, damped.
    pub fn new(poses: PoseSettings, motions: MotionSettings, limits: Limits) -> Self {
        let identity = Isometry3::identity();
        let still = PoseReference::hold(&identity);
        let stand = poses.posture(&poses.stand_rad);
        Self {
            setpoint: Setpoint::standing(&identity, Side::ALL.map(|side| poses.stow(side))),
            posture: PostureMotion::new(&stand, &stand, &stand, 1.0, 1.0),
            torso_motion: PoseMotion::new(&still, &identity, 1.0),
            arm_motions: Side::ALL.map(|side| PointMotion::hold(poses.stow(side))),
            foot_motion: PointMotion::hold(Vector3::zeros()),
            leg_motion: PointMotion::hold(poses.stand_rad),
            torso: DrivenBody::new(still, limits.follower_rad_s, limits.stance_torso_rate),
            gripper: DrivenBody::new(still, limits.follower_rad_s, limits.gripper_rate),
            gripper_start: Vector3::zeros(),
            reach: Reach::new(Side::Right, &stand, limits.reach),
            opening: [0.0; 2],
            opening_goal: [0.0; 2],
            touched_ns: None,
            touching: 0,
            phase: Phase::Damped,
            entered_ns: 0,
            poses,
            motions,
            limits,
        }
    }

    /// References of a phase in which the whole-body controller works.
    pub fn setpoint(&self) -> &Setpoint {
        &self.setpoint
    }

    /// Openings asked of the grippers right, left.
    pub fn opening(&self) -> [f64; 2] {
        self.opening
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

    /// Takes up a robot as it is found, on the feet of `standing`: references where the bodies are.
    pub fn take_up(&mut self, scene: &Scene<'_>, lifted: Option<Side>) {
        let arms = Side::ALL.map(|side| scene.desired_arm(side));
        self.setpoint = Setpoint::standing(&scene.state.world_from_torso, arms);
        if let Some(side) = lifted {
            let posture = PointReference::hold(scene.desired_arm(side));
            let foot = PointReference::hold(scene.foot(side.leg()));
            self.setpoint.arms[side.index()] = ArmGoal::PostureAndFoot(posture, foot);
            self.setpoint.contacts = self.setpoint.contacts.with_share(side.leg(), 0.0);
        }
    }

    /// Begins a phase.
    pub fn enter(&mut self, phase: Phase, scene: &Scene<'_>) {
        self.phase = phase;
        self.entered_ns = scene.now_ns;
        self.touched_ns = None;
        self.touching = 0;
        match phase {
            Phase::Damped => {}
            Phase::StandUp => {
                let fold = self.poses.posture(&self.poses.fold_rad);
                let stand = self.poses.posture(&self.poses.stand_rad);
                let MotionSettings { fold_s, stand_s, .. } = self.motions;
                self.posture = PostureMotion::new(scene.desired, &fold, &stand, fold_s, stand_s);
            }
            Phase::LieDown => {
                let fold = self.poses.posture(&self.poses.fold_rad);
                let lie_down_s = self.motions.lie_down_s;
                self.posture = PostureMotion::new(scene.desired, &fold, &fold, lie_down_s, 0.2);
            }
            Phase::Recentre => {
                self.move_torso(&self.middle_of_feet(scene));
                for side in Side::ALL {
                    self.move_arm(side, &self.poses.stow(side), self.motions.arm_s);
                }
            }
            Phase::Stance => self.drive_torso(self.limits.stance_torso_rate),
            Phase::ShiftTorso(side) => {
                self.move_torso(&Isometry3::from_parts(
                    self.poses.shift(side).into(),
                    UnitQuaternion::identity(),
                ));
            }
            Phase::LiftFoot(side) => {
                self.move_torso(&Isometry3::identity());
                self.begin_arm(side, scene);
                let foot = self.foot_reference(side, scene);
                let up = foot.position + Vector3::z() * self.rise(&foot, side, scene);
                self.foot_motion = PointMotion::new(&foot, &up, self.motions.lift_s);
                let ready = self.poses.ready(side);
                self.move_arm(side, &ready, self.motions.arm_s);
            }
            Phase::SingleGripper(side) => {
                self.drive_torso(self.limits.gripper_torso_rate);
                self.drive_gripper(side, scene);
            }
            Phase::Stow(side) => {
                self.move_torso(&Isometry3::identity());
                self.begin_arm(side, scene);
                let foot = self.foot_reference(side, scene);
                self.begin_leg(side, &foot, scene);
                self.move_arm(side, &self.poses.stow(side), self.motions.arm_s);
            }
            Phase::LowerFoot(side) => {
                self.move_torso(&Isometry3::identity());
                let foot = self.foot_reference(side, scene);
                let depth = self.poses.hover_m + self.motions.search_m;
                let deepest = landing(side, scene) - Vector3::z() * self.motions.search_m;
                self.foot_motion = PointMotion::new(&foot, &deepest, 1.5 * depth / self.motions.lower_m_s);
            }
        }
    }

    /// One step of the phase that is on. `command` is the operator's, with what it means for the targets.
    pub fn step(
        &mut self,
        scene: &Scene<'_>,
        command: Option<(&Command, Grip)>,
        fresh: bool,
        clock: &SampleClock,
    ) -> Progress {
        let elapsed_s = self.elapsed_s(scene.now_ns);
        let load_step = scene.dt_s / self.motions.load_s;
        self.move_jaws(scene.dt_s);
        match self.phase {
            Phase::Damped => Progress::default(),
            Phase::StandUp => arrived(elapsed_s > self.posture.duration_s() + self.motions.settle_s),
            Phase::LieDown => arrived(elapsed_s > self.posture.duration_s()),
            Phase::Recentre => {
                self.play(elapsed_s);
                self.ground_all(load_step);
                let arms_over = self.arm_motions.iter().all(|motion| elapsed_s >= motion.duration_s());
                arrived(self.torso_motion.is_over(elapsed_s) && arms_over)
            }
            Phase::Stance => {
                self.drive(None, scene, command, fresh, clock);
                arrived(true)
            }
            Phase::ShiftTorso(side) => {
                self.play(elapsed_s);
                arrived(self.torso_motion.is_over(elapsed_s) && self.may_lift(side, scene))
            }
            Phase::LiftFoot(side) => self.lift(side, elapsed_s, load_step),
            Phase::SingleGripper(side) => {
                self.drive(Some(side), scene, command, fresh, clock);
                Progress { arrived: true, airborne: true, no_ground: false }
            }
            Phase::Stow(side) => {
                self.play_lifted(side, elapsed_s, elapsed_s);
                self.fold_leg(side, elapsed_s, scene);
                Progress { arrived: elapsed_s >= self.motions.arm_s, airborne: true, no_ground: false }
            }
            Phase::LowerFoot(side) => self.lower(side, elapsed_s, load_step, scene),
        }
    }

    /// Unloads the foot, then lifts it and unfolds the arm.
    fn lift(&mut self, side: Side, elapsed_s: f64, load_step: f64) -> Progress {
        let leg = side.leg();
        if self.setpoint.contacts.contains(leg) {
            self.setpoint.load(leg, 0.0, load_step);
            self.setpoint.torso = self.torso_motion.sample(elapsed_s);
        }
        let airborne = !self.setpoint.contacts.contains(leg);
        if airborne {
            let lifting_s = elapsed_s - self.motions.load_s;
            // The foot leads, so that the arm unfolds in the air.
            self.play_lifted(side, lifting_s, lifting_s - 0.4 * self.motions.lift_s);
        }
        let duration_s = self.motions.load_s + 0.4 * self.motions.lift_s + self.motions.arm_s;
        Progress { arrived: airborne && elapsed_s >= duration_s, airborne, no_ground: false }
    }

    /// Lowers the foot until it feels the ground, then loads it.
    fn lower(&mut self, side: Side, elapsed_s: f64, load_step: f64, scene: &Scene<'_>) -> Progress {
        let leg = side.leg();
        if self.touched_ns.is_none() {
            self.play_lifted(side, elapsed_s, elapsed_s);
            let felt = scene.foot_force[leg.index()] > self.motions.touch_n;
            self.touching = if felt { self.touching + 1 } else { 0 };
            if self.touching >= TOUCH_SAMPLES {
                self.touched_ns = Some(scene.now_ns);
                let posture = PointReference::hold(self.poses.stow(side));
                self.setpoint.arms[side.index()] = ArmGoal::Posture(posture);
            }
        }
        if self.touched_ns.is_some() {
            self.setpoint.load(leg, 1.0, load_step);
        }
        let share = self.setpoint.contacts.share(leg);
        let searched = self.touched_ns.is_none() && elapsed_s >= self.foot_motion.duration_s();
        Progress { arrived: share >= 1.0, airborne: share <= 0.0, no_ground: searched }
    }

    /// Torso and arms on their motions, four feet on the ground.
    fn play(&mut self, elapsed_s: f64) {
        self.setpoint.torso = self.torso_motion.sample(elapsed_s);
        for side in Side::ALL {
            self.setpoint.arms[side.index()] =
                ArmGoal::Posture(self.arm_motions[side.index()].sample(elapsed_s));
        }
    }

    /// Torso, foot and arm on their motions, one foot in the air.
    fn play_lifted(&mut self, side: Side, elapsed_s: f64, arm_elapsed_s: f64) {
        self.setpoint.torso = self.torso_motion.sample(elapsed_s);
        let posture = self.arm_motions[side.index()].sample(arm_elapsed_s);
        let foot = self.foot_motion.sample(elapsed_s);
        self.setpoint.arms[side.index()] = ArmGoal::PostureAndFoot(posture, foot);
    }

    fn ground_all(&mut self, load_step: f64) {
        for leg in Leg::ALL {
            self.setpoint.load(leg, 1.0, load_step);
        }
    }

    /// Torso, and a gripper, as the operator moves them.
    fn drive(
        &mut self,
        side: Option<Side>,
        scene: &Scene<'_>,
        command: Option<(&Command, Grip)>,
        fresh: bool,
        clock: &SampleClock,
    ) {
        match command {
            Some((_, Grip::Frozen)) => {}
            Some((command, grip @ (Grip::Begins | Grip::Resumes | Grip::Holds))) => {
                match grip {
                    Grip::Begins => {
                        self.torso.engage();
                        self.gripper.engage();
                    }
                    Grip::Resumes => {
                        self.torso.release();
                        self.gripper.release();
                    }
                    _ => {}
                }
                if fresh || grip != Grip::Holds {
                    self.torso.displace(command.torso.as_ref(), clock, scene.now_ns);
                    if let Some(side) = side {
                        let palm = command.palms[side.index()].as_ref();
                        self.gripper.displace(palm, clock, scene.now_ns);
                        if let Some(opening) = command.opening[side.index()] {
                            self.opening_goal[side.index()] = opening;
                        }
                    }
                }
            }
            None | Some((_, Grip::Released)) => {
                self.torso.release();
                self.gripper.release();
            }
        }
        let range = if side.is_some() { self.limits.gripper_torso } else { self.limits.stance_torso };
        let margin_m = self.limits.support_margin_m;
        let (feet, count) = self.standing_feet(scene);
        let com_from_torso = from_above(&(scene.com - scene.state.world_from_torso.translation.vector));
        self.torso.advance(scene.now_ns, scene.dt_s, |wanted| {
            let mut pose = range.clamp(wanted);
            let com = from_above(&pose.translation.vector) + com_from_torso;
            let push = push_inside(&com, &feet[..count], margin_m);
            pose.translation.vector += Vector3::new(push.x, push.y, 0.0);
            pose
        });
        self.setpoint.torso = *self.torso.reference();
        if let Some(side) = side {
            let outward = if side == Side::Left { 1.0 } else { -1.0 };
            let (limits, start) = (self.limits.gripper, self.gripper_start);
            let lowest = self.lowest_gripper(side, scene);
            let (reach, world_from_torso) = (&mut self.reach, self.setpoint.torso.pose());
            self.gripper.advance(scene.now_ns, scene.dt_s, |wanted| {
                let mut position = limits.clamp(&wanted.translation.vector, &start, outward);
                position.z = position.z.max(lowest);
                let inside = Isometry3::from_parts(position.into(), wanted.rotation);
                world_from_torso * reach.nearest(scene.model, &world_from_torso.inv_mul(&inside))
            });
            self.setpoint.arms[side.index()] = ArmGoal::Gripper(*self.gripper.reference());
        }
    }

    /// Begins the way of a lifted leg to above its landing point, in the space of its joints: on a straight
    /// line in the world, a leg that an operator has led far around would meet the ends of its ranges.
    fn begin_leg(&mut self, side: Side, foot: &PointReference, scene: &Scene<'_>) {
        let leg = side.leg();
        let joints = |vector: &JointVector| vector.fixed_rows::<3>(leg.first_joint()).into_owned();
        let hover = landing(side, scene) + Vector3::z() * self.poses.hover_m;
        // The torso arrives at the world's origin together with the foot.
        let stand = self.poses.posture(&self.poses.stand_rad);
        let goal = leg_towards(scene.model, &stand, leg, &hover);
        let start = PointReference::hold(joints(scene.desired));
        self.leg_motion = PointMotion::new(&start, &goal, self.motions.arm_s);
        // What the reference is off the desired joints' place fades out on the way.
        let torso_from_foot = torso_from_frame(scene.model, scene.desired, Frame::Foot(leg));
        let offset = foot.position - (self.setpoint.torso.pose() * torso_from_foot).translation.vector;
        let start = PointReference { position: offset, ..PointReference::hold(offset) };
        self.foot_motion = PointMotion::new(&start, &Vector3::zeros(), self.motions.arm_s);
    }

    /// The foot's reference while its leg folds.
    fn fold_leg(&mut self, side: Side, elapsed_s: f64, scene: &Scene<'_>) {
        let leg = side.leg();
        let place = |at_s: f64| {
            let mut joints = *scene.desired;
            joints.fixed_rows_mut::<3>(leg.first_joint()).copy_from(&self.leg_motion.sample(at_s).position);
            let torso = self.torso_motion.sample(at_s).pose();
            let foot = torso * torso_from_frame(scene.model, &joints, Frame::Foot(leg));
            foot.translation.vector + self.foot_motion.sample(at_s).position
        };
        /// Half the interval of the central differences, s.
        const STEP_S: f64 = 1e-3;
        let (before, now, after) =
            (place((elapsed_s - STEP_S).max(0.0)), place(elapsed_s), place(elapsed_s + STEP_S));
        let foot = PointReference {
            position: now,
            velocity: (after - before) / (2.0 * STEP_S),
            acceleration: (after - 2.0 * now + before) / (STEP_S * STEP_S),
        };
        let posture = self.arm_motions[side.index()].sample(elapsed_s);
        self.setpoint.arms[side.index()] = ArmGoal::PostureAndFoot(posture, foot);
    }

    /// Lowest height of a gripper's target at which neither it nor the foot behind it touches the ground.
    ///
    /// Leg and arm have just six joints, so gripper and foot rise and fall together: what room both have left
    /// now is what the gripper may go down from here.
    fn lowest_gripper(&self, side: Side, scene: &Scene<'_>) -> f64 {
        let in_world = |frame| {
            let torso_from_frame = torso_from_frame(scene.model, scene.desired, frame);
            (self.setpoint.torso.pose() * torso_from_frame).translation.z
        };
        let (mut ground, mut count) = (0.0, 0.0);
        for leg in self.setpoint.contacts.legs() {
            ground += scene.foot(leg).z;
            count += 1.0;
        }
        if count == 0.0 {
            return f64::NEG_INFINITY;
        }
        // Of the centres of feet that stand: a foot at this height touches the ground.
        let ground = ground / count;
        let gripper = in_world(Frame::Gripper(side));
        let foot_room = in_world(Frame::Foot(side.leg())) - ground - self.limits.foot_clearance_m;
        let gripper_room = gripper - ground - self.limits.gripper_clearance_m;
        gripper - foot_room.min(gripper_room)
    }

    fn standing_feet(&self, scene: &Scene<'_>) -> ([Vector2<f64>; 4], usize) {
        let (mut feet, mut count) = ([Vector2::zeros(); 4], 0);
        for leg in self.setpoint.contacts.legs() {
            feet[count] = from_above(&scene.foot(leg));
            count += 1;
        }
        (feet, count)
    }

    /// Whether the centre of mass is well inside the other three feet.
    fn may_lift(&self, side: Side, scene: &Scene<'_>) -> bool {
        let mut others =
            Leg::ALL.into_iter().filter(|leg| *leg != side.leg()).map(|leg| from_above(&scene.foot(leg)));
        let feet: [Vector2<f64>; 3] = std::array::from_fn(|_| others.next().unwrap_or_default());
        push_inside(&from_above(&scene.com), &feet, self.motions.lift_margin_m) == Vector2::zeros()
    }

    fn drive_torso(&mut self, rate: RateLimits) {
        self.torso = DrivenBody::new(self.setpoint.torso, self.limits.follower_rad_s, rate);
    }

    fn drive_gripper(&mut self, side: Side, scene: &Scene<'_>) {
        let torso_from_gripper = torso_from_frame(scene.model, scene.desired, Frame::Gripper(side));
        let pose = self.setpoint.torso.pose() * torso_from_gripper;
        let rate = self.limits.gripper_rate;
        self.gripper = DrivenBody::new(PoseReference::hold(&pose), self.limits.follower_rad_s, rate);
        self.gripper_start = pose.translation.vector;
        self.reach = Reach::new(side, scene.desired, self.limits.reach);
        self.setpoint.arms[side.index()] = ArmGoal::Gripper(PoseReference::hold(&pose));
    }

    fn move_torso(&mut self, goal: &Isometry3<f64>) {
        let start = &self.setpoint.torso;
        let distance = (goal.translation.vector - start.point.position).norm();
        let angle = start.rotation.orientation.angle_to(&goal.rotation);
        let MotionSettings { torso_s, torso_m_s, torso_rad_s, .. } = self.motions;
        let duration_s = torso_s.max(distance / torso_m_s).max(angle / torso_rad_s);
        self.torso_motion = PoseMotion::new(start, goal, duration_s);
    }

    fn move_arm(&mut self, side: Side, goal: &Vector3<f64>, duration_s: f64) {
        let start = match self.setpoint.arms[side.index()] {
            ArmGoal::Posture(posture) | ArmGoal::PostureAndFoot(posture, _) => posture,
            // Never: `begin_arm` has given a posture to an arm that had a gripper's pose.
            ArmGoal::Gripper(_) => PointReference::hold(*goal),
        };
        self.arm_motions[side.index()] = PointMotion::new(&start, goal, duration_s);
    }

    /// Turns an arm that follows its gripper's pose into one that follows joint angles.
    fn begin_arm(&mut self, side: Side, scene: &Scene<'_>) {
        if let ArmGoal::Gripper(_) = self.setpoint.arms[side.index()] {
            let foot = self.foot_reference(side, scene);
            let posture = PointReference::hold(scene.desired_arm(side));
            self.setpoint.arms[side.index()] = ArmGoal::PostureAndFoot(posture, foot);
        }
    }

    /// Reference of a foot: its own if it has one, else where the desired joints take it.
    fn foot_reference(&self, side: Side, scene: &Scene<'_>) -> PointReference {
        if let ArmGoal::PostureAndFoot(_, foot) = self.setpoint.arms[side.index()] {
            return foot;
        }
        let torso_from_foot = torso_from_frame(scene.model, scene.desired, Frame::Foot(side.leg()));
        PointReference::hold((self.setpoint.torso.pose() * torso_from_foot).translation.vector)
    }

    /// How far a foot has to rise.
    fn rise(&self, foot: &PointReference, side: Side, scene: &Scene<'_>) -> f64 {
        (landing(side, scene).z + self.poses.lift_m - foot.position.z).max(0.0)
    }

    /// Level over the middle of the feet, facing where they face.
    fn middle_of_feet(&self, scene: &Scene<'_>) -> Isometry3<f64> {
        let feet = Leg::ALL.map(|leg| scene.foot(leg));
        let middle = feet.iter().sum::<Vector3<f64>>() / 4.0;
        let [front_right, front_left, rear_right, rear_left] = feet;
        let forward = front_right + front_left - rear_right - rear_left;
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), forward.y.atan2(forward.x));
        Isometry3::from_parts((middle + Vector3::z() * self.poses.stand_height_m).into(), yaw)
    }

    fn move_jaws(&mut self, dt_s: f64) {
        let step = self.limits.opening_per_s * dt_s;
        for (opening, goal) in self.opening.iter_mut().zip(self.opening_goal) {
            *opening += (goal - *opening).clamp(-step, step);
        }
    }
}

/// Where a front foot completes the parallelogram of the other three (the paper's switcher).
fn landing(side: Side, scene: &Scene<'_>) -> Vector3<f64> {
    let (other, rear_same, rear_other) = match side {
        Side::Right => (Leg::FrontLeft, Leg::RearRight, Leg::RearLeft),
        Side::Left => (Leg::FrontRight, Leg::RearLeft, Leg::RearRight),
    };
    scene.foot(other) + scene.foot(rear_same) - scene.foot(rear_other)
}

fn arrived(arrived: bool) -> Progress {
    Progress { arrived, ..Progress::default() }
}
