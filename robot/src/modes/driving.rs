//! Torso, foot or gripper, and jaws as the operator moves them, inside every limit.

use nalgebra::{Isometry3, UnitQuaternion, Vector2, Vector3};

use super::{
    bimanual::Bimanual,
    mode::{Arms, Effector},
    scene::Scene,
    setpoint::Setpoint,
    walking::Walking,
};
use crate::{
    collision::Ground,
    commander::{
        Command, DrivenBody, FootReach, Footing, Grip, Limits, PoseReference, RateLimits, Reach, SampleClock,
        TorsoReach, from_above, rebased_point,
    },
    joints::{JointVector, Side},
    kinematics::torso_from_frame,
    locomotion::{LocomotionSettings, Velocity},
    model::{FOOT_RADIUS_M, Frame},
    trajectory::{Player, Sample},
    wbc::RotationReference,
};

/// Cut-off of the low-pass filter of the centre of mass, rad/s. [E] 3 Hz: a limb at 0.5 m/s moves it by 0.06 m/s,
/// so that it is late by 3 mm, and of the encoders' noise nothing is left.
const COM_CUTOFF_RAD_S: f64 = 19.0;

/// What comes from the operator in one control step.
#[derive(Debug, Clone, Copy)]
pub struct Operator<'a> {
    /// The latest command, and what it means for the targets.
    pub command: Option<(&'a Command, Grip)>,
    /// The command is one that has not been seen before.
    pub fresh: bool,
    /// How often commands come.
    pub clock: &'a SampleClock,
}

/// The bodies that the operator moves.
#[derive(Debug, Clone)]
pub struct Driving {
    limits: Limits,
    torso: DrivenBody,
    torso_reach: TorsoReach,
    /// From the torso's origin to the robot's centre of mass, seen from above, along the world's axes, m.
    com_from_torso: Option<Vector2<f64>>,
    /// The end effector in manipulation; on four feet there is none.
    effector: Option<Effector>,
    /// Its pose; of a foot, the position.
    limb: DrivenBody,
    limb_start: Vector3<f64>,
    gripper_reach: Reach,
    foot_reach: FootReach,
    /// What moves torso and end effector in place of the operator's displacements.
    player: Option<Player>,
    locomotion: LocomotionSettings,
    /// While the robot walks; the torso then is its posture about the course.
    walking: Option<Walking>,
    /// While the robot sits upright.
    bimanual: Option<Bimanual>,
    opening: [f64; 2],
    opening_goal: [f64; 2],
}

impl Driving {
    /// At rest.
    pub fn new(limits: Limits, locomotion: LocomotionSettings, posture: &JointVector) -> Self {
        let still = PoseReference::hold(&Isometry3::identity());
        Self {
            torso: DrivenBody::new(still, limits.follower_rad_s, limits.stance_torso_rate),
            torso_reach: TorsoReach::new(&Isometry3::identity(), posture),
            com_from_torso: None,
            effector: None,
            limb: DrivenBody::new(still, limits.follower_rad_s, limits.gripper_rate),
            limb_start: Vector3::zeros(),
            gripper_reach: Reach::new(Side::Right, posture, limits.reach),
            foot_reach: FootReach::new(Side::Right.leg(), posture, limits.reach),
            player: None,
            locomotion,
            walking: None,
            bimanual: None,
            opening: [0.0; 2],
            opening_goal: [0.0; 2],
            limits,
        }
    }

    /// Openings asked of the grippers right, left.
    pub fn opening(&self) -> [f64; 2] {
        self.opening
    }

    /// Takes over the torso on four feet.
    pub fn begin_stance(&mut self, setpoint: &Setpoint, scene: &Scene<'_>) {
        self.effector = None;
        self.begin_torso(setpoint, self.limits.stance_torso_rate, scene);
    }

    /// Takes over a robot that stands, to walk.
    pub fn begin_walk(&mut self, arms: Option<Arms>, setpoint: &Setpoint, scene: &Scene<'_>) {
        let walking = Walking::begin(&self.locomotion, &self.limits, arms, setpoint, scene);
        self.begin_walking(walking, setpoint);
    }

    /// Takes over a robot that stands, to step its feet to these places about its middle, forward and aside, m, and halt.
    pub fn begin_gathering(&mut self, stance_m: Vector2<f64>, setpoint: &Setpoint, scene: &Scene<'_>) {
        let settings = self.locomotion.standing_at(stance_m);
        let mut walking = Walking::begin(&settings, &self.limits, None, setpoint, scene);
        walking.step_into_place();
        self.begin_walking(walking, setpoint);
    }

    fn begin_walking(&mut self, walking: Walking, setpoint: &Setpoint) {
        self.effector = None;
        self.bimanual = None;
        let posture = walking.posture_of(&setpoint.torso);
        self.torso = DrivenBody::new(posture, self.limits.follower_rad_s, self.limits.stance_torso_rate);
        self.walking = Some(walking);
    }

    /// Takes over the grippers of a robot that sits upright.
    pub fn begin_bimanual(&mut self, setpoint: &mut Setpoint, scene: &Scene<'_>) {
        self.effector = None;
        self.walking = None;
        self.bimanual = Some(Bimanual::begin(&self.limits, setpoint, scene));
    }

    /// Whether a robot that walked stands on four feet again.
    pub fn is_halted(&self) -> bool {
        self.walking.as_ref().is_none_or(Walking::is_halted)
    }

    /// One step of a robot that comes to a halt; nothing for one that stands.
    pub fn halt(&mut self, scene: &Scene<'_>, setpoint: &mut Setpoint) {
        if self.walking.is_none() {
            return;
        }
        self.release();
        self.walk(None, scene, setpoint);
    }

    /// Takes over torso and foot, as its reference moves.
    pub fn begin_foot(&mut self, side: Side, setpoint: &mut Setpoint, scene: &Scene<'_>) {
        self.effector = Some(Effector::Foot(side));
        self.begin_torso(setpoint, self.limits.gripper_torso_rate, scene);
        let torso_from_foot = torso_from_frame(scene.model, scene.desired, Frame::Foot(side.leg()));
        let mut foot = PoseReference::hold(&(setpoint.torso.pose() * torso_from_foot));
        foot.point = setpoint.foot(side.leg()).copied().unwrap_or(foot.point);
        self.begin_limb(foot);
        self.foot_reach = FootReach::new(side.leg(), scene.desired, self.limits.reach);
        setpoint.lift(side, foot.point);
    }

    /// Takes over torso and gripper; the gripper begins where the desired joints hold it.
    pub fn begin_gripper(&mut self, side: Side, setpoint: &mut Setpoint, scene: &Scene<'_>) {
        self.effector = Some(Effector::Gripper(side));
        self.begin_torso(setpoint, self.limits.gripper_torso_rate, scene);
        let torso_from_gripper = torso_from_frame(scene.model, scene.desired, Frame::Gripper(side));
        let gripper = PoseReference::hold(&(setpoint.torso.pose() * torso_from_gripper));
        self.begin_limb(gripper);
        self.gripper_reach = Reach::new(side, scene.desired, self.limits.reach);
        setpoint.grasp(side, gripper);
    }

    fn begin_limb(&mut self, reference: PoseReference) {
        self.limb = DrivenBody::new(reference, self.limits.follower_rad_s, self.limits.gripper_rate);
        self.limb_start = reference.point.position;
    }

    fn begin_torso(&mut self, setpoint: &Setpoint, rate: RateLimits, scene: &Scene<'_>) {
        self.walking = None;
        self.bimanual = None;
        self.torso_reach = TorsoReach::new(&setpoint.torso.pose(), scene.desired);
        self.torso = DrivenBody::new(setpoint.torso, self.limits.follower_rad_s, rate);
        self.com_from_torso = None;
    }

    /// One step of torso and end effector.
    pub fn step(&mut self, operator: &Operator<'_>, scene: &Scene<'_>, setpoint: &mut Setpoint) {
        self.listen(operator, scene);
        let played = self.player.as_ref().map(Player::sample);
        if self.walking.is_some() {
            return self.walk(played.as_ref(), scene, setpoint);
        }
        if let Some(bimanual) = &mut self.bimanual {
            bimanual.step(played.as_ref(), scene, setpoint);
            if let Some(sample) = &played {
                self.open(&Side::ALL, &sample.opening);
            }
            return;
        }
        self.move_torso(played.as_ref(), scene, setpoint);
        match self.effector {
            None => {}
            Some(Effector::Foot(side)) => self.move_foot(side, played.as_ref(), scene, setpoint),
            Some(Effector::Gripper(side)) => self.move_gripper(side, played.as_ref(), scene, setpoint),
        }
    }

    /// Moves the jaws towards their goals; in every phase.
    pub fn move_jaws(&mut self, dt_s: f64) {
        let step = self.limits.opening_per_s * dt_s;
        for (opening, goal) in self.opening.iter_mut().zip(self.opening_goal) {
            *opening += (goal - *opening).clamp(-step, step);
        }
    }

    fn listen(&mut self, operator: &Operator<'_>, scene: &Scene<'_>) {
        let Some((command, grip)) = operator.command else { return self.release() };
        if let Some(walking) = &mut self.walking {
            walking.head(match grip {
                Grip::Begins | Grip::Holds => self.limits.walking.velocity(command),
                Grip::Frozen | Grip::Released | Grip::Resumes => Velocity::default(),
            });
        }
        self.gripper_reach.pause(grip == Grip::Frozen);
        self.bimanual.iter_mut().for_each(|bimanual| bimanual.pause(grip == Grip::Frozen));
        if let Some(player) = &mut self.player {
            player.advance(grip == Grip::Holds, scene.dt_s);
        }
        match grip {
            Grip::Frozen => return,
            Grip::Released => return self.release(),
            Grip::Begins => {
                self.torso.engage();
                self.limb.engage();
                self.walking.iter_mut().for_each(Walking::engage);
                self.bimanual.iter_mut().for_each(Bimanual::engage);
                self.player = command.trajectory.as_ref().map(Player::new);
            }
            Grip::Resumes => self.release(),
            Grip::Holds if !operator.fresh => return,
            Grip::Holds => {}
        }
        if command.trajectory.is_some() {
            // Played from the beginning of its engagement or not at all: never from half-way.
            return;
        }
        self.torso.displace(command.torso.as_ref(), operator.clock, scene.now_ns);
        if let Some(walking) = &mut self.walking {
            walking.displace(command, operator.clock, scene.now_ns);
            self.open(&Side::ALL, &command.opening);
        }
        if let Some(bimanual) = &mut self.bimanual {
            bimanual.displace(command, operator.clock, scene.now_ns);
            self.open(&Side::ALL, &command.opening);
        }
        match self.effector {
            None => {}
            Some(Effector::Foot(side)) => {
                let palm = command.palms[side.index()].map(|palm| Isometry3::from(palm.translation));
                self.limb.displace(palm.as_ref(), operator.clock, scene.now_ns);
            }
            Some(Effector::Gripper(side)) => {
                self.limb.displace(command.palms[side.index()].as_ref(), operator.clock, scene.now_ns);
                self.open(&[side], &command.opening);
            }
        }
    }

    /// What is asked of the jaws of these sides.
    fn open(&mut self, sides: &[Side], opening: &[Option<f64>; 2]) {
        for place in sides.iter().map(|side| side.index()) {
            self.opening_goal[place] = opening[place].unwrap_or(self.opening_goal[place]);
        }
    }

    fn release(&mut self) {
        self.torso.release();
        self.limb.release();
        self.walking.iter_mut().for_each(Walking::release);
        self.bimanual.iter_mut().for_each(Bimanual::release);
        self.gripper_reach.stay();
        self.player = None;
    }

    /// The torso, within its range, where the legs can hold it with the centre of mass over the feet: where it really
    /// is, as leg and arm reach out, so that the torso makes way for them.
    fn move_torso(&mut self, played: Option<&Sample>, scene: &Scene<'_>, setpoint: &mut Setpoint) {
        let range =
            if self.effector.is_some() { self.limits.gripper_torso } else { self.limits.stance_torso };
        let measured = from_above(&(scene.com - scene.state.world_from_torso.translation.vector));
        let com_from_torso = self
            .com_from_torso
            .map_or(measured, |com| com + (measured - com) * (scene.dt_s * COM_CUTOFF_RAD_S).min(1.0));
        self.com_from_torso = Some(com_from_torso);
        let (feet, count) = scene.footholds(&setpoint.contacts);
        let footing = Footing {
            feet: &feet[..count],
            com_from_torso,
            margin_m: self.limits.support_margin_m,
            ground_m: scene.ground(&setpoint.contacts),
            range: self.limits.reach,
        };
        let reach = &mut self.torso_reach;
        let permitted =
            |wanted: &Isometry3<f64>| reach.nearest(scene.model, &footing, &range.clamp(wanted), scene.dt_s);
        let along = played.map(|sample| &sample.torso);
        self.torso.advance_by(along, scene.now_ns, scene.dt_s, permitted);
        setpoint.torso = *self.torso.reference();
    }

    /// The torso along its course, at the height and tilt that are asked for.
    fn walk(&mut self, played: Option<&Sample>, scene: &Scene<'_>, setpoint: &mut Setpoint) {
        let range = self.limits.walking.torso;
        let along = played.map(|sample| &sample.torso);
        self.torso.advance_by(along, scene.now_ns, scene.dt_s, |wanted| range.clamp(wanted));
        if let Some(sample) = played {
            self.open(&Side::ALL, &sample.opening);
        }
        if let Some(walking) = &mut self.walking {
            walking.step(self.torso.reference(), played, scene, setpoint);
        }
    }

    /// The foot, within its box, above the ground, within reach.
    fn move_foot(&mut self, side: Side, played: Option<&Sample>, scene: &Scene<'_>, setpoint: &mut Setpoint) {
        let (range, start) = (self.limits.foot, self.limb_start);
        let lowest = scene.ground(&setpoint.contacts) + FOOT_RADIUS_M + self.limits.reach.ground_m;
        let (reach, world_from_torso) = (&mut self.foot_reach, setpoint.torso.pose());
        let permitted = |wanted: &Isometry3<f64>| {
            let mut position = range.clamp(&wanted.translation.vector, &start, side);
            position.z = position.z.max(lowest);
            let inside = world_from_torso.inverse_transform_point(&position.into());
            let nearest = world_from_torso * reach.nearest(scene.model, &inside);
            Isometry3::from_parts(nearest.into(), wanted.rotation)
        };
        let along = played.map(|sample| PoseReference {
            rotation: RotationReference::hold(UnitQuaternion::identity()),
            ..sample.limbs[side.index()]
        });
        self.limb.advance_by(along.as_ref(), scene.now_ns, scene.dt_s, permitted);
        setpoint.lift(side, self.limb.reference().point);
    }

    /// The gripper, within its box, within reach. On a detour to another posture foot and arm are led in its place:
    /// its pose alone would leave the controller in the posture that the limb is to leave.
    fn move_gripper(
        &mut self,
        side: Side,
        played: Option<&Sample>,
        scene: &Scene<'_>,
        setpoint: &mut Setpoint,
    ) {
        let (range, start) = (self.limits.gripper, self.limb_start);
        let (reach, world_from_torso) = (&mut self.gripper_reach, setpoint.torso.pose());
        let ground = Ground::at(scene.ground(&setpoint.contacts), &world_from_torso);
        let permitted = |wanted: &Isometry3<f64>| {
            let position = range.clamp(&wanted.translation.vector, &start, side);
            let inside = Isometry3::from_parts(position.into(), wanted.rotation);
            let target = world_from_torso.inv_mul(&inside);
            world_from_torso * reach.nearest(scene.model, scene.desired, &ground, &target, scene.dt_s)
        };
        let along = played.map(|sample| &sample.limbs[side.index()]);
        self.limb.advance_by(along, scene.now_ns, scene.dt_s, permitted);
        if let Some(sample) = played {
            self.open(&[side], &sample.opening);
        }
        match self.gripper_reach.detour(scene.model) {
            None => setpoint.grasp(side, *self.limb.reference()),
            Some(motion) => {
                self.limb.carry(motion.gripper.rebased(&world_from_torso));
                setpoint.lift(side, rebased_point(&motion.foot, &world_from_torso));
                setpoint.hold_arm(side, motion.arm);
            }
        }
    }
}
