//! One tag in one view as eight whitened residuals, each corner at its own time.
//!
//! # Equations
//! A corner X (shell frame) that camera c, with pose (R_c, t_c), exposed dt after the reference time:
//!
//! ```text
//! y = exp(ω dt) X        r = π(R_cᵀ (R y + p + v dt − t_c)) − z      π: projection with the lens
//! B = ∂π/∂x_c R_cᵀ       ∂r/∂p = B    ∂r/∂θ = −B R [y]×    ∂r/∂v = dt B    ∂r/∂ω = −dt B R [y]× J_l(ω dt)
//! ```
//!
//! J_l is the left Jacobian of SO(3). The eight residuals of a tag are multiplied with L⁻¹, where L Lᵀ is the
//! covariance of its corners plus the floor: what calibration and print leave.

use nalgebra::{Isometry3, Matrix3, Point2, Point3, SMatrix, SVector, Vector3};

use super::state::State;
use super::{Observation, Views};
use crate::camera::Camera;
use crate::detect::CornerCovariance;

/// Squared residual of a tag that a pose puts behind the camera.
pub(super) const BEHIND: f64 = 1e8;

/// A camera as the solver needs it.
#[derive(Debug, Clone)]
pub(super) struct View {
    camera_from_world: Isometry3<f64>,
    rotation: Matrix3<f64>,
}

impl View {
    pub fn new(camera: &Camera) -> Self {
        let camera_from_world = camera.world_from_camera.inverse();
        Self { rotation: camera_from_world.rotation.to_rotation_matrix().into_inner(), camera_from_world }
    }
}

/// An observation, prepared.
#[derive(Debug, Clone)]
pub(super) struct Term {
    pub camera: usize,
    corners: [Vector3<f64>; 4],
    measured_px: [Point2<f64>; 4],
    /// When each corner was exposed, after the reference time.
    dt_s: [f64; 4],
    /// L⁻¹, lower triangular.
    whitening: CornerCovariance,
}

/// A term at one state.
#[derive(Debug, Clone)]
pub(super) struct Linear {
    /// Whitened.
    pub residual: SVector<f64, 8>,
    /// Whitened, by the tangent.
    pub jacobian: SMatrix<f64, 8, 12>,
    /// |residual|², or [`BEHIND`].
    pub squared: f64,
}

impl Linear {
    pub fn new() -> Self {
        Self { residual: SVector::zeros(), jacobian: SMatrix::zeros(), squared: BEHIND }
    }
}

impl Term {
    /// `None` if the camera or the tag does not exist, or the covariance is none.
    pub fn new(views: &Views<'_>, observation: &Observation, floor_px: f64, variance: f64) -> Option<Self> {
        let camera = views.cameras.get(observation.camera)?;
        let tag = views.shell.tags.get(observation.tag)?;
        let mut covariance = observation.covariance_px2;
        for k in 0..8 {
            covariance[(k, k)] += floor_px * floor_px;
        }
        let factor = (covariance * variance).cholesky()?.unpack();
        let whitening = factor.solve_lower_triangular(&CornerCovariance::identity())?;
        let since_s = seconds_between(views.time_ns, observation.capture_ns);
        let finite = observation.corners_px.iter().all(|corner| corner.coords.iter().all(|c| c.is_finite()));
        finite.then(|| Self {
            camera: observation.camera,
            corners: tag.corners().map(|corner| corner.coords),
            measured_px: observation.corners_px,
            dt_s: observation.corners_px.map(|corner| since_s + camera.row_delay_s(corner.y)),
            whitening,
        })
    }

    /// Residuals and derivatives at a state.
    pub fn linearize(&self, views: &Views<'_>, eyes: &[View], state: &State, linear: &mut Linear) {
        linear.squared = BEHIND;
        let (Some(camera), Some(eye)) = (views.cameras.get(self.camera), eyes.get(self.camera)) else {
            return;
        };
        let rotation = state.world_from_shell.rotation.to_rotation_matrix().into_inner();
        let mut residual = SVector::<f64, 8>::zeros();
        let mut jacobian = SMatrix::<f64, 8, 12>::zeros();
        for c in 0..4 {
            let dt_s = self.dt_s[c];
            let arc = Arc::new(state.rate_rad_s * dt_s);
            let turned = arc.turn(&self.corners[c]);
            let in_world =
                rotation * turned + state.world_from_shell.translation.vector + state.velocity_m_s * dt_s;
            let in_camera = Point3::from(eye.rotation * in_world + eye.camera_from_world.translation.vector);
            let Some((pixel, by_point)) = camera.project_with_jacobian(&in_camera) else { return };
            let by_position = by_point * eye.rotation;
            for axis in 0..2 {
                let row = 2 * c + axis;
                residual[row] = pixel[axis] - self.measured_px[c][axis];
                let by_p: Vector3<f64> = by_position.row(axis).transpose();
                let by_theta = turned.cross(&rotation.tr_mul(&by_p));
                let by_omega = arc.left_jacobian_transposed(&by_theta) * dt_s;
                for k in 0..3 {
                    jacobian[(row, k)] = by_p[k];
                    jacobian[(row, 3 + k)] = by_theta[k];
                    jacobian[(row, 6 + k)] = by_p[k] * dt_s;
                    jacobian[(row, 9 + k)] = by_omega[k];
                }
            }
        }
        linear.residual = self.whitening * residual;
        linear.jacobian = self.whitening * jacobian;
        linear.squared = linear.residual.norm_squared();
    }

    /// Sum of the squared residual lengths in pixels at a state; `None` behind the camera.
    pub fn squares_px2(&self, views: &Views<'_>, state: &State) -> Option<f64> {
        let camera = views.cameras.get(self.camera)?;
        let mut sum = 0.0;
        for c in 0..4 {
            let pose = state.pose_after(self.dt_s[c]);
            let in_camera = camera.world_from_camera.inverse() * (pose * Point3::from(self.corners[c]));
            sum += (camera.project(&in_camera)? - self.measured_px[c]).norm_squared();
        }
        Some(sum)
    }

    /// Whether the printed side looks at the camera.
    pub fn faces(&self, views: &Views<'_>, state: &State) -> bool {
        let Some(camera) = views.cameras.get(self.camera) else { return false };
        let [a, b, _, d] = &self.corners;
        let pose = state.pose_after(self.dt_s[0]);
        let eye = pose.inverse() * Point3::from(camera.world_from_camera.translation.vector);
        (b - a).cross(&(d - a)).dot(&(eye.coords - a)) > 0.0
    }
}

/// A rotation vector with what its series have in common.
struct Arc {
    phi: Vector3<f64>,
    /// sin θ / θ, (1 − cos θ) / θ², (θ − sin θ) / θ³.
    a: f64,
    b: f64,
    c: f64,
}

impl Arc {
    fn new(phi: Vector3<f64>) -> Self {
        /// Below this squared angle the next terms of the series are smaller than 1e-11.
        const SMALL: f64 = 1e-3;
        let t2 = phi.norm_squared();
        if t2 < SMALL {
            let a = 1.0 - t2 / 6.0 * (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0));
            let b = 0.5 - t2 / 24.0 * (1.0 - t2 / 30.0 * (1.0 - t2 / 56.0));
            let c = 1.0 / 6.0 - t2 / 120.0 * (1.0 - t2 / 42.0 * (1.0 - t2 / 72.0));
            return Self { phi, a, b, c };
        }
        let t = t2.sqrt();
        let (sin, cos) = t.sin_cos();
        Self { phi, a: sin / t, b: (1.0 - cos) / t2, c: (t - sin) / (t2 * t) }
    }

    /// exp(φ) x.
    fn turn(&self, x: &Vector3<f64>) -> Vector3<f64> {
        let once = self.phi.cross(x);
        x + once * self.a + self.phi.cross(&once) * self.b
    }

    /// J_l(φ)ᵀ x.
    fn left_jacobian_transposed(&self, x: &Vector3<f64>) -> Vector3<f64> {
        let once = self.phi.cross(x);
        x - once * self.b + self.phi.cross(&once) * self.c
    }
}

/// From one time to another, negative backwards.
fn seconds_between(from_ns: u64, to_ns: u64) -> f64 {
    (i128::from(to_ns) - i128::from(from_ns)) as f64 * 1e-9
}
