//! The least-squares problem of [`super`]: cost, normal equations, Levenberg-Marquardt, covariance.

use std::collections::BTreeSet;

use nalgebra::{
    Isometry3, Matrix2x3, Matrix2x6, Matrix6, Point2, Point3, Translation3, UnitQuaternion, Vector2, Vector3,
    Vector6,
};

use super::{Observation, Solution, SolverSettings};
use crate::camera::Camera;
use crate::shells::Shell;

/// Squared residual, in σ², of a corner that a pose puts behind the camera.
const BEHIND: f64 = 1e8;

/// Observations together with what they are of.
pub(super) struct Problem<'a> {
    pub shell: &'a Shell,
    pub cameras: &'a [Camera],
    pub observations: &'a [Observation],
    pub settings: &'a SolverSettings,
    camera_from_world: Vec<Isometry3<f64>>,
    /// Corners of each observation's tag in the shell frame.
    corners: Vec<[Point3<f64>; 4]>,
}

/// Normal equations at one pose.
struct Normal {
    hessian: Matrix6<f64>,
    gradient: Vector6<f64>,
    cost: f64,
}

impl<'a> Problem<'a> {
    pub fn new(
        shell: &'a Shell,
        cameras: &'a [Camera],
        observations: &'a [Observation],
        settings: &'a SolverSettings,
    ) -> Self {
        let camera_from_world = cameras.iter().map(|c| c.world_from_camera.inverse()).collect();
        let corners = observations.iter().map(|o| shell.tags[o.tag].corners()).collect();
        Self { shell, cameras, observations, settings, camera_from_world, corners }
    }

    pub fn is_empty(&self) -> bool {
        self.observations.is_empty()
    }

    /// Σ ρ(|r|²) of the observations that are used.
    pub fn cost(&self, pose: &Isometry3<f64>, used: &[bool]) -> f64 {
        let of_tag = |k: usize| self.residuals(pose, k).map(|r| self.kernel(squared(r))).iter().sum::<f64>();
        (0..used.len()).filter(|k| used[*k]).map(of_tag).sum()
    }

    /// Which observations fit a pose.
    pub fn fitting(&self, pose: &Isometry3<f64>) -> Vec<bool> {
        let fits = |(k, observation): (usize, &Observation)| {
            let mean = self.residuals(pose, k).map(squared).iter().sum::<f64>() / 4.0;
            let rms_px = mean.sqrt() * observation.sigma_px;
            let limit_px =
                (self.settings.outlier_sigmas * observation.sigma_px).max(self.settings.outlier_floor_px);
            rms_px < limit_px && self.faces(pose, observation)
        };
        self.observations.iter().enumerate().map(fits).collect()
    }

    /// Whether the printed side of the tag looks at the camera.
    fn faces(&self, pose: &Isometry3<f64>, observation: &Observation) -> bool {
        let tag = &self.shell.tags[observation.tag];
        let center = pose * tag.center();
        let eye = self.cameras[observation.camera].world_from_camera.translation.vector;
        (pose * tag.normal()).dot(&(eye - center.coords)) > 0.0
    }

    /// Levenberg-Marquardt from a start; never returns a pose of higher cost than the start's.
    pub fn minimize(&self, start: &Isometry3<f64>, used: &[bool]) -> Isometry3<f64> {
        /// Damping at the start, its factor after a good and after a bad step, and where to give up.
        const START: f64 = 1e-4;
        const DOWN: f64 = 0.1;
        const UP: f64 = 8.0;
        const GIVE_UP: f64 = 1e8;
        /// Steps below a nanometre and a nanoradian change nothing.
        const CONVERGED: f64 = 1e-9;
        let mut pose = *start;
        let mut damping = START;
        let mut normal = self.normal(&pose, used);
        for _ in 0..self.settings.max_steps {
            let mut damped = normal.hessian;
            for k in 0..6 {
                damped[(k, k)] *= 1.0 + damping;
            }
            let Some(cholesky) = damped.cholesky() else { break };
            let step = -cholesky.solve(&normal.gradient);
            let moved = perturb(&pose, &step);
            let cost = self.cost(&moved, used);
            if cost <= normal.cost {
                pose = moved;
                damping *= DOWN;
                if step.amax() < CONVERGED {
                    break;
                }
                normal = self.normal(&pose, used);
            } else {
                damping *= UP;
                if damping > GIVE_UP || step.amax() < CONVERGED {
                    break;
                }
            }
        }
        pose
    }

    /// The solution at a minimum; `None` if what is used does not determine a pose.
    pub fn conclude(&self, pose: &Isometry3<f64>, used: Vec<bool>) -> Option<Solution> {
        let mut squares_px = 0.0;
        let mut chi2 = 0.0;
        let mut corners = 0.0;
        let (mut tags, mut cameras) = (BTreeSet::new(), BTreeSet::new());
        for (k, observation) in self.observations.iter().enumerate().filter(|(k, _)| used[*k]) {
            for residual in self.residuals(pose, k) {
                chi2 += squared(residual);
                squares_px += squared(residual) * observation.sigma_px.powi(2);
                corners += 1.0;
            }
            tags.insert(observation.tag);
            cameras.insert(observation.camera);
        }
        let covariance = self.normal(pose, &used).hessian.try_inverse()?;
        // Two residuals a corner, less the six that the pose takes up.
        let freedom: f64 = 2.0 * corners - 6.0;
        let widening = (chi2 / freedom).max(1.0);
        let covariance = (covariance + covariance.transpose()) * (0.5 * widening);
        covariance.iter().all(|number| number.is_finite()).then(|| Solution {
            world_from_shell: *pose,
            covariance,
            rms_px: f64::sqrt(squares_px / corners),
            used,
            tags: tags.len(),
            cameras: cameras.len(),
        })
    }

    /// J ᵀ W J, Jᵀ W r and the cost, with the kernel's weights W.
    fn normal(&self, pose: &Isometry3<f64>, used: &[bool]) -> Normal {
        let mut normal = Normal { hessian: Matrix6::zeros(), gradient: Vector6::zeros(), cost: 0.0 };
        for (k, observation) in self.observations.iter().enumerate().filter(|(k, _)| used[*k]) {
            for (corner, measured) in self.corners[k].iter().zip(&observation.corners_px) {
                match self.linearize(pose, observation, corner, measured) {
                    None => normal.cost += self.kernel(BEHIND),
                    Some((residual, jacobian)) => {
                        let s = residual.norm_squared();
                        let weight = 1.0 / (1.0 + s / self.settings.kernel_sigmas.powi(2));
                        normal.hessian += jacobian.transpose() * jacobian * weight;
                        normal.gradient += jacobian.transpose() * residual * weight;
                        normal.cost += self.kernel(s);
                    }
                }
            }
        }
        normal
    }

    /// Residual of a corner in standard deviations, and its derivative by the tangent.
    fn linearize(
        &self,
        pose: &Isometry3<f64>,
        observation: &Observation,
        corner: &Point3<f64>,
        measured: &Point2<f64>,
    ) -> Option<(Vector2<f64>, Matrix2x6<f64>)> {
        let camera_from_world = &self.camera_from_world[observation.camera];
        let in_camera = camera_from_world * (pose * corner);
        let (pixel, by_point) = self.cameras[observation.camera].project_with_jacobian(&in_camera)?;
        let scale = 1.0 / observation.sigma_px;
        let by_position: Matrix2x3<f64> =
            by_point * camera_from_world.rotation.to_rotation_matrix().matrix() * scale;
        let by_rotation =
            -by_position * pose.rotation.to_rotation_matrix().matrix() * corner.coords.cross_matrix();
        let mut jacobian = Matrix2x6::zeros();
        jacobian.fixed_view_mut::<2, 3>(0, 0).copy_from(&by_position);
        jacobian.fixed_view_mut::<2, 3>(0, 3).copy_from(&by_rotation);
        Some(((pixel - measured) * scale, jacobian))
    }

    /// Residuals of the four corners in standard deviations; `None` for those behind the camera.
    fn residuals(&self, pose: &Isometry3<f64>, k: usize) -> [Option<Vector2<f64>>; 4] {
        let observation = &self.observations[k];
        let camera_from_shell = self.camera_from_world[observation.camera] * pose;
        std::array::from_fn(|c| {
            let in_camera = camera_from_shell * self.corners[k][c];
            let pixel = self.cameras[observation.camera].project(&in_camera)?;
            Some((pixel - observation.corners_px[c]) / observation.sigma_px)
        })
    }

    /// Cauchy's ρ(s) = k² ln(1 + s/k²).
    fn kernel(&self, s: f64) -> f64 {
        let k2 = self.settings.kernel_sigmas.powi(2);
        k2 * (s / k2).ln_1p()
    }
}

fn squared(residual: Option<Vector2<f64>>) -> f64 {
    residual.map_or(BEHIND, |r| r.norm_squared())
}

/// Moves a pose along a tangent: position in world axes, rotation in shell axes.
pub fn perturb(pose: &Isometry3<f64>, step: &Vector6<f64>) -> Isometry3<f64> {
    let shift: Vector3<f64> = step.fixed_rows::<3>(0).into();
    let turn: Vector3<f64> = step.fixed_rows::<3>(3).into();
    Isometry3::from_parts(
        Translation3::from(pose.translation.vector + shift),
        pose.rotation * UnitQuaternion::from_scaled_axis(turn),
    )
}
