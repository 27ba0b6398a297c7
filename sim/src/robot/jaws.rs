//! The jaws: two hinged fingers that the URDF's rigid end effector does not have.
//!
//! They are taken out of the end effector's mass, so that with closed jaws the robot weighs exactly what the
//! controller believes. Each turns about an axis along x of the grasp frame and opens along y; the tips point
//! to -z (facts from the published meshes, which are rigid: the pivots are an estimate).

use locoman_robot::model::RigidBody;
use nalgebra::{Matrix3, Vector3};

/// Pivot and tip of the +y jaw's axis in the grasp frame, m.
const PIVOT: Vector3<f64> = Vector3::new(0.0, 0.010, 0.018);
const TIP: Vector3<f64> = Vector3::new(0.0, 0.004, -0.0195);
/// Half of the thickness of a jaw, m.
pub const JAW_RADIUS_M: f64 = 0.004;

/// One jaw: `sign` +1 is on the side of +y.
#[derive(Debug, Clone, Copy)]
pub struct Jaw {
    /// +1 or -1.
    pub sign: f64,
    /// kg.
    pub mass: f64,
}

impl Jaw {
    /// Pivot in the grasp frame.
    pub fn pivot(&self) -> Vector3<f64> {
        self.mirrored(PIVOT)
    }

    /// Tip in the jaw's own frame (origin at the pivot, axes of the grasp frame when closed).
    pub fn tip(&self) -> Vector3<f64> {
        self.mirrored(TIP - PIVOT)
    }

    /// Mass properties in the jaw's own frame: a rod from pivot to tip, a tenth of its length thick.
    pub fn body(&self) -> RigidBody {
        let across = self.mass * self.tip().norm_squared() / 12.0;
        let inertia = Matrix3::from_diagonal(&Vector3::new(across, across, 0.1 * across));
        RigidBody { mass: self.mass, com: self.tip() / 2.0, inertia }
    }

    fn mirrored(&self, point: Vector3<f64>) -> Vector3<f64> {
        Vector3::new(point.x, self.sign * point.y, point.z)
    }
}

/// What is left of a body when a part (in the same frame) is taken out: the parallel-axis theorem backwards.
pub fn without(whole: &RigidBody, part: &RigidBody) -> RigidBody {
    let mass = whole.mass - part.mass;
    let com = (whole.com * whole.mass - part.com * part.mass) / mass;
    let about_com = |body: &RigidBody| {
        let d = body.com - com;
        body.inertia + body.mass * (Matrix3::identity() * d.norm_squared() - d * d.transpose())
    };
    RigidBody { mass, com, inertia: about_com(whole) - about_com(part) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn putting_a_part_back_gives_the_whole() {
        let whole =
            RigidBody { mass: 2.0, com: Vector3::new(0.1, 0.0, -0.2), inertia: Matrix3::identity() * 0.01 };
        let part =
            RigidBody { mass: 0.3, com: Vector3::new(0.0, 0.05, 0.1), inertia: Matrix3::identity() * 0.001 };
        let again = without(&whole, &part).joined(&part);
        assert!((again.mass - whole.mass).abs() < 1e-12);
        assert!((again.com - whole.com).norm() < 1e-12);
        assert!((again.inertia - whole.inertia).norm() < 1e-12);
    }
}
