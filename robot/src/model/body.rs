//! A rigid body's inertia, and how two bodies that are bolted together become one.

use nalgebra::{Isometry3, Matrix3, Vector3};

/// Mass, centre of mass, and inertia about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidBody {
    /// kg.
    pub mass: f64,
    /// Centre of mass in the body's frame, m.
    pub com: Vector3<f64>,
    /// Inertia about the centre of mass, along the body's axes, kg m².
    pub inertia: Matrix3<f64>,
}

impl RigidBody {
    /// Nothing at all.
    pub fn massless() -> Self {
        Self { mass: 0.0, com: Vector3::zeros(), inertia: Matrix3::zeros() }
    }

    /// The same body, described in another frame.
    pub fn seen_from(&self, other_from_body: &Isometry3<f64>) -> Self {
        let rotation = other_from_body.rotation.to_rotation_matrix();
        Self {
            mass: self.mass,
            com: other_from_body.rotation * self.com + other_from_body.translation.vector,
            inertia: rotation * self.inertia * rotation.transpose(),
        }
    }

    /// Both bodies as one, by the parallel-axis theorem; both in the same frame.
    pub fn joined(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if mass == 0.0 {
            return Self::massless();
        }
        let com = (self.com * self.mass + other.com * other.mass) / mass;
        let about_com = |body: &Self| body.inertia + point_inertia(body.mass, &(body.com - com));
        Self { mass, com, inertia: about_com(self) + about_com(other) }
    }

    /// What makes the numbers those of no real body, if anything does.
    ///
    /// An inertia is one of a real body when its principal moments are positive and none exceeds the sum of
    /// the other two.
    pub fn flaw(&self) -> Option<&'static str> {
        /// Room for the rounding of published figures, as a share of the greatest moment.
        const ROUNDING: f64 = 1e-6;
        let numbers = self.com.iter().chain(self.inertia.iter());
        if !self.mass.is_finite() || numbers.clone().any(|number| !number.is_finite()) {
            return Some("a number that is not finite");
        }
        if self.mass < 0.0 {
            return Some("a negative mass");
        }
        let moments = self.inertia.symmetric_eigenvalues();
        let greatest = moments.max();
        if self.mass == 0.0 {
            return (moments.amax() > 0.0).then_some("inertia without mass");
        }
        if moments.min() <= 0.0 {
            return Some("a principal moment of inertia that is not positive");
        }
        if 2.0 * greatest > moments.sum() + ROUNDING * greatest {
            return Some("a principal moment of inertia above the sum of the other two");
        }
        None
    }
}

/// Inertia of a point mass at `offset`, about the origin: m (|c|² 1 - c cᵀ).
pub(crate) fn point_inertia(mass: f64, offset: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * offset.norm_squared() - offset * offset.transpose()) * mass
}
