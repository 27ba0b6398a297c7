//! Kinematics relative to the torso: what the joint angles alone say, before the torso's pose is known.
//!
//! [`crate::dynamics`] computes the same in the world, with everything else; the estimator needs this before.

use nalgebra::{Isometry3, Matrix3, Matrix6, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::{
    joints::{JOINTS, JointVector, Leg, Side},
    model::{Frame, Model, PARENT},
};

/// Where the bodies are, in the torso's frame.
pub trait Bodies {
    /// Orientation and origin of the body that moves with a joint.
    fn pose(&self, joint: usize) -> (&Matrix3<f64>, &Vector3<f64>);

    /// Axis of the joint.
    fn axis(&self, joint: usize) -> &Vector3<f64>;
}

/// A body that moves with a joint, in the torso's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    rotation: Matrix3<f64>,
    origin: Vector3<f64>,
    axis: Vector3<f64>,
}

/// All bodies in one posture.
pub type BodyPoses = [Body; JOINTS];

/// Where all bodies are in a posture.
pub fn body_poses(model: &Model, position: &JointVector) -> BodyPoses {
    let home = Body { rotation: Matrix3::identity(), origin: Vector3::zeros(), axis: Vector3::zeros() };
    let mut bodies = [home; JOINTS];
    for joint in 0..JOINTS {
        let parent = PARENT[joint].map_or(&home, |parent| &bodies[parent]);
        bodies[joint] = next_body(model, position, joint, &parent.rotation, &parent.origin);
    }
    bodies
}

/// The body that a joint turns, on a parent that is placed.
fn next_body(
    model: &Model,
    position: &JointVector,
    joint: usize,
    rotation: &Matrix3<f64>,
    origin: &Vector3<f64>,
) -> Body {
    let own = &model.joints[joint];
    let placement = &own.parent_from_joint;
    let torso_from_joint = rotation * placement.rotation.to_rotation_matrix().matrix();
    let turn = Rotation3::from_axis_angle(&own.axis, position[joint]);
    Body {
        rotation: torso_from_joint * turn.matrix(),
        origin: rotation * placement.translation.vector + origin,
        axis: torso_from_joint * own.axis.into_inner(),
    }
}

impl Bodies for BodyPoses {
    fn pose(&self, joint: usize) -> (&Matrix3<f64>, &Vector3<f64>) {
        (&self[joint].rotation, &self[joint].origin)
    }

    fn axis(&self, joint: usize) -> &Vector3<f64> {
        &self[joint].axis
    }
}

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

/// J⁻¹ of a leg's joints, damped: Jᵀ (J Jᵀ + λ²)⁻¹ with λ = 1 mm/rad. A leg whose least singular value is 20 times as
/// long, nearly stretched, is still inverted to a quarter of a percent.
pub fn inverse_of_leg(linear: &Matrix3<f64>) -> Matrix3<f64> {
    const DAMPING: f64 = 1e-3;
    let square = linear * linear.transpose() + Matrix3::identity() * DAMPING.powi(2);
    linear.tr_mul(&square.try_inverse().unwrap_or_default())
}

/// How far a point of a joint's body, in the torso's frame, moves along a direction for each joint's angle, m/rad:
/// n · (a_j × (p - o_j)) for the joints between it and the torso. Of the torso's own points, nothing moves.
pub fn slope_of_point(
    bodies: &impl Bodies,
    joint: Option<usize>,
    point: &Vector3<f64>,
    direction: &Vector3<f64>,
) -> JointVector {
    let mut slope = JointVector::zeros();
    let mut above = joint;
    while let Some(joint) = above {
        let (_, origin) = bodies.pose(joint);
        slope[joint] = direction.dot(&bodies.axis(joint).cross(&(point - origin)));
        above = PARENT[joint];
    }
    slope
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
    const TOLERANCE_M: f64 = 1e-6;
    const DAMPING: f64 = 1e-5;
    let mut joints = *start;
    for _ in 0..STEPS {
        let foot = FootKinematics::new(model, &joints, leg);
        let error = foot_in_torso - foot.position();
        if error.norm() < TOLERANCE_M {
            break;
        }
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
        let joints = side.limb_joints();
        let (mut rotation, mut origin) = (Matrix3::identity(), Vector3::zeros());
        let (mut axes, mut origins) = ([Vector3::zeros(); 6], [Vector3::zeros(); 6]);
        for (column, joint) in joints.into_iter().enumerate() {
            let body = next_body(model, position, joint, &rotation, &origin);
            (rotation, origin) = (body.rotation, body.origin);
            (axes[column], origins[column]) = (body.axis, body.origin);
        }
        let torso_from_hand = Isometry3::from_parts(
            origin.into(),
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation)),
        );
        let torso_from_gripper = torso_from_hand * model.hand_from_gripper(side);
        let mut jacobian = Matrix6::zeros();
        for column in 0..6 {
            let linear = axes[column].cross(&(torso_from_gripper.translation.vector - origins[column]));
            jacobian.fixed_view_mut::<3, 1>(0, column).copy_from(&linear);
            jacobian.fixed_view_mut::<3, 1>(3, column).copy_from(&axes[column]);
        }
        Self { torso_from_gripper, jacobian, joints }
    }
}
