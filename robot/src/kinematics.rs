//! Kinematics relative to the torso: what the joint angles alone say, before the torso's pose is known.
//!
//! [`crate::dynamics`] computes the same in the world, with everything else; the estimator needs this before.

use nalgebra::{Isometry3, Matrix3, Matrix6, Translation3, UnitQuaternion, Vector3};

use crate::{
    joints::{JointVector, Leg, Side},
    model::{Frame, Model, PARENT},
};

/// Pose of the body that moves with a joint, in the torso's frame.
fn torso_from_body(model: &Model, position: &JointVector, joint: usize) -> Isometry3<f64> {
    let own = &model.joints[joint];
    let rotation = UnitQuaternion::from_axis_angle(&own.axis, position[joint]);
    let parent_from_body = own.parent_from_joint * Isometry3::from_parts(Translation3::identity(), rotation);
    match PARENT[joint] {
        None => parent_from_body,
        Some(parent) => torso_from_body(model, position, parent) * parent_from_body,
    }
}

/// Pose of a frame in the torso's frame.
pub fn torso_from_frame(model: &Model, position: &JointVector, frame: Frame) -> Isometry3<f64> {
    match frame.joint() {
        None => Isometry3::identity(),
        Some(joint) => torso_from_body(model, position, joint) * frame.body_from_frame(model),
    }
}

/// A foot relative to the torso.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootKinematics {
    /// Pose of the foot in the torso's frame.
    pub torso_from_foot: Isometry3<f64>,
    /// Velocity of the foot's centre in the torso's frame for each joint's velocity, m/rad.
    pub linear: Matrix3<f64>,
    /// Axes of the three joints in the torso's frame: angular velocity of the foot for each joint's.
    pub angular: Matrix3<f64>,
}

impl FootKinematics {
    /// Kinematics of one leg's foot.
    pub fn new(model: &Model, position: &JointVector, leg: Leg) -> Self {
        let torso_from_foot = torso_from_frame(model, position, Frame::Foot(leg));
        let foot = torso_from_foot.translation.vector;
        let (mut linear, mut angular) = (Matrix3::zeros(), Matrix3::zeros());
        for column in 0..3 {
            let joint = leg.first_joint() + column;
            let body = torso_from_body(model, position, joint);
            let axis = body.rotation * model.joints[joint].axis.into_inner();
            linear.set_column(column, &axis.cross(&(foot - body.translation.vector)));
            angular.set_column(column, &axis);
        }
        Self { torso_from_foot, linear, angular }
    }

    /// Position of the foot's centre in the torso's frame.
    pub fn position(&self) -> Vector3<f64> {
        self.torso_from_foot.translation.vector
    }
}

/// Joint angles that bring a foot to a point in the torso's frame, or as near as the joints' ranges allow.
///
/// Damped Gauss-Newton steps from `start`, within the model's ranges; for the set-up of motions, not for the
/// control of forces. Allocates nothing.
pub fn leg_towards(
    model: &Model,
    start: &JointVector,
    leg: Leg,
    foot_in_torso: &Vector3<f64>,
) -> Vector3<f64> {
    const STEPS: usize = 40;
    const DAMPING: f64 = 1e-5;
    let mut joints = *start;
    for _ in 0..STEPS {
        let foot = FootKinematics::new(model, &joints, leg);
        let error = foot_in_torso - foot.position();
        let hessian = foot.linear.tr_mul(&foot.linear) + DAMPING * Matrix3::identity();
        let step = hessian.cholesky().map_or_else(Vector3::zeros, |f| f.solve(&foot.linear.tr_mul(&error)));
        for column in 0..3 {
            let joint = leg.first_joint() + column;
            let angle = joints[joint] + step[column].clamp(-0.2, 0.2);
            joints[joint] = angle.max(model.lower[joint]).min(model.upper[joint]);
        }
    }
    of_leg(&joints, leg)
}

/// The three numbers of a leg.
pub fn of_leg(vector: &JointVector, leg: Leg) -> Vector3<f64> {
    vector.fixed_rows::<3>(leg.first_joint()).into_owned()
}

/// A gripper relative to the torso, moved by its leg's and its arm's joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GripperKinematics {
    /// Pose of the gripper in the torso's frame.
    pub torso_from_gripper: Isometry3<f64>,
    /// Linear, then angular velocity of the gripper along the torso's axes, for the velocities of hip, thigh,
    /// calf and the arm's three joints.
    pub jacobian: Matrix6<f64>,
    /// Which joints those are.
    pub joints: [usize; 6],
}

impl GripperKinematics {
    /// Kinematics of one side's gripper.
    pub fn new(model: &Model, position: &JointVector, side: Side) -> Self {
        let (leg, arm) = (side.leg().first_joint(), side.first_arm_joint());
        let joints = [leg, leg + 1, leg + 2, arm, arm + 1, arm + 2];
        let torso_from_gripper = torso_from_frame(model, position, Frame::Gripper(side));
        let gripper = torso_from_gripper.translation.vector;
        let mut jacobian = Matrix6::zeros();
        for (column, joint) in joints.into_iter().enumerate() {
            let body = torso_from_body(model, position, joint);
            let axis = body.rotation * model.joints[joint].axis.into_inner();
            let linear = axis.cross(&(gripper - body.translation.vector));
            jacobian.fixed_view_mut::<3, 1>(0, column).copy_from(&linear);
            jacobian.fixed_view_mut::<3, 1>(3, column).copy_from(&axis);
        }
        Self { torso_from_gripper, jacobian, joints }
    }
}
