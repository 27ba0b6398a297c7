//! Poses of messages and poses of [`nalgebra`], checked where they enter.
//!
//! Past this point a pose is finite and its rotation a rotation; nothing downstream asks again.

use crate::messages::{Pose, Quaternion, Vector3};
use nalgebra as na;

/// How far the norm of a received quaternion may be off 1; it is normalized after.
///
/// Doubles on the wire are good to 1e-16: anything near this bound is a mistake of the sender's, anything
/// beyond is not a rotation.
pub const QUATERNION_NORM_TOLERANCE: f64 = 1e-3;

/// Why a pose is not one.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PoseError {
    /// Position or orientation was left out.
    #[error("the pose has no {0}")]
    Missing(&'static str),
    /// Not a number, or infinite.
    #[error("the pose has a {0} that is not finite")]
    NotFinite(&'static str),
    /// Not a rotation.
    #[error("the pose's quaternion has norm {norm}, not 1 within {QUATERNION_NORM_TOLERANCE}")]
    NotUnit {
        /// Its norm.
        norm: f64,
    },
}

/// The isometry of a pose message.
pub fn isometry(pose: &Pose) -> Result<na::Isometry3<f64>, PoseError> {
    let p = pose.position_m.as_ref().ok_or(PoseError::Missing("position"))?;
    let q = pose.orientation.as_ref().ok_or(PoseError::Missing("orientation"))?;
    let position = na::Vector3::new(p.x, p.y, p.z);
    let quaternion = na::Quaternion::new(q.w, q.x, q.y, q.z);
    if !position.iter().all(|value| value.is_finite()) {
        return Err(PoseError::NotFinite("position"));
    }
    if !quaternion.coords.iter().all(|value| value.is_finite()) {
        return Err(PoseError::NotFinite("quaternion"));
    }
    let norm = quaternion.norm();
    if (norm - 1.0).abs() > QUATERNION_NORM_TOLERANCE {
        return Err(PoseError::NotUnit { norm });
    }
    let rotation = na::UnitQuaternion::new_normalize(quaternion);
    Ok(na::Isometry3::from_parts(position.into(), rotation))
}

/// The pose message of an isometry.
pub fn pose(isometry: &na::Isometry3<f64>) -> Pose {
    let (p, q) = (&isometry.translation.vector, isometry.rotation.quaternion());
    Pose {
        position_m: Some(Vector3 { x: p.x, y: p.y, z: p.z }),
        orientation: Some(Quaternion { w: q.w, x: q.i, y: q.j, z: q.k }),
    }
}

impl From<&na::Isometry3<f64>> for Pose {
    fn from(isometry: &na::Isometry3<f64>) -> Self {
        pose(isometry)
    }
}

impl TryFrom<&Pose> for na::Isometry3<f64> {
    type Error = PoseError;

    fn try_from(pose: &Pose) -> Result<Self, PoseError> {
        isometry(pose)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn message(q: [f64; 4], p: [f64; 3]) -> Pose {
        Pose {
            position_m: Some(Vector3 { x: p[0], y: p[1], z: p[2] }),
            orientation: Some(Quaternion { w: q[0], x: q[1], y: q[2], z: q[3] }),
        }
    }

    #[test]
    fn what_is_not_a_pose_is_refused_with_the_reason() {
        let good = message([1.0, 0.0, 0.0, 0.0], [0.0; 3]);
        assert!(isometry(&good).is_ok());
        assert_eq!(isometry(&Pose { position_m: None, ..good }), Err(PoseError::Missing("position")));
        assert_eq!(isometry(&Pose { orientation: None, ..good }), Err(PoseError::Missing("orientation")));
        assert_eq!(
            isometry(&message([1.0, 0.0, 0.0, 0.0], [0.0, f64::NAN, 0.0])),
            Err(PoseError::NotFinite("position"))
        );
        assert_eq!(
            isometry(&message([f64::INFINITY, 0.0, 0.0, 0.0], [0.0; 3])),
            Err(PoseError::NotFinite("quaternion"))
        );
        assert_eq!(isometry(&message([0.0; 4], [0.0; 3])), Err(PoseError::NotUnit { norm: 0.0 }));
        assert!(matches!(
            isometry(&message([1.002, 0.0, 0.0, 0.0], [0.0; 3])),
            Err(PoseError::NotUnit { .. })
        ));
    }

    proptest! {
        #[test]
        fn poses_survive_the_round_trip(
            p in prop::array::uniform3(-1e3..1e3f64),
            axis in prop::array::uniform3(-3.0..3.0f64),
        ) {
            let before = na::Isometry3::new(p.into(), axis.into());
            let after = isometry(&pose(&before)).unwrap();
            prop_assert!((before.inverse() * after).rotation.angle() < 1e-12);
            prop_assert_eq!(before.translation, after.translation);
        }

        #[test]
        fn any_numbers_give_a_rotation_or_an_error(
            q in prop::array::uniform4(any::<f64>()),
            p in prop::array::uniform3(any::<f64>()),
        ) {
            if let Ok(isometry) = isometry(&message(q, p)) {
                prop_assert!((isometry.rotation.norm() - 1.0).abs() < 1e-9);
                prop_assert!(isometry.translation.vector.iter().all(|v| v.is_finite()));
            }
        }
    }
}
