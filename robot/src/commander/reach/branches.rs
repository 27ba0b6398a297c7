//! All joint angles that bring a gripper to a pose, in closed form.
//!
//! Thigh, calf and the arm's first joint turn about parallel axes y, the hip and the arm's second joint about x,
//! the third about z: with φ = q2 + q3 + q4
//!
//! ```text
//! R = Rx(q1) Ry(φ) Rx(q5) Rz(q6)
//! ```
//! and where the axes of q5 and q6 meet, p = p_target - R d, depends on the first four joints. As for arms with
//! three parallel axes (Hawkins, "Analytic inverse kinematics for the Universal Robots UR-5/UR-10 arms", 2013),
//! p gives two angles of the hip, the direction of the gripper's z two of the wrist, and the triangle of thigh and
//! calf two of the knee: eight branches. Where q5 = ±90 degrees the axes of q4 and q6 coincide; one of the
//! infinitely many solutions is given there.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Rotation3, Vector2, Vector3, Vector6};

use crate::{joints::Side, model::Model};

/// The lengths that the branches depend on.
#[derive(Debug, Clone, Copy)]
struct Lengths {
    /// The hip's origin in the torso.
    hip: Vector3<f64>,
    /// The thigh's in the hip.
    thigh: Vector3<f64>,
    /// The calf's in the thigh.
    calf: Vector3<f64>,
    /// The arm's in the calf.
    arm: Vector3<f64>,
    /// The second arm joint's in the first's.
    wrist: Vector3<f64>,
    /// The third's in the second's.
    hand: Vector3<f64>,
}

impl Lengths {
    fn new(model: &Model, side: Side) -> Self {
        let [hip, thigh, calf, arm, wrist, hand] =
            side.limb_joints().map(|joint| model.joints[joint].parent_from_joint.translation.vector);
        Self { hip, thigh, calf, arm, wrist, hand }
    }
}

/// The joint angles of each branch, every angle within half a turn of zero; fewer than eight where the pose is
/// too far for some.
pub(super) fn branches(
    model: &Model,
    side: Side,
    torso_from_gripper: &Isometry3<f64>,
) -> impl Iterator<Item = Vector6<f64>> {
    let lengths = Lengths::new(model, side);
    let torso_from_hand = torso_from_gripper * model.hand_from_gripper(side).inverse();
    let rotation = torso_from_hand.rotation.to_rotation_matrix();
    let wrist_in_torso = torso_from_hand.translation.vector - rotation * lengths.hand - lengths.hip;
    const SIGNS: [f64; 2] = [1.0, -1.0];
    let combinations = SIGNS.into_iter().flat_map(|hip| SIGNS.map(|wrist| (hip, wrist)));
    combinations.flat_map(|(hip, wrist)| SIGNS.map(|knee| (hip, wrist, knee))).filter_map(
        move |(hip, wrist, knee)| {
            // y of the wrist in the hip's frame does not change: r cos(q1 - α) = d.
            let [_, y, z] = wrist_in_torso.into();
            let sideways = lengths.thigh.y + lengths.calf.y + lengths.arm.y + lengths.wrist.y;
            let q1 = z.atan2(y) + hip * arc(sideways / y.hypot(z))?;
            let hip_from_torso = Rotation3::from_axis_angle(&Vector3::x_axis(), -q1);
            // Ry(φ) Rx(q5) Rz(q6)
            let turn = hip_from_torso * rotation;
            let cosine = wrist * (1.0 - turn[(1, 2)].powi(2)).max(0.0).sqrt();
            let q5 = (-turn[(1, 2)]).atan2(cosine);
            let q6 = (wrist * turn[(1, 0)]).atan2(wrist * turn[(1, 1)]);
            let pitch = (wrist * turn[(0, 2)]).atan2(wrist * turn[(2, 2)]);
            // Thigh and calf: a triangle in the plane of x and z.
            let forearm = turned(&lengths.wrist, pitch);
            let to_wrist = hip_from_torso * wrist_in_torso;
            let reach = flat(&to_wrist) - flat(&lengths.thigh) - forearm;
            let (upper, lower) = (flat(&lengths.calf), flat(&lengths.arm));
            let bend = arc((reach.norm_squared() - upper.norm_squared() - lower.norm_squared())
                / (2.0 * upper.norm() * lower.norm()))?;
            let q3 = knee * bend - angle(&upper, &lower);
            let q2 = angle(&(upper + turned(&lengths.arm, q3)), &reach);
            Some([q1, q2, q3, pitch - q2 - q3, q5, q6].map(wrapped).into())
        },
    )
}

/// Seen along the y axis.
fn flat(vector: &Vector3<f64>) -> Vector2<f64> {
    Vector2::new(vector.x, vector.z)
}

/// Turned about the y axis, seen along it.
fn turned(vector: &Vector3<f64>, by: f64) -> Vector2<f64> {
    let (sin, cos) = by.sin_cos();
    Vector2::new(cos * vector.x + sin * vector.z, cos * vector.z - sin * vector.x)
}

/// By how much a turn about y takes the direction of `from` to that of `to`.
fn angle(from: &Vector2<f64>, to: &Vector2<f64>) -> f64 {
    (from.y * to.x - from.x * to.y).atan2(from.dot(to))
}

/// Arc cosine; nothing without one.
fn arc(cosine: f64) -> Option<f64> {
    (cosine.abs() <= 1.0).then(|| cosine.acos())
}

/// Within half a turn of zero.
fn wrapped(angle: f64) -> f64 {
    angle - TAU * ((angle + PI) / TAU).floor()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{
        joints::JointVector,
        kinematics::torso_from_frame,
        model::{Frame, test_model},
    };

    proptest! {
        #[test]
        fn every_branch_reaches_the_pose_and_one_is_where_the_joints_are(
            angles in prop::array::uniform6(-3.1..3.1f64), left in any::<bool>(),
        ) {
            let model = test_model();
            let side = if left { Side::Left } else { Side::Right };
            let mut joints = JointVector::zeros();
            let put = |joints: &mut JointVector, limb: &Vector6<f64>| {
                for (joint, angle) in side.limb_joints().into_iter().zip(limb.iter()) {
                    joints[joint] = *angle;
                }
            };
            put(&mut joints, &angles.into());
            let pose = torso_from_frame(&model, &joints, Frame::Gripper(side));
            let mut nearest = f64::INFINITY;
            for branch in branches(&model, side, &pose) {
                put(&mut joints, &branch);
                let reached = torso_from_frame(&model, &joints, Frame::Gripper(side));
                prop_assert!((reached.translation.vector - pose.translation.vector).norm() < 1e-6);
                prop_assert!(reached.rotation.angle_to(&pose.rotation) < 1e-6);
                let apart = branch.iter().zip(&angles).map(|(a, b)| wrapped(a - b).abs());
                nearest = nearest.min(apart.fold(0.0, f64::max));
            }
            // Where two branches meet, rounding decides whether there is one.
            let meet = angles[4].cos().abs().min(angles[2].sin().abs()) < 1e-3;
            prop_assert!(meet || nearest < 1e-4, "{nearest}");
        }
    }
}
