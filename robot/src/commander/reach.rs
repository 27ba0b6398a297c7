//! Keeps a gripper's target within what its leg and arm can reach.
//!
//! The whole-body controller puts a gripper's position above its orientation: were the target out of reach,
//! it would give up all of the orientation for the last millimetre. So a target is first replaced by the pose
//! nearest to it that six joints inside their ranges can take, off the robot itself and above the ground, where
//! both errors count:
//!
//! ```text
//! minimize |p_t - p(q)|² + L² |log(R_t R(q)ᵀ)|²   over q in its box, links apart and above ground, |q̇| ≤ v
//! ```
//! by damped Gauss-Newton steps from the last solution, each brought to the nearest step that the limits permit
//! ([`crate::polyhedron`]). With the joints' speed bounded, the solution is a path that the limb can follow.
//!
//! Led far around, such an iteration ends where it cannot get out: a wrist at the end of its range, from where
//! the way back is the other way round. So while a target is missed, the joint angles that meet it are computed
//! in closed form ([`branches`]). When some of them are inside all limits, and far from the present ones, until
//! [`PATIENCE_M_S`] is used up, the limb makes a [detour](Detour) to them through the space of its joints, inside
//! the same limits. A target that nothing meets exactly causes none, nor does one that the joints are on their
//! way to; what a detour did not come to because the robot itself bars the way is not tried again. It is the limb's own
//! motion: it rests while no fresh command says that somebody watches, and ends when he lets go.

mod branches;
mod detour;
mod walls;

use nalgebra::{Isometry3, Matrix6, Vector6};

use self::{branches::branches, detour::Detour, walls::Walls};
use super::{
    limits::{Range, ReachRange},
    reference::PoseReference,
};
use crate::{
    collision::Ground,
    joints::{JointVector, Side},
    kinematics::{FootKinematics, GripperKinematics},
    model::Model,
    polyhedron::Polyhedron,
    wbc::PointReference,
};

/// L: an error of a radian counts like this many metres. At the wrist's distance from the grasp centre.
const METRES_PER_RADIAN: f64 = 0.15;
/// Damping, m²/rad²: 1 % of what an arm's link of 0.1 m gives.
const DAMPING: f64 = 1e-4;
/// Share of the joints' greatest velocities at which the solution may move, and a limit for all, rad/s.
const SPEED_SHARE: f64 = 0.5;
const SPEED_RAD_S: f64 = 4.0;
/// Distance kept from the ends of the joints' ranges, rad.
const MARGIN_RAD: f64 = 0.03;
/// The solution stays so near to what the limb is asked for, rad: it does not go over to a posture in which the limb
/// is not.
const LEAD_RAD: f64 = 0.6;
/// Links that are too near are taken apart at this speed, m/s.
const RECOVERY_M_S: f64 = 0.5;
/// A detour begins where the limb is, which may be beyond these limits by what the controller's are wider: it is
/// brought inside by this share of the speed.
const DETOUR_RECOVERY: f64 = 0.25;
/// Steps in each control period: a reachable target is met to a hundredth of a millimetre.
const STEPS: usize = 3;
/// A target is missed beyond this, m: much more than what is left of one that the joints follow.
const MISSED_M: f64 = 0.005;
/// Joint angles nearer than this are found by the iteration itself, rad.
const NEAR_RAD: f64 = 0.5;
/// A target that could be met may be missed by so much for so long before the limb makes a detour, m s: by 10 cm
/// for 0.3 s, in which joints at their greatest speed get to where they are late, by 1 cm for 3 s.
const PATIENCE_M_S: f64 = 0.03;

/// Leg and arm that reach for a target.
#[derive(Debug, Clone)]
pub struct Reach {
    side: Side,
    joints: JointVector,
    /// What was asked of the limb last.
    desired: Vector6<f64>,
    range: ReachRange,
    walls: Walls,
    polyhedron: Polyhedron,
    /// By how much for how long the target has been missed although other joint angles meet it, m s.
    missed_m_s: f64,
    detour: Option<Detour>,
    /// Where a detour did not arrive: not tried again until a target is met.
    barred: Option<Vector6<f64>>,
    /// Nobody says at present that the limb may move on by itself.
    paused: bool,
}

/// A change of the six joints that limits may change.
#[derive(Debug, Clone, Copy)]
struct Wish {
    change: Vector6<f64>,
    /// In which what comes nearest to it is found.
    metric: Matrix6<f64>,
    /// How fast what is beyond a limit is brought back, as a share of what is possible.
    recovery: f64,
}

/// How a limb moves on a detour, in and relative to the torso's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimbReference {
    /// Its gripper.
    pub gripper: PoseReference,
    /// Its foot.
    pub foot: PointReference,
    /// The joints of its arm.
    pub arm: PointReference,
}

impl Reach {
    /// Starts at these joint angles.
    pub fn new(side: Side, joints: &JointVector, range: ReachRange) -> Self {
        Self {
            side,
            joints: *joints,
            desired: of_limb(joints, side),
            range,
            walls: Walls::new(side, range),
            polyhedron: Polyhedron::new(),
            missed_m_s: 0.0,
            detour: None,
            barred: None,
            paused: false,
        }
    }

    /// The nearest pose to `torso_from_target` that can be reached by now. The robot's joints are asked to be at
    /// `desired`, the ground is there. Allocates nothing.
    pub fn nearest(
        &mut self,
        model: &Model,
        desired: &JointVector,
        ground: &Ground,
        torso_from_target: &Isometry3<f64>,
        dt_s: f64,
    ) -> Isometry3<f64> {
        let limb = self.limb();
        self.joints = *desired;
        self.place(&limb);
        self.decide(model, desired, ground, torso_from_target, dt_s);
        self.desired = of_limb(desired, self.side);
        self.walls.find(model, &self.joints, ground);
        if let Some(detour) = self.detour {
            let change = detour.change(&self.limb(), self.paused, dt_s);
            let wish = Wish { change, metric: Matrix6::identity(), recovery: DETOUR_RECOVERY };
            let change = self.go(model, desired, &wish, dt_s);
            self.detour = Some(detour.after(&change, &self.limb(), self.paused, dt_s));
        } else {
            for _ in 0..STEPS {
                self.step(model, desired, torso_from_target, dt_s / STEPS as f64);
            }
        }
        self.pose(model)
    }

    /// The limb's motion while it makes a detour, which its gripper's pose alone does not tell.
    pub fn detour(&self, model: &Model) -> Option<LimbReference> {
        let detour = self.detour.as_ref()?;
        let (leg, arm) = (detour.velocity().fixed_rows::<3>(0), detour.velocity().fixed_rows::<3>(3));
        let gripper = GripperKinematics::new(model, &self.joints, self.side);
        let twist = gripper.jacobian * detour.velocity();
        let foot = FootKinematics::new(model, &self.joints, self.side.leg());
        let mut reference = PoseReference::hold(&gripper.torso_from_gripper);
        reference.point.velocity = twist.fixed_rows::<3>(0).into_owned();
        reference.rotation.angular_velocity = twist.fixed_rows::<3>(3).into_owned();
        let moving = |position, velocity| PointReference { velocity, ..PointReference::hold(position) };
        Some(LimbReference {
            gripper: reference,
            foot: moving(foot.position(), foot.linear * leg),
            arm: moving(self.limb().fixed_rows::<3>(3).into_owned(), arm.into_owned()),
        })
    }

    /// Ends a detour where it is.
    pub fn stay(&mut self) {
        self.detour = None;
        self.missed_m_s = 0.0;
    }

    /// From here on, a detour comes to rest where it is and none begins; or it goes on.
    pub fn pause(&mut self, paused: bool) {
        self.paused = paused;
    }

    /// Where the six joints are to go by now, rad.
    pub fn limb(&self) -> Vector6<f64> {
        of_limb(&self.joints, self.side)
    }

    fn place(&mut self, limb: &Vector6<f64>) {
        for (joint, angle) in self.side.limb_joints().into_iter().zip(limb.iter()) {
            self.joints[joint] = *angle;
        }
    }

    fn pose(&self, model: &Model) -> Isometry3<f64> {
        GripperKinematics::new(model, &self.joints, self.side).torso_from_gripper
    }

    fn range(&self, model: &Model, column: usize) -> Range {
        let joint = self.side.limb_joints()[column];
        match column {
            0..3 => self.range.leg()[column],
            3 => self.range.arm_1,
            _ => Range { min: model.lower[joint] + MARGIN_RAD, max: model.upper[joint] - MARGIN_RAD },
        }
    }

    /// Whether a detour is made, and where to.
    fn decide(
        &mut self,
        model: &Model,
        desired: &JointVector,
        ground: &Ground,
        target: &Isometry3<f64>,
        dt_s: f64,
    ) {
        if self.paused {
            self.missed_m_s = 0.0;
            return;
        }
        let here = self.limb();
        if let Some(mut detour) = self.detour {
            if let Some(goal) = self.solution(model, ground, target, detour.goal()) {
                detour.aim(&goal);
            }
            if detour.has_stopped() && !are_near(detour.goal(), &here) {
                self.barred = Some(*detour.goal());
            }
            self.detour = Some(detour).filter(|detour| !detour.is_over(&here) && !detour.has_stopped());
            return;
        }
        let miss = miss(target, &self.pose(model));
        let missed = miss > MISSED_M;
        self.barred = self.barred.filter(|_| missed);
        let other = if missed { self.solution(model, ground, target, &here) } else { None };
        let is_barred = |goal: &Vector6<f64>| self.barred.is_some_and(|barred| are_near(&barred, goal));
        let Some(goal) = other.filter(|goal| !are_near(goal, &here) && !is_barred(goal)) else {
            self.missed_m_s = 0.0;
            return;
        };
        self.missed_m_s += miss * dt_s;
        if self.missed_m_s > PATIENCE_M_S {
            self.missed_m_s = 0.0;
            let (before, now) = (self.desired, of_limb(desired, self.side));
            self.place(&now);
            self.detour = Some(Detour::new(goal, &((now - before) / dt_s)));
        }
    }

    /// The joint angles nearest to `near` that meet a target and are permitted.
    fn solution(
        &mut self,
        model: &Model,
        ground: &Ground,
        target: &Isometry3<f64>,
        near: &Vector6<f64>,
    ) -> Option<Vector6<f64>> {
        let here = self.limb();
        let mut nearest: Option<Vector6<f64>> = None;
        let distance = |limb: &Vector6<f64>| (limb - near).amax();
        for limb in branches(model, self.side, target) {
            let inside =
                limb.iter().enumerate().all(|(column, angle)| self.range(model, column).contains(*angle));
            if !inside || nearest.is_some_and(|nearest| distance(&nearest) <= distance(&limb)) {
                continue;
            }
            self.place(&limb);
            self.walls.find(model, &self.joints, ground);
            if self.walls.least_room() >= 0.0 {
                nearest = Some(limb);
            }
        }
        self.place(&here);
        nearest
    }

    fn step(&mut self, model: &Model, desired: &JointVector, target: &Isometry3<f64>, dt_s: f64) {
        let now = GripperKinematics::new(model, &self.joints, self.side);
        let mut error = Vector6::zeros();
        let moved = target.translation.vector - now.torso_from_gripper.translation.vector;
        let turned = (target.rotation * now.torso_from_gripper.rotation.inverse()).scaled_axis();
        error.fixed_rows_mut::<3>(0).copy_from(&moved);
        error.fixed_rows_mut::<3>(3).copy_from(&(turned * METRES_PER_RADIAN));
        let mut jacobian = now.jacobian;
        jacobian.fixed_rows_mut::<3>(3).scale_mut(METRES_PER_RADIAN);

        let hessian = jacobian.tr_mul(&jacobian) + DAMPING * Matrix6::identity();
        let Some(factor) = hessian.cholesky() else { return };
        let change = factor.solve(&jacobian.tr_mul(&error));
        self.go(model, desired, &Wish { change, metric: hessian, recovery: 1.0 }, dt_s);
    }

    /// Changes the joints as wished, or as near to it as the limits permit. Returns the change.
    fn go(&mut self, model: &Model, desired: &JointVector, wish: &Wish, dt_s: f64) -> Vector6<f64> {
        let Wish { change: wanted, metric, recovery } = wish;
        self.polyhedron.clear();
        for (column, joint) in self.side.limb_joints().into_iter().enumerate() {
            let range = self.range(model, column);
            let range = Range {
                min: range.clamp(desired[joint] - LEAD_RAD),
                max: range.clamp(desired[joint] + LEAD_RAD),
            };
            let most = dt_s * SPEED_RAD_S.min(SPEED_SHARE * model.max_velocity[joint]);
            let angle = self.joints[joint];
            let unit = Vector6::ith(column, 1.0);
            self.polyhedron.push(unit, (range.min - angle).clamp(-most, recovery * most));
            self.polyhedron.push(-unit, (angle - range.max).clamp(-most, recovery * most));
        }
        self.walls.enclose(&mut self.polyhedron, recovery * RECOVERY_M_S * dt_s);
        let change = self.polyhedron.nearest(wanted, metric).unwrap_or_default();
        self.place(&(self.limb() + change));
        self.walls.pass(&change);
        change
    }
}

fn of_limb(joints: &JointVector, side: Side) -> Vector6<f64> {
    side.limb_joints().map(|joint| joints[joint]).into()
}

fn are_near(first: &Vector6<f64>, second: &Vector6<f64>) -> bool {
    (first - second).amax() < NEAR_RAD
}

/// √ of what is minimized, m.
fn miss(target: &Isometry3<f64>, reached: &Isometry3<f64>) -> f64 {
    let moved = (target.translation.vector - reached.translation.vector).norm();
    moved.hypot(METRES_PER_RADIAN * target.rotation.angle_to(&reached.rotation))
}

#[cfg(test)]
mod tests;
