//! Keeps a foot's target within what its leg can reach: the nearest point to it that three joints inside
//! their ranges can take, by damped Gauss-Newton steps from the last solution (as [`super::Reach`] does for
//! a gripper).

use nalgebra::{Matrix3, Point3, Vector3};

use super::limits::ReachRange;
use crate::{
    joints::{JointVector, Leg},
    kinematics::FootKinematics,
    model::Model,
};

/// Damping, m²/rad²: 0.2 % of what the leg's links of 0.213 m give.
const DAMPING: f64 = 1e-4;
/// Longest step of a joint, rad.
const MAX_STEP_RAD: f64 = 0.05;
/// Steps in each control period.
const STEPS: usize = 3;

/// A leg that reaches for a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootReach {
    leg: Leg,
    joints: JointVector,
    range: ReachRange,
}

impl FootReach {
    /// Starts at these joint angles.
    pub fn new(leg: Leg, joints: &JointVector, range: ReachRange) -> Self {
        Self { leg, joints: *joints, range }
    }

    /// The nearest point to `target` that can be reached, both in the torso's frame. Allocates nothing.
    pub fn nearest(&mut self, model: &Model, target: &Point3<f64>) -> Point3<f64> {
        for _ in 0..STEPS {
            self.step(model, &target.coords);
        }
        FootKinematics::new(model, &self.joints, self.leg).position().into()
    }

    fn step(&mut self, model: &Model, target: &Vector3<f64>) {
        let now = FootKinematics::new(model, &self.joints, self.leg);
        let gradient = now.linear.tr_mul(&(target - now.position()));
        let hessian = now.linear.tr_mul(&now.linear) + DAMPING * Matrix3::identity();
        let first = self.leg.first_joint();
        let ranges = self.range.leg();
        let mut held = [false; 3];
        // Each round holds the joints that the last one pushed out of their range.
        for _ in 0..3 {
            let step = solve_free(&hessian, &gradient, &held);
            let leaves = |column: usize| {
                let (angle, range) = (self.joints[first + column], ranges[column]);
                (angle <= range.min && step[column] < 0.0) || (angle >= range.max && step[column] > 0.0)
            };
            if let Some(column) = (0..3).find(|column| !held[*column] && leaves(*column)) {
                held[column] = true;
                continue;
            }
            let scale = MAX_STEP_RAD / step.amax().max(MAX_STEP_RAD);
            for (column, range) in ranges.iter().enumerate() {
                let angle = self.joints[first + column] + scale * step[column];
                self.joints[first + column] = range.clamp(angle);
            }
            return;
        }
    }
}

/// H Δq = g over the joints that are not held; zero for those that are.
fn solve_free(hessian: &Matrix3<f64>, gradient: &Vector3<f64>, held: &[bool; 3]) -> Vector3<f64> {
    let (mut hessian, mut gradient) = (*hessian, *gradient);
    for (index, _) in held.iter().enumerate().filter(|(_, held)| **held) {
        hessian.row_mut(index).fill(0.0);
        hessian.column_mut(index).fill(0.0);
        hessian[(index, index)] = 1.0;
        gradient[index] = 0.0;
    }
    hessian.cholesky().map_or_else(Vector3::zeros, |factor| factor.solve(&gradient))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{
        commander::Limits,
        model::{Frame, test_model},
    };

    fn lifted() -> JointVector {
        let mut joints = JointVector::zeros();
        joints.rows_mut(0, 3).copy_from_slice(&[-0.1, 0.9, -2.2]);
        joints
    }

    fn place(model: &Model, joints: &JointVector) -> Point3<f64> {
        let leg = Leg::FrontRight;
        crate::kinematics::torso_from_frame(model, joints, Frame::Foot(leg)).translation.vector.into()
    }

    /// Walks the target from the start to `goal` in a second, then waits for another.
    fn walk(sut: &mut FootReach, model: &Model, start: &Point3<f64>, goal: &Point3<f64>) -> Point3<f64> {
        (0..800).fold(*start, |_, tick| {
            let share = (f64::from(tick) / 400.0).min(1.0);
            sut.nearest(model, &(start + (goal - start) * share))
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn what_can_be_reached_is_left_alone_and_from_beyond_the_way_back_is_found(
            near in prop::array::uniform3(-0.3..0.3f64), far in prop::array::uniform3(-0.4..0.4f64),
        ) {
            let (model, range) = (test_model(), Limits::default().reach);
            let start = place(&model, &lifted());
            let mut sut = FootReach::new(Leg::FrontRight, &lifted(), range);
            let mut there = lifted();
            for joint in 0..3 {
                there[joint] += near[joint];
            }
            let goal = place(&model, &there);
            prop_assert!((walk(&mut sut, &model, &start, &goal) - goal).norm() < 1e-4);
            let beyond = goal + Vector3::from(far);
            let reached = walk(&mut sut, &model, &goal, &beyond);
            prop_assert!((reached - beyond).norm() <= (goal - beyond).norm() + 1e-3, "nearer than without");
            for (joint, range) in range.leg().iter().enumerate() {
                prop_assert!((range.min..=range.max).contains(&sut.joints[joint]));
            }
            prop_assert!((walk(&mut sut, &model, &beyond, &start) - start).norm() < 1e-3);
        }
    }
}
