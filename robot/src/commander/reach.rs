//! Keeps a gripper's target within what its leg and arm can reach.
//!
//! The whole-body controller puts a gripper's position above its orientation: were the target out of reach,
//! it would give up all of the orientation for the last millimetre. So a target is first replaced by the pose
//! nearest to it that six joints inside their ranges can take, where both errors count:
//! minimize |p_t - p(q)|² + L² |log(R_t R(q)ᵀ)|² over q in its box,
//! by damped Gauss-Newton steps from the last solution, with joints at their limits held (an active set).

use nalgebra::{Isometry3, Matrix6, Vector6};

use super::limits::{Range, ReachRange};
use crate::{
    joints::{JointVector, Side},
    kinematics::GripperKinematics,
    model::Model,
};

/// L: an error of a radian counts like this many metres. At the wrist's distance from the grasp centre.
const METRES_PER_RADIAN: f64 = 0.15;
/// Damping, m²/rad²: 1 % of what an arm's link of 0.1 m gives.
const DAMPING: f64 = 1e-4;
/// Longest step of a joint, rad.
const MAX_STEP_RAD: f64 = 0.05;
/// Distance kept from the ends of the joints' ranges, rad.
const MARGIN_RAD: f64 = 0.03;
/// Steps in each control period: a reachable target is met to a hundredth of a millimetre.
const STEPS: usize = 3;

/// Leg and arm that reach for a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    side: Side,
    joints: JointVector,
    range: ReachRange,
}

impl Reach {
    /// Starts at these joint angles.
    pub fn new(side: Side, joints: &JointVector, range: ReachRange) -> Self {
        Self { side, joints: *joints, range }
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

    /// The nearest pose to `torso_from_target` that can be reached. Allocates nothing.
    pub fn nearest(&mut self, model: &Model, torso_from_target: &Isometry3<f64>) -> Isometry3<f64> {
        for _ in 0..STEPS {
            self.step(model, torso_from_target);
        }
        GripperKinematics::new(model, &self.joints, self.side).torso_from_gripper
    }

    fn step(&mut self, model: &Model, target: &Isometry3<f64>) {
        let now = GripperKinematics::new(model, &self.joints, self.side);
        let mut error = Vector6::zeros();
        let moved = target.translation.vector - now.torso_from_gripper.translation.vector;
        let turned = (target.rotation * now.torso_from_gripper.rotation.inverse()).scaled_axis();
        error.fixed_rows_mut::<3>(0).copy_from(&moved);
        error.fixed_rows_mut::<3>(3).copy_from(&(turned * METRES_PER_RADIAN));
        let mut jacobian = now.jacobian;
        jacobian.fixed_rows_mut::<3>(3).scale_mut(METRES_PER_RADIAN);

        let gradient = jacobian.tr_mul(&error);
        let hessian = jacobian.tr_mul(&jacobian) + DAMPING * Matrix6::identity();
        let mut held = [false; 6];
        // Each round holds the joints that the last one pushed out of their range.
        for _ in 0..6 {
            let step = solve_free(&hessian, &gradient, &held);
            let mut again = false;
            for (column, joint) in now.joints.into_iter().enumerate() {
                let range = self.range(model, column, joint);
                let angle = self.joints[joint];
                let leaves =
                    (angle <= range.min && step[column] < 0.0) || (angle >= range.max && step[column] > 0.0);
                if leaves && !held[column] {
                    held[column] = true;
                    again = true;
                }
            }
            if !again {
                let scale = (MAX_STEP_RAD / step.amax().max(MAX_STEP_RAD)).min(1.0);
                for (column, joint) in now.joints.into_iter().enumerate() {
                    let range = self.range(model, column, joint);
                    let angle = self.joints[joint] + scale * step[column];
                    self.joints[joint] = range.clamp(angle);
                }
                return;
            }
        }
    }
}

/// H Δq = g over the joints that are not held; zero for those that are.
fn solve_free(hessian: &Matrix6<f64>, gradient: &Vector6<f64>, held: &[bool; 6]) -> Vector6<f64> {
    let (mut hessian, mut gradient) = (*hessian, *gradient);
    for (index, _) in held.iter().enumerate().filter(|(_, held)| **held) {
        hessian.row_mut(index).fill(0.0);
        hessian.column_mut(index).fill(0.0);
        hessian[(index, index)] = 1.0;
        gradient[index] = 0.0;
    }
    hessian.cholesky().map_or_else(Vector6::zeros, |factor| factor.solve(&gradient))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;

    use super::*;
    use crate::{commander::Limits, kinematics::torso_from_frame, model::Frame};

    fn model() -> Model {
        Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/robot")).unwrap()
    }

    fn ready() -> JointVector {
        let mut joints = JointVector::zeros();
        joints.rows_mut(0, 3).copy_from_slice(&[-0.1, 0.9, -2.2]);
        joints.rows_mut(12, 3).copy_from_slice(&[-0.4, 0.0, 0.0]);
        joints
    }

    /// Walks the target from the start to `goal` in a second, then waits for another.
    fn walk(sut: &mut Reach, model: &Model, start: &Isometry3<f64>, goal: &Isometry3<f64>) -> Isometry3<f64> {
        let mut reached = *start;
        for tick in 0..800 {
            let share = (f64::from(tick) / 400.0).min(1.0);
            reached = sut.nearest(model, &start.lerp_slerp(goal, share));
        }
        reached
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn what_can_be_reached_is_left_alone(
            leg in prop::array::uniform3(-0.15..0.15f64), arm in prop::array::uniform3(-0.3..0.3f64),
        ) {
            let (model, ready) = (model(), ready());
            let mut there = ready;
            for i in 0..3 {
                there[i] += leg[i];
                there[12 + i] += arm[i];
            }
            let pose = |joints| torso_from_frame(&model, joints, Frame::Gripper(Side::Right));
            let goal = pose(&there);
            let mut sut = Reach::new(Side::Right, &ready, Limits::default().reach);
            let reached = walk(&mut sut, &model, &pose(&ready), &goal);
            prop_assert!((reached.translation.vector - goal.translation.vector).norm() < 1e-4);
            prop_assert!(reached.rotation.angle_to(&goal.rotation) < 1e-3);
        }

        #[test]
        fn out_of_reach_both_errors_stay_moderate_and_the_way_back_is_found(
            far in prop::array::uniform3(-0.15..0.15f64), turn in prop::array::uniform3(-0.4..0.4f64),
        ) {
            let (model, ready) = (model(), ready());
            let start = torso_from_frame(&model, &ready, Frame::Gripper(Side::Right));
            let goal = Isometry3::from_parts(
                (start.translation.vector + Vector3::from(far)).into(),
                UnitQuaternion::from_scaled_axis(turn.into()) * start.rotation,
            );
            let mut sut = Reach::new(Side::Right, &ready, Limits::default().reach);
            let reached = walk(&mut sut, &model, &start, &goal);
            prop_assert!((reached.translation.vector - goal.translation.vector).norm() < 0.45);
            let back = walk(&mut sut, &model, &goal, &start);
            prop_assert!((back.translation.vector - start.translation.vector).norm() < 1e-3);
            prop_assert!(back.rotation.angle_to(&start.rotation) < 1e-2);
            for joint in [0, 1, 2, 12, 13, 14] {
                prop_assert!(sut.joints[joint] >= model.lower[joint]);
                prop_assert!(sut.joints[joint] <= model.upper[joint]);
            }
        }
    }
}
