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

use nalgebra::{Isometry3, Matrix6, Vector6};

use super::limits::{Range, ReachRange};
use crate::{
    collision::{Clearances, Ground},
    joints::{JointVector, Side},
    kinematics::{GripperKinematics, body_poses},
    model::Model,
    polyhedron::Polyhedron,
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
/// Links nearer than this beyond their clearance are looked at, m.
const INFLUENCE_M: f64 = 0.03;
/// The solution stays so near to what the limb is asked for, rad: it does not go over to a posture in which the limb
/// is not.
const LEAD_RAD: f64 = 0.6;
/// Steps in each control period: a reachable target is met to a hundredth of a millimetre.
const STEPS: usize = 3;

/// Leg and arm that reach for a target.
#[derive(Debug, Clone)]
pub struct Reach {
    side: Side,
    joints: JointVector,
    range: ReachRange,
    clearances: Clearances,
    polyhedron: Polyhedron,
}

/// How a distance, of two links or of one from the ground, depends on the six joints.
#[derive(Debug, Clone, Copy)]
struct Wall {
    /// What is left of it, m.
    room: f64,
    /// m/rad
    slope: Vector6<f64>,
}

/// The most walls that are looked at: with the six joints' ends as many as the polyhedron takes.
const WALLS: usize = Polyhedron::MOST - 12;

impl Reach {
    /// Starts at these joint angles.
    pub fn new(side: Side, joints: &JointVector, range: ReachRange) -> Self {
        Self { side, joints: *joints, range, clearances: Clearances::new(), polyhedron: Polyhedron::new() }
    }

    fn range(&self, model: &Model, column: usize, joint: usize) -> Range {
        match column {
            0 => self.range.hip,
            1 => self.range.thigh,
            2 => self.range.calf,
            3 => self.range.arm_1,
            _ => Range { min: model.lower[joint] + MARGIN_RAD, max: model.upper[joint] - MARGIN_RAD },
        }
    }

    /// The nearest pose to `torso_from_target` that can be reached by now; the other limbs are at `others`, the
    /// ground is there. Allocates nothing.
    pub fn nearest(
        &mut self,
        model: &Model,
        others: &JointVector,
        ground: &Ground,
        torso_from_target: &Isometry3<f64>,
        dt_s: f64,
    ) -> Isometry3<f64> {
        let now = GripperKinematics::new(model, &self.joints, self.side);
        let mut posture = *others;
        for joint in now.joints {
            posture[joint] = self.joints[joint];
        }
        self.joints = posture;
        let mut walls = [Wall { room: 0.0, slope: Vector6::zeros() }; WALLS];
        let count = self.walls(model, &now.joints, ground, &mut walls);
        for _ in 0..STEPS {
            self.step(model, others, torso_from_target, &mut walls[..count], dt_s / STEPS as f64);
        }
        GripperKinematics::new(model, &self.joints, self.side).torso_from_gripper
    }

    /// Finds what this limb's links are near.
    fn walls(
        &mut self,
        model: &Model,
        joints: &[usize; 6],
        ground: &Ground,
        walls: &mut [Wall; WALLS],
    ) -> usize {
        let bodies = body_poses(model, &self.joints);
        let pairs = model.collision.pairs_of(self.side);
        let clearance_m = self.range.clearance_m;
        self.clearances.update(&model.collision, pairs, &bodies, clearance_m + INFLUENCE_M);
        let from_links = self.clearances.near().iter().map(|near| {
            let gradient = near.gradient(&bodies);
            let slope = Vector6::from_fn(|column, _| gradient[joints[column]]);
            Wall { room: near.distance - clearance_m, slope }
        });
        let ends = ground.altitudes(self.side.leg(), &model.collision, &bodies);
        let from_ground = ends.filter_map(|end| {
            let room = end.height - self.range.ground_m;
            let gradient = end.gradient(ground, &bodies);
            let slope = Vector6::from_fn(|column, _| gradient[joints[column]]);
            (room < INFLUENCE_M).then_some(Wall { room, slope })
        });
        let mut count = 0;
        for (place, wall) in walls.iter_mut().zip(from_ground.chain(from_links)) {
            *place = wall;
            count += 1;
        }
        count
    }

    fn step(
        &mut self,
        model: &Model,
        limb: &JointVector,
        target: &Isometry3<f64>,
        walls: &mut [Wall],
        dt_s: f64,
    ) {
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
        let free = factor.solve(&jacobian.tr_mul(&error));
        self.polyhedron.clear();
        for (column, joint) in now.joints.into_iter().enumerate() {
            let range = self.range(model, column, joint);
            let range = Range {
                min: range.min.max(limb[joint] - LEAD_RAD).min(range.max),
                max: range.max.min(limb[joint] + LEAD_RAD).max(range.min),
            };
            let most = dt_s * SPEED_RAD_S.min(SPEED_SHARE * model.max_velocity[joint]);
            let angle = self.joints[joint];
            let unit = Vector6::ith(column, 1.0);
            self.polyhedron.push(unit, (range.min - angle).clamp(-most, most) - free[column]);
            self.polyhedron.push(-unit, (angle - range.max).clamp(-most, most) + free[column]);
        }
        for wall in walls.iter() {
            // Links that are too near are taken apart at half a metre a second.
            self.polyhedron.push(wall.slope, (-wall.room).min(0.5 * dt_s) - wall.slope.dot(&free));
        }
        let change = if self.polyhedron.contains_zero() {
            free
        } else {
            free + self.polyhedron.nearest(&hessian).unwrap_or(-free)
        };
        for (joint, change) in now.joints.into_iter().zip(change.iter()) {
            self.joints[joint] += change;
        }
        for wall in walls {
            wall.room += wall.slope.dot(&change);
        }
    }
}

#[cfg(test)]
mod tests;
