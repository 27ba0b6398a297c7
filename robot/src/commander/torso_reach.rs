//! Keeps the torso's target where the standing legs can hold it: their joints inside their ranges, the centre of
//! mass over their feet, the mounts of the arms off the ground.
//!
//! The feet rest, so that a motion (δp, δθ) of the torso along the world's axes turns the joints of leg l by
//!
//! ```text
//! δq_l = J_l⁻¹ Rᵀ ((f_l - p) × δθ - δp)          f_l: the foot, p and R: the torso, J_l: of the foot in its frame
//! ```
//! and every limit is a half-space of (δp, δθ). From the last solution, the step towards the target is brought to
//! the nearest one inside all of them ([`crate::polyhedron`]): a robot that is asked to lean too far leans as far as it
//! can, and slides along what limits it. A leg at the end of its range would hold up the torso for good, and with
//! it everything that keeps the balance.

use nalgebra::{Isometry3, Matrix6, UnitQuaternion, Vector2, Vector3, Vector6};

use super::{
    limits::ReachRange,
    support::{edges, from_above},
};
use crate::{
    collision::{Ground, Part},
    joints::{JointVector, Leg},
    kinematics::{FootKinematics, body_poses, inverse_of_leg},
    model::Model,
    polyhedron::Polyhedron,
};

/// An angle of a radian counts like so many metres: at about this distance from the torso are its feet.
const METRES_PER_RADIAN: f64 = 0.3;
/// How fast the solution moves at most, where limits turn it aside, m/s and rad/s; three times what a target does.
const SPEED_M_S: f64 = 1.0;
const SPEED_RAD_S: f64 = 3.0;
/// Steps in each control period.
const STEPS: usize = 2;

/// What the torso stands on.
#[derive(Debug, Clone, Copy)]
pub struct Footing<'a> {
    /// The legs that stand, and where in the world.
    pub feet: &'a [(Leg, Vector3<f64>)],
    /// From the torso's origin to the centre of mass, seen from above, along the world's axes, m.
    pub com_from_torso: Vector2<f64>,
    /// How far inside the polygon of the feet the centre of mass stays, m.
    pub margin_m: f64,
    /// Height of the ground in the world, m.
    pub ground_m: f64,
    /// Angles of the legs' joints, and the least height of the arms' mounts above the ground.
    pub range: ReachRange,
}

/// A torso that reaches for a target.
#[derive(Debug, Clone)]
pub struct TorsoReach {
    torso: Isometry3<f64>,
    joints: JointVector,
    polyhedron: Polyhedron,
}

impl TorsoReach {
    /// Starts there, at these joint angles.
    pub fn new(torso: &Isometry3<f64>, joints: &JointVector) -> Self {
        Self { torso: *torso, joints: *joints, polyhedron: Polyhedron::new() }
    }

    /// The pose nearest to a target that the legs can hold by now. Allocates nothing.
    pub fn nearest(
        &mut self,
        model: &Model,
        footing: &Footing<'_>,
        target: &Isometry3<f64>,
        dt_s: f64,
    ) -> Isometry3<f64> {
        for _ in 0..STEPS {
            self.step(model, footing, target, dt_s / STEPS as f64);
        }
        self.torso
    }

    fn step(&mut self, model: &Model, footing: &Footing<'_>, target: &Isometry3<f64>, dt_s: f64) {
        let way = target.translation.vector - self.torso.translation.vector;
        let turn = (target.rotation * self.torso.rotation.inverse()).scaled_axis();
        let within = |step: Vector6<f64>| {
            let way = step.fixed_rows::<3>(0).norm() / SPEED_M_S;
            let turn = step.fixed_rows::<3>(3).norm() / SPEED_RAD_S;
            step * (dt_s / way.max(turn).max(dt_s))
        };
        let wanted = within(Vector6::new(way.x, way.y, way.z, turn.x, turn.y, turn.z));
        self.enclose(model, footing);
        let mut metric = Matrix6::identity();
        metric.fixed_view_mut::<3, 3>(3, 3).scale_mut(METRES_PER_RADIAN.powi(2));
        let step = within(self.polyhedron.nearest(&wanted, &metric).unwrap_or_default());
        self.torso.translation.vector += step.fixed_rows::<3>(0);
        let turn = step.fixed_rows::<3>(3).into_owned();
        self.torso.rotation = UnitQuaternion::from_scaled_axis(turn) * self.torso.rotation;
        self.torso.rotation.renormalize();
    }

    /// Makes the polyhedron of all steps that the limits permit.
    fn enclose(&mut self, model: &Model, footing: &Footing<'_>) {
        self.polyhedron.clear();
        self.keep_over_the_feet(footing);
        let mut of_joints = [[Vector6::zeros(); 3]; 4];
        for (of_joints, (leg, foot)) in of_joints.iter_mut().zip(footing.feet) {
            *of_joints = self.follow(model, *leg, foot);
            self.keep_in_range(*leg, &footing.range, of_joints);
        }
        self.keep_mounts_up(model, footing, &of_joints);
    }

    fn keep_over_the_feet(&mut self, footing: &Footing<'_>) {
        let (mut feet, count) = ([Vector2::zeros(); 4], footing.feet.len().min(4));
        for (place, (_, foot)) in feet.iter_mut().zip(footing.feet) {
            *place = from_above(foot);
        }
        let com = from_above(&self.torso.translation.vector) + footing.com_from_torso;
        for (corner, inwards) in edges(&feet[..count]) {
            let row = Vector6::new(inwards.x, inwards.y, 0.0, 0.0, 0.0, 0.0);
            self.polyhedron.push(row, footing.margin_m - inwards.dot(&(com - corner)));
        }
    }

    /// Brings a leg to its foot. How its joints then turn with the torso.
    fn follow(&mut self, model: &Model, leg: Leg, foot: &Vector3<f64>) -> [Vector6<f64>; 3] {
        let kinematics = FootKinematics::new(model, &self.joints, leg);
        let inverse = inverse_of_leg(&kinematics.linear);
        let lacking = self.torso.inverse_transform_point(&(*foot).into()).coords - kinematics.position();
        let mut joints = self.joints.fixed_rows_mut::<3>(leg.first_joint());
        joints += inverse * lacking;
        let by_foot = inverse * self.torso.rotation.to_rotation_matrix().matrix().transpose();
        let lever = foot - self.torso.translation.vector;
        std::array::from_fn(|joint| {
            let along = by_foot.row(joint).transpose();
            let turning = along.cross(&lever);
            Vector6::new(-along.x, -along.y, -along.z, turning.x, turning.y, turning.z)
        })
    }

    fn keep_in_range(&mut self, leg: Leg, range: &ReachRange, of_joints: &[Vector6<f64>; 3]) {
        for ((joint, row), range) in (leg.first_joint()..).zip(of_joints).zip(range.leg()) {
            let angle = self.joints[joint];
            self.polyhedron.push(*row, range.min - angle);
            self.polyhedron.push(-row, angle - range.max);
        }
    }

    fn keep_mounts_up(&mut self, model: &Model, footing: &Footing<'_>, of_joints: &[[Vector6<f64>; 3]; 4]) {
        let ground = Ground::at(footing.ground_m, &self.torso);
        let bodies = body_poses(model, &self.joints);
        for (of_joints, (leg, _)) in of_joints.iter().zip(footing.feet) {
            let ends = ground.altitudes(*leg, &model.collision, &bodies);
            for end in ends.filter(|end| end.link.part == Part::Mount) {
                let gradient = end.gradient(&ground, &bodies);
                let lever = (self.torso.rotation * end.center).cross(&Vector3::z());
                let mut row = Vector6::new(0.0, 0.0, 1.0, lever.x, lever.y, lever.z);
                for (joint, of_joint) in (leg.first_joint()..).zip(of_joints) {
                    row += of_joint * gradient[joint];
                }
                self.polyhedron.push(row, footing.range.ground_m - end.height);
            }
        }
    }
}

#[cfg(test)]
mod tests;
