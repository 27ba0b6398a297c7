//! How the object moves: a pose of its own for each instant, or one smooth path.
//!
//! Cameras that are exposed together see the object in one pose: [`Motion::Instants`]. Those that are not, or whose
//! rows are exposed one after the other, see it on its way: [`Motion::Path`], a cumulative cubic B-spline over evenly
//! spaced controls (Sommer et al., "Efficient derivative computation for cumulative B-splines on Lie groups", 2020),
//! positions and rotations apart:
//!
//! ```text
//! p(u) = Σ b_j(u) p_j         R(u) = R_0 exp(β_1 d_1) exp(β_2 d_2) exp(β_3 d_3)     d_j = log(R_{j−1}ᵀ R_j)
//! ```
//!
//! Perturbations: p ← p + δp in world axes, R ← R exp(δφ).

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use super::rotation::{left_jacobian_inverse, right_jacobian, right_jacobian_inverse, turned};

/// Controls that a moment of a path depends on.
pub(super) const CONTROLS: usize = 4;

/// The object's poses in the world, over time.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// `world_from_object`, one an instant, each of its own.
    Instants(Vec<Isometry3<f64>>),
    /// A smooth path.
    Path(Path),
}

/// A cumulative cubic B-spline. Times are seconds after the problem's first capture.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// When the first segment begins: the second control's time.
    pub start_s: f64,
    /// Time between two controls.
    pub step_s: f64,
    /// `world_from_object` of the controls, three more than there are segments.
    pub controls: Vec<Isometry3<f64>>,
}

/// The object at one moment, and what it depends on.
#[derive(Debug, Clone)]
pub(super) struct Moment {
    /// The first control (or the instant) that it depends on.
    pub first: usize,
    /// How many from there on: 1 or [`CONTROLS`].
    pub count: usize,
    pub world_from_object: Isometry3<f64>,
    /// Velocity of the origin, world axes.
    pub velocity_m_s: Vector3<f64>,
    /// Acceleration of the origin, world axes.
    pub acceleration_m_s2: Vector3<f64>,
    /// Angular velocity, object axes.
    pub rate_rad_s: Vector3<f64>,
    /// ∂p/∂p_j.
    pub by_position: [f64; CONTROLS],
    /// ∂φ/∂φ_j.
    pub by_rotation: [Matrix3<f64>; CONTROLS],
}

impl Motion {
    /// Blocks of six parameters.
    pub fn blocks(&self) -> usize {
        match self {
            Self::Instants(poses) => poses.len(),
            Self::Path(path) => path.controls.len(),
        }
    }

    /// How many blocks beyond itself a block meets in one measurement.
    pub(super) fn reach(&self) -> usize {
        match self {
            Self::Instants(_) => 0,
            Self::Path(_) => CONTROLS - 1,
        }
    }

    pub(super) fn poses_mut(&mut self) -> &mut [Isometry3<f64>] {
        match self {
            Self::Instants(poses) => poses,
            Self::Path(path) => &mut path.controls,
        }
    }

    /// The moment of an instant, or of a time; `None` outside.
    pub(super) fn at(&self, instant: usize, time_s: f64) -> Option<Moment> {
        match self {
            Self::Instants(poses) => Some(Moment {
                first: instant,
                count: 1,
                world_from_object: *poses.get(instant)?,
                velocity_m_s: Vector3::zeros(),
                acceleration_m_s2: Vector3::zeros(),
                rate_rad_s: Vector3::zeros(),
                by_position: [1.0, 0.0, 0.0, 0.0],
                by_rotation: [Matrix3::identity(), Matrix3::zeros(), Matrix3::zeros(), Matrix3::zeros()],
            }),
            Self::Path(path) => path.at(time_s),
        }
    }
}

impl Moment {
    /// The pose a few milliseconds later or earlier.
    pub fn pose_after(&self, dt_s: f64) -> Isometry3<f64> {
        if dt_s == 0.0 {
            return self.world_from_object;
        }
        let shift_m = self.velocity_m_s * dt_s + self.acceleration_m_s2 * (0.5 * dt_s * dt_s);
        moved(&self.world_from_object, &shift_m, &(self.rate_rad_s * dt_s))
    }
}

impl Path {
    /// A path through a span of time, with margins, whose controls are where `pose_at` says.
    pub fn through(
        first_s: f64,
        last_s: f64,
        step_s: f64,
        margin_s: f64,
        pose_at: impl Fn(f64) -> Isometry3<f64>,
    ) -> Self {
        let start_s = first_s - margin_s;
        let segments = ((last_s + margin_s - start_s) / step_s).ceil().max(1.0) as usize;
        let controls =
            (0..segments + CONTROLS - 1).map(|k| pose_at(start_s + (k as f64 - 1.0) * step_s)).collect();
        Self { start_s, step_s, controls }
    }

    /// Where the object is; `None` outside of the path.
    pub fn pose_at(&self, time_s: f64) -> Option<Isometry3<f64>> {
        self.at(time_s).map(|moment| moment.world_from_object)
    }

    fn at(&self, time_s: f64) -> Option<Moment> {
        let place = (time_s - self.start_s) / self.step_s;
        if place.is_nan() || place < 0.0 {
            return None;
        }
        let first = place as usize;
        let controls = self.controls.get(first..first + CONTROLS)?;
        let u = place - first as f64;
        let (u2, u3) = (u * u, u * u * u);
        let basis = [
            (1.0 - 3.0 * u + 3.0 * u2 - u3) / 6.0,
            (4.0 - 6.0 * u2 + 3.0 * u3) / 6.0,
            (1.0 + 3.0 * u + 3.0 * u2 - 3.0 * u3) / 6.0,
            u3 / 6.0,
        ];
        let slope = [
            (-1.0 + 2.0 * u - u2) / 2.0,
            (-4.0 * u + 3.0 * u2) / 2.0,
            (1.0 + 2.0 * u - 3.0 * u2) / 2.0,
            u2 / 2.0,
        ]
        .map(|slope| slope / self.step_s);
        let bend = [1.0 - u, 3.0 * u - 2.0, 1.0 - 3.0 * u, u].map(|bend| bend / self.step_s.powi(2));
        let blend = |weights: &[f64; CONTROLS]| -> Vector3<f64> {
            controls.iter().zip(weights).map(|(control, weight)| control.translation.vector * *weight).sum()
        };
        let turn = Turn::new(controls, &basis, &slope);
        Some(Moment {
            first,
            count: CONTROLS,
            world_from_object: Isometry3::from_parts(Translation3::from(blend(&basis)), turn.rotation),
            velocity_m_s: blend(&slope),
            acceleration_m_s2: blend(&bend),
            rate_rad_s: turn.rate_rad_s,
            by_position: basis,
            by_rotation: turn.by_rotation,
        })
    }
}

/// The rotations of four controls, blended.
struct Turn {
    rotation: UnitQuaternion<f64>,
    rate_rad_s: Vector3<f64>,
    by_rotation: [Matrix3<f64>; CONTROLS],
}

impl Turn {
    fn new(controls: &[Isometry3<f64>], basis: &[f64; CONTROLS], slope: &[f64; CONTROLS]) -> Self {
        let mut by_rotation = [Matrix3::zeros(); CONTROLS];
        let mut rate_rad_s = Vector3::zeros();
        // (E_{j+1} … E_3)ᵀ, built from the last factor backwards.
        let mut after = Matrix3::identity();
        let mut rotation = UnitQuaternion::identity();
        for j in (1..CONTROLS).rev() {
            let weight: f64 = basis[j..].iter().sum();
            let weight_slope: f64 = slope[j..].iter().sum();
            let d = (controls[j - 1].rotation.inverse() * controls[j].rotation).scaled_axis();
            let by_d = after * right_jacobian(&(d * weight)) * weight;
            by_rotation[j] += by_d * right_jacobian_inverse(&d);
            by_rotation[j - 1] -= by_d * left_jacobian_inverse(&d);
            rate_rad_s += after * d * weight_slope;
            let factor = UnitQuaternion::from_scaled_axis(d * weight);
            after *= factor.inverse().to_rotation_matrix().into_inner();
            rotation = factor * rotation;
        }
        by_rotation[0] += after;
        Self { rotation: controls[0].rotation * rotation, rate_rad_s, by_rotation }
    }
}

/// Moves a pose along a perturbation.
pub(super) fn moved(
    pose: &Isometry3<f64>,
    shift_m: &Vector3<f64>,
    turn_rad: &Vector3<f64>,
) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::from(pose.translation.vector + shift_m),
        turned(&pose.rotation, turn_rad),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path() -> Path {
        let pose = |t: f64| {
            Isometry3::new(
                Vector3::new((3.0 * t).sin(), t * t, 0.2 * (5.0 * t).cos()),
                Vector3::new(2.0 * t, (4.0 * t).sin(), -t),
            )
        };
        Path::through(0.0, 1.0, 0.1, 0.05, pose)
    }

    #[test]
    fn a_path_knows_its_velocity_and_its_rate() {
        const STEP_S: f64 = 1e-5;
        let sut = path();
        let (moment, before, after) = (
            sut.at(0.437).expect("inside"),
            sut.pose_at(0.437 - STEP_S).expect("inside"),
            sut.pose_at(0.437 + STEP_S).expect("inside"),
        );
        let velocity = (after.translation.vector - before.translation.vector) / (2.0 * STEP_S);
        assert!((velocity - moment.velocity_m_s).norm() < 1e-6);
        let rate = (before.rotation.inverse() * after.rotation).scaled_axis() / (2.0 * STEP_S);
        assert!((rate - moment.rate_rad_s).norm() < 1e-5, "{rate} {}", moment.rate_rad_s);
        assert!(sut.pose_at(-0.2).is_none() && sut.pose_at(1.3).is_none() && sut.pose_at(f64::NAN).is_none());
    }

    #[test]
    fn derivatives_by_controls_are_those_of_the_path() {
        const STEP: f64 = 1e-6;
        let sut = path();
        let time_s = 0.512;
        let moment = sut.at(time_s).expect("inside");
        for j in 0..CONTROLS {
            for axis in 0..3 {
                let unit = Vector3::from_fn(|row, _| f64::from(u8::from(row == axis)));
                let at = |sign: f64| {
                    let mut other = sut.clone();
                    let control = &mut other.controls[moment.first + j];
                    *control = moved(control, &(unit * STEP * sign), &(unit * STEP * sign));
                    other.pose_at(time_s).expect("inside")
                };
                let (low, high) = (at(-1.0), at(1.0));
                let turn = (low.rotation.inverse() * high.rotation).scaled_axis() / (2.0 * STEP);
                assert!((turn - moment.by_rotation[j].column(axis)).norm() < 1e-7, "{j} {axis}");
                let shift = (high.translation.vector - low.translation.vector) / (2.0 * STEP);
                assert!((shift - unit * moment.by_position[j]).norm() < 1e-8, "{j} {axis}");
            }
        }
    }
}
