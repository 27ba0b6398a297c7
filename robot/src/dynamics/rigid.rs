//! Spatial vectors and inertias, all in one frame: along the torso's axes, about the torso's origin.
//!
//! With every body described in one frame at one point, composite inertias add up, forces add up, and no
//! body-to-body transforms are left (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 2). The
//! torso's frame is the natural one: v starts with the torso's twist in it.

use nalgebra::{Matrix3, Vector3};

use crate::model::RigidBody;

/// Twist or its rate: of the body's point at the origin, and angular.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spatial {
    pub(super) linear: Vector3<f64>,
    pub(super) angular: Vector3<f64>,
}

impl Spatial {
    pub(super) const ZERO: Self =
        Self { linear: Vector3::new(0.0, 0.0, 0.0), angular: Vector3::new(0.0, 0.0, 0.0) };

    /// Motion of unit speed about an axis through a point: the column of S.
    pub(super) fn about(axis: Vector3<f64>, point: &Vector3<f64>) -> Self {
        Self { linear: point.cross(&axis), angular: axis }
    }

    pub(super) fn plus(&self, other: &Self, factor: f64) -> Self {
        Self { linear: self.linear + other.linear * factor, angular: self.angular + other.angular * factor }
    }

    /// v × m: rate of a motion vector that is fixed to a body moving with v.
    pub(super) fn cross(&self, motion: &Self) -> Self {
        Self {
            linear: self.angular.cross(&motion.linear) + self.linear.cross(&motion.angular),
            angular: self.angular.cross(&motion.angular),
        }
    }

    /// v ×* f: rate of a force vector that is fixed to a body moving with v.
    pub(super) fn cross_force(&self, force: &Wrench) -> Wrench {
        Wrench {
            force: self.angular.cross(&force.force),
            moment: self.angular.cross(&force.moment) + self.linear.cross(&force.force),
        }
    }

    /// Acceleration of the body's point at `point`, of a spatial acceleration: that lacks the turning of the point's
    /// velocity, ω × ṗ.
    pub(super) fn of_point(&self, point: &Vector3<f64>, velocity: &Self) -> Vector3<f64> {
        self.at(point) + velocity.angular.cross(&velocity.at(point))
    }

    /// Velocity of the body's point at `point`.
    pub(super) fn at(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.linear + self.angular.cross(point)
    }

    /// Power of a wrench.
    pub(super) fn dot(&self, wrench: &Wrench) -> f64 {
        self.linear.dot(&wrench.force) + self.angular.dot(&wrench.moment)
    }
}

/// Force, and moment about the origin.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wrench {
    pub(super) force: Vector3<f64>,
    pub(super) moment: Vector3<f64>,
}

impl Wrench {
    pub(super) const ZERO: Self =
        Self { force: Vector3::new(0.0, 0.0, 0.0), moment: Vector3::new(0.0, 0.0, 0.0) };

    pub(super) fn add(&mut self, other: &Self) {
        self.force += other.force;
        self.moment += other.moment;
    }
}

/// Inertia about the origin: mass, first moment, and second moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inertia {
    pub(super) mass: f64,
    /// m c
    pub(super) moment: Vector3<f64>,
    /// I_c + m (|c|² 1 - c cᵀ)
    pub(super) rotational: Matrix3<f64>,
}

impl Inertia {
    pub(super) const ZERO: Self =
        Self { mass: 0.0, moment: Vector3::new(0.0, 0.0, 0.0), rotational: zero3() };

    /// Of a body whose frame is turned by `rotation` and sits at `position`.
    pub(super) fn of(body: &RigidBody, rotation: &Matrix3<f64>, position: &Vector3<f64>) -> Self {
        let com = rotation * body.com + position;
        Self {
            mass: body.mass,
            moment: com * body.mass,
            rotational: rotation * body.inertia * rotation.transpose()
                + crate::model::point_inertia(body.mass, &com),
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.moment += other.moment;
        self.rotational += other.rotational;
    }

    /// I v: momentum, or the force that makes an acceleration.
    pub(super) fn times(&self, motion: &Spatial) -> Wrench {
        Wrench {
            force: motion.linear * self.mass + motion.angular.cross(&self.moment),
            moment: self.rotational * motion.angular + self.moment.cross(&motion.linear),
        }
    }
}

const fn zero3() -> Matrix3<f64> {
    Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
}
