//! One step of walking, from the robot as it is to what torso and feet should do.

use nalgebra::{Isometry3, Rotation2, UnitQuaternion, Vector2, Vector3};

use super::{
    course::{Course, Velocity},
    gait::{Gait, LegPhase},
    ground::GroundPlane,
    placement::{Motion, landing},
    settings::{LocomotionSettings, TrimSettings},
    swing::Swing,
};
use crate::{
    commander::{PoseReference, from_above},
    estimator::heading,
    joints::Leg,
    model::{FOOT_RADIUS_M, GRAVITY},
    modes::Scene,
    wbc::{ContactSet, PointReference},
};

/// Below these nobody asks for motion, m/s and rad/s.
const RESTING_M_S: f64 = 0.01;
const RESTING_RAD_S: f64 = 0.02;
/// The robot steps on for so long after it came to rest, in cycles: its feet come to their places.
const STEPS_AFTER: f64 = 1.2;
/// The velocity of a robot that walks undisturbed is off its course by so much within a step, m/s.
const STRIDE_M_S: f64 = 0.15;
/// A robot lower than this has fallen, m.
const LEAST_HEIGHT_M: f64 = 0.05;
/// Time constant in which its sway is averaged out, s: a cycle.
const SWAY_S: f64 = 0.5;
/// Time constant with which the middle of the robot is found, s: longer than a step.
const MIDDLE_S: f64 = 0.5;

/// What torso and feet should do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// Torso in the world.
    pub torso: PoseReference,
    /// Feet in the world; of those that stand, where they stand.
    pub feet: [PointReference; 4],
    /// Feet that stand.
    pub contacts: ContactSet,
}

/// Walks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walker {
    settings: LocomotionSettings,
    gait: Gait,
    course: Course,
    ground: GroundPlane,
    swings: [Swing; 4],
    /// Height of the ground under the torso, m.
    ground_m: f64,
    /// From the torso's origin to the centre of mass, seen from above, in the robot's heading.
    middle: Vector2<f64>,
    /// What the torso's height, roll and pitch are asked to be beyond what they should be, for they come out too small
    /// by it: m, and a rotation vector in the world.
    trim: (f64, Vector3<f64>),
    /// From the middle of the feet to the point where the robot could come to rest, without its sway, m.
    off_balance: Vector2<f64>,
    /// How long the robot has been at rest, s.
    resting_s: f64,
}

impl Walker {
    /// Standing where the robot stands.
    pub fn new(settings: LocomotionSettings, scene: &Scene<'_>) -> Self {
        let feet = Leg::ALL.map(|leg| scene.foot(leg));
        let torso = scene.state.world_from_torso;
        let gait = Gait::halted(settings.gait, settings.contact);
        let ground = GroundPlane::new(feet);
        Self {
            course: Course::at(from_above(&torso.translation.vector), facing(scene)),
            swings: feet.map(|foot| Swing::new(foot, gait.swing_s())),
            ground_m: ground.height(&from_above(&torso.translation.vector)),
            middle: middle(scene),
            trim: (0.0, Vector3::zeros()),
            off_balance: Vector2::zeros(),
            resting_s: f64::INFINITY,
            settings,
            gait,
            ground,
        }
    }

    /// Steps on the spot, until the feet are in their places, although nobody asks for motion.
    pub const fn step_into_place(&mut self) {
        self.resting_s = 0.0;
    }

    /// A torso's reference, about the course.
    pub fn posture_of(&self, torso: &PoseReference) -> PoseReference {
        torso.rebased(&self.frame().inverse())
    }

    /// The ground under the torso, facing along the course.
    fn frame(&self) -> Isometry3<f64> {
        let origin =
            Vector3::new(self.course.position.x, self.course.position.y, self.ground_m - FOOT_RADIUS_M);
        Isometry3::from_parts(origin.into(), self.course.rotation())
    }

    /// Whether it stands on four feet.
    pub const fn is_halted(&self) -> bool {
        self.gait.is_halted()
    }

    /// One step. `posture` is the torso's about its course: height above the ground, roll and pitch.
    pub fn step(&mut self, wanted: &Velocity, posture: &PoseReference, scene: &Scene<'_>) -> Steps {
        let torso = &scene.state.world_from_torso;
        let here = from_above(&torso.translation.vector);
        self.course.step(wanted, &here, facing(scene), &self.settings.course, scene.dt_s);
        self.middle += (middle(scene) - self.middle) * (scene.dt_s / MIDDLE_S).min(1.0);
        let before = self.gait;
        let may_halt = self.rests(wanted, scene);
        let motion = self.motion(scene);
        self.gait.hurry((motion.velocity - motion.wanted).norm() - STRIDE_M_S);
        self.gait.step(scene.dt_s, may_halt, &scene.foot_force);
        let feet = Leg::ALL.map(|leg| self.move_foot(leg, &before, &motion, scene));
        let ground_m = self.ground.height(&here);
        self.ground_m += (ground_m - self.ground_m) * (scene.dt_s / self.settings.course.ground_s).min(1.0);
        let reference = self.torso(posture);
        Steps { torso: self.trimmed(reference, scene), feet, contacts: self.gait.contacts() }
    }

    /// A robot whose masses are not those of the model leans until feedback makes up for it. What a step disturbs comes
    /// back within the step; what stays is learned, as an offset of the reference.
    fn trimmed(&mut self, mut torso: PoseReference, scene: &Scene<'_>) -> PoseReference {
        let real = &scene.state.world_from_torso;
        let low = torso.point.position.z - real.translation.z;
        let lean = (torso.rotation.orientation * real.rotation.inverse()).scaled_axis();
        let TrimSettings { rate, most_m, most_rad } = self.settings.trim;
        let (height, tilt) = &mut self.trim;
        let share = rate * scene.dt_s;
        *height = (*height + share * low).clamp(-most_m, most_m);
        *tilt = (*tilt + share * Vector3::new(lean.x, lean.y, 0.0)).cap_magnitude(most_rad);
        torso.point.position.z += *height;
        torso.rotation.orientation = UnitQuaternion::from_scaled_axis(*tilt) * torso.rotation.orientation;
        torso
    }

    /// Watches for how long nobody has asked for motion and the robot has been at rest and balanced; whether its feet have
    /// had the time to come to their places.
    fn rests(&mut self, wanted: &Velocity, scene: &Scene<'_>) -> bool {
        let limited = wanted.limited(&self.settings.course);
        let going =
            |velocity: &Velocity| velocity.linear.norm() > RESTING_M_S || velocity.turn.abs() > RESTING_RAD_S;
        // Within a step the robot sways from foot to foot; only what lasts longer keeps it stepping.
        let capture = self.capture_point(scene);
        let share = if self.is_halted() { 1.0 } else { (scene.dt_s / SWAY_S).min(1.0) };
        self.off_balance += (capture - self.off_balance) * share;
        let off_balance = self.off_balance.norm() > self.settings.course.balance_m;
        if going(&limited) || going(&self.course.velocity) || off_balance {
            self.resting_s = 0.0;
        } else {
            self.resting_s += scene.dt_s;
        }
        self.resting_s * self.settings.gait.frequency_hz >= STEPS_AFTER
    }

    /// From the middle of the feet to the point where the robot could come to rest.
    fn capture_point(&self, scene: &Scene<'_>) -> Vector2<f64> {
        let feet = Leg::ALL.map(|leg| from_above(&scene.foot(leg)));
        let between = feet.iter().sum::<Vector2<f64>>() / 4.0;
        let height = (scene.com.z - self.ground_m).max(LEAST_HEIGHT_M);
        let capture = from_above(&scene.com) + velocity(scene) * (height / GRAVITY).sqrt();
        capture - between
    }

    fn motion(&self, scene: &Scene<'_>) -> Motion {
        let heading = facing(scene);
        let middle = Rotation2::new(heading) * self.middle;
        Motion {
            position: from_above(&scene.state.world_from_torso.translation.vector) + middle,
            heading,
            velocity: velocity(scene),
            wanted: from_above(&self.course.linear_velocity()),
            turn: self.course.velocity.turn,
        }
    }

    fn move_foot(&mut self, leg: Leg, before: &Gait, motion: &Motion, scene: &Scene<'_>) -> PointReference {
        let place = leg.index();
        let LegPhase::Swing { progress } = self.gait.leg(leg) else {
            let foot = scene.foot(leg);
            self.ground.stand(leg, foot);
            return PointReference::hold(foot);
        };
        if matches!(before.leg(leg), LegPhase::Stance { .. }) {
            self.swings[place] = Swing::new(scene.foot(leg), self.gait.swing_s());
        }
        let left_s = (1.0 - progress).max(0.0) * self.gait.swing_s();
        let neighbour = from_above(&scene.foot(leg.across()));
        let times_s = [left_s, self.gait.stance_s()];
        let spot = landing(leg, motion, times_s, &neighbour, &self.settings.placement);
        if progress < 1.0 {
            self.swings[place].aim(Vector3::new(spot.x, spot.y, self.ground.height(&spot)));
        }
        let height_m = scene.state.world_from_torso.translation.z - self.ground_m + FOOT_RADIUS_M;
        self.swings[place].sample(progress, &self.settings.swing.under(height_m))
    }

    fn torso(&self, posture: &PoseReference) -> PoseReference {
        let mut torso = posture.rebased(&self.frame());
        torso.point.velocity += self.course.linear_velocity();
        torso.point.acceleration += self.course.linear_acceleration();
        torso.rotation.angular_velocity += self.course.velocity.turn * Vector3::z();
        torso.rotation.angular_acceleration += self.course.turn_acceleration() * Vector3::z();
        torso
    }
}

/// Velocity of the torso along the ground.
fn velocity(scene: &Scene<'_>) -> Vector2<f64> {
    let state = scene.state;
    from_above(&(state.world_from_torso * state.torso_twist.fixed_rows::<3>(0).into_owned()))
}

fn facing(scene: &Scene<'_>) -> f64 {
    let forward = heading(&scene.state.world_from_torso.rotation) * Vector3::x();
    forward.y.atan2(forward.x)
}

/// From the torso's origin to the centre of mass, seen from above, in the robot's heading.
fn middle(scene: &Scene<'_>) -> Vector2<f64> {
    let from_torso = scene.com - scene.state.world_from_torso.translation.vector;
    from_above(&(heading(&scene.state.world_from_torso.rotation).inverse() * from_torso))
}
