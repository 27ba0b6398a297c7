//! One tag in one view as eight whitened residuals, each corner at its own time.
//!
//! # Equations
//! A corner X (shell frame) that camera c, with pose (R_c, t_c), exposed dt after the reference time:
//!
//! ```text
//! y = R exp(ω dt + α dt²/2) X    r = π(R_cᵀ (y + p + v dt + a dt²/2 − t_c)) − z    π: projection with the lens
//! B = ∂π/∂x_c R_cᵀ               ∂r/∂p = B          ∂r/∂v = dt B              ∂r/∂a = dt²/2 B
//!                                ∂r/∂φ = −B [y]×    ∂r/∂(Rω) = −dt B [y]×    ∂r/∂(Rα) = −dt²/2 B [y]×
//! ```
//!
//! φ is a rotation about world axes: [`super::problem`] turns the sums into shell axes. Two small things are left
//! out of the derivatives, not of the residuals, where they would move the estimate by thousandths of its
//! standard deviation: that a tag's corners differ by a millisecond in dt, and the left Jacobian of SO(3) in the
//! derivatives by ω and α (ω dt is some hundredths). So all eighteen columns follow from six, and what a tag gives to
//! the normal equations from the 7x7 products of (∂r/∂p, ∂r/∂φ, r), times powers of dt.
//!
//! The residuals of a tag are multiplied with L⁻¹, where L Lᵀ is the covariance of its corners plus the floor:
//! what calibration and print leave.

use nalgebra::{Matrix3, Point2, Point3, Vector3};

use super::state::State;
use super::{Observation, Views};
use crate::camera::Camera;
use crate::cholesky::Cholesky;

/// Squared residual of a tag that a pose puts behind the camera.
pub(super) const BEHIND: f64 = 1e8;
/// The column of the residual among the products.
pub(super) const RESIDUAL: usize = 6;

/// A camera as the solver needs it.
#[derive(Debug, Clone)]
pub(super) struct View {
    camera_from_world: Matrix3<f64>,
    eye: Vector3<f64>,
}

impl View {
    pub fn new(camera: &Camera) -> Self {
        let world_from_camera = &camera.world_from_camera;
        Self {
            camera_from_world: world_from_camera.rotation.inverse().to_rotation_matrix().into_inner(),
            eye: world_from_camera.translation.vector,
        }
    }
}

/// An observation, prepared.
#[derive(Debug, Clone)]
pub(super) struct Term {
    camera: usize,
    corners: [Vector3<f64>; 4],
    normal: Vector3<f64>,
    measured_px: [Point2<f64>; 4],
    /// Mean time of the corners after the reference time,
    pub dt_s: f64,
    /// and how much later than it each was exposed.
    later_s: [f64; 4],
    whitening: Cholesky<8>,
}

/// A term at one state.
#[derive(Debug, Clone)]
pub(super) struct Linear {
    /// Sums over the eight whitened rows of products of the columns (∂r/∂p, ∂r/∂φ, r, 0).
    pub products: [[f64; 8]; 8],
    /// |L⁻¹ r|², or [`BEHIND`].
    pub squared: f64,
    /// |r|².
    pub squared_px2: f64,
    /// Whether the printed side looks at the camera.
    pub faces: bool,
}

impl Linear {
    pub fn behind() -> Self {
        Self { products: [[0.0; 8]; 8], squared: BEHIND, squared_px2: BEHIND, faces: true }
    }
}

impl Term {
    /// `None` if the camera or the tag does not exist, or the covariance is none.
    pub fn new(views: &Views<'_>, observation: &Observation, floor_px: f64) -> Option<Self> {
        let camera = views.cameras.get(observation.camera)?;
        let tag = views.shell.tags.get(observation.tag)?;
        let whitening = whitening(observation, floor_px, views.variance)?;
        let since_s = (i128::from(observation.capture_ns) - i128::from(views.time_ns)) as f64 * 1e-9;
        let delays_s = observation.corners_px.map(|corner| camera.row_delay_s(corner.y));
        let mean_s = delays_s.iter().sum::<f64>() / 4.0;
        let finite = observation.corners_px.iter().all(|corner| corner.coords.iter().all(|c| c.is_finite()));
        finite.then(|| Self {
            camera: observation.camera,
            corners: tag.corners().map(|corner| corner.coords),
            normal: tag.normal(),
            measured_px: observation.corners_px,
            dt_s: since_s + mean_s,
            later_s: delays_s.map(|delay_s| delay_s - mean_s),
            whitening,
        })
    }

    /// Residuals and derivatives at a state.
    pub fn linearize(&self, views: &Views<'_>, eyes: &[View], state: &State, into: &mut Linear) {
        if self.try_linearize(views, eyes, state, into).is_none() {
            *into = Linear::behind();
        }
    }

    fn try_linearize(
        &self,
        views: &Views<'_>,
        eyes: &[View],
        state: &State,
        into: &mut Linear,
    ) -> Option<()> {
        let (camera, eye) = (views.cameras.get(self.camera)?, eyes.get(self.camera)?);
        let rotation = state.rotation_after(self.dt_s).to_rotation_matrix().into_inner();
        let from_eye = state.position_after(self.dt_s) - eye.eye;
        let velocity = state.velocity_m_s + state.acceleration_m_s2 * self.dt_s;
        let rate = state.rate_rad_s + state.angular_rad_s2 * self.dt_s;
        let rate_in_world = state.world_from_shell.rotation * rate;
        let mut rows = [[0.0; 8]; 8];
        let mut squared_px2 = 0.0;
        let mut first = Vector3::zeros();
        for c in 0..4 {
            // A corner is at most a millisecond or two later than its tag: two terms of the series are exact.
            let at_mean = rotation * self.corners[c];
            let later_s = self.later_s[c];
            let turning = rate_in_world.cross(&at_mean);
            let bending = rate_in_world.cross(&turning) * (0.5 * later_s);
            let shift = (velocity + turning + bending) * later_s;
            let in_camera = eye.camera_from_world * (at_mean + from_eye + shift);
            let (pixel, by_point) = camera.project_with_jacobian(&Point3::from(in_camera))?;
            let by_position = by_point * eye.camera_from_world;
            for axis in 0..2 {
                let by_p =
                    Vector3::new(by_position[(axis, 0)], by_position[(axis, 1)], by_position[(axis, 2)]);
                let by_phi = at_mean.cross(&by_p);
                let residual = pixel[axis] - self.measured_px[c][axis];
                squared_px2 += residual * residual;
                rows[2 * c + axis] = [by_p.x, by_p.y, by_p.z, by_phi.x, by_phi.y, by_phi.z, residual, 0.0];
            }
            if c == 0 {
                first = at_mean;
            }
        }
        self.whitening.whitened_products(&rows, &mut into.products);
        into.squared = into.products[RESIDUAL][RESIDUAL];
        into.squared_px2 = squared_px2;
        into.faces = (rotation * self.normal).dot(&(first + from_eye)) < 0.0;
        Some(())
    }
}

/// Covariance of a tag's corners, the floor added; `None` if it is none.
fn whitening(observation: &Observation, floor_px: f64, variance: f64) -> Option<Cholesky<8>> {
    // A symmetric matrix: its columns are its rows.
    let mut covariance = observation.covariance_px2.data.0;
    for (k, row) in covariance.iter_mut().enumerate() {
        row[k] += floor_px * floor_px;
        row.iter_mut().for_each(|value| *value *= variance);
    }
    Cholesky::of(&covariance)
}
