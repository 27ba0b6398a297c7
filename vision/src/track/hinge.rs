//! Where a thumb is, given its palm: learned while both are seen.
//!
//! A thumb turns on its palm about a hinge. What is learned is the mean of `palm_from_thumb` and its covariance
//! in the tangent space (shift in palm axes, rotation in thumb axes): the hinge shows as one large direction.
//! It tells the eyes where to look for a thumb that is lost, and is the prior of its first solve. It never
//! speaks of where a thumb is to anybody else: the angle drives a gripper, and a mean is no measurement.

use nalgebra::{Isometry3, Matrix3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};

use super::filter::{FilterSettings, Motion};
use crate::pose::{Matrix18, State};

/// What is known of a thumb on its palm.
#[derive(Debug, Clone, PartialEq)]
pub struct Hinge {
    /// The mean.
    pub palm_from_thumb: Isometry3<f64>,
    /// Of position (palm axes, m²), then rotation (thumb axes, rad²).
    pub covariance: Matrix6<f64>,
    /// Instants at which both were measured; the newest thousand count.
    pub seen: u32,
}

/// Instants after which an old one is forgotten: half a minute at 30 a second.
const MEMORY: u32 = 1000;
/// Instants before anything is said.
const LEAST: u32 = 15;
/// Factor on the covariance: the future reaches farther than the past did.
const INFLATION: f64 = 4.0;
/// Standard deviations that are added: what a hinge that was never moved may do.
const SHIFT_M: f64 = 0.01;
const TURN_RAD: f64 = 0.3;
/// The speed of a thumb beside its palm's.
const SPEED_M_S: f64 = 0.5;
const RATE_RAD_S: f64 = 5.0;

impl Hinge {
    /// From the first instant at which both are seen.
    pub fn begin(palm: &Motion, thumb: &Motion) -> Self {
        Self { palm_from_thumb: relative(palm, thumb), covariance: Matrix6::zeros(), seen: 1 }
    }

    /// Takes in another instant at which both were measured.
    pub fn learn(&mut self, palm: &Motion, thumb: &Motion) {
        let measured = relative(palm, thumb);
        let mean = &self.palm_from_thumb;
        let shift = measured.translation.vector - mean.translation.vector;
        let turn = (mean.rotation.inverse() * measured.rotation).scaled_axis();
        let step = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
        self.seen = (self.seen + 1).min(MEMORY);
        let share = 1.0 / f64::from(self.seen);
        self.covariance = (self.covariance + step * step.transpose() * share) * (1.0 - share);
        self.palm_from_thumb = Isometry3::from_parts(
            Translation3::from(mean.translation.vector + shift * share),
            mean.rotation * UnitQuaternion::from_scaled_axis(turn * share),
        );
    }

    /// Where the thumb is to be expected, given its palm; `None` while too little was seen.
    ///
    /// With r the thumb in palm axes: δp_thumb = δp − R [r]× δθ + R δr and δθ_thumb = R_rᵀ δθ + δφ.
    pub fn expected(&self, palm: &Motion, settings: &FilterSettings) -> Option<Motion> {
        if self.seen < LEAST {
            return None;
        }
        let State { world_from_shell: world_from_palm, velocity_m_s, rate_rad_s, .. } = palm.state();
        let arm: Vector3<f64> = self.palm_from_thumb.translation.vector;
        let turn = self.palm_from_thumb.rotation.inverse();
        let rotation: Matrix3<f64> = world_from_palm.rotation.to_rotation_matrix().into_inner();
        let mut of_palm = Matrix6::identity();
        of_palm.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-rotation * arm.cross_matrix()));
        of_palm.fixed_view_mut::<3, 3>(3, 3).copy_from(turn.to_rotation_matrix().matrix());
        let mut of_hinge = Matrix6::identity();
        of_hinge.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
        let mut own = self.covariance * INFLATION;
        for k in 0..3 {
            own[(k, k)] += SHIFT_M * SHIFT_M;
            own[(3 + k, 3 + k)] += TURN_RAD * TURN_RAD;
        }
        let pose =
            of_palm * palm.pose_covariance() * of_palm.transpose() + of_hinge * own * of_hinge.transpose();
        let mut covariance = Matrix18::zeros();
        covariance.fixed_view_mut::<6, 6>(0, 0).copy_from(&pose);
        let twist = palm.state_covariance().fixed_view::<6, 6>(6, 6).into_owned();
        for k in 0..3 {
            covariance[(6 + k, 6 + k)] = twist[(k, k)] + SPEED_M_S * SPEED_M_S;
            covariance[(9 + k, 9 + k)] = twist[(3 + k, 3 + k)] + RATE_RAD_S * RATE_RAD_S;
            covariance[(12 + k, 12 + k)] = settings.linear.sigma.powi(2);
            covariance[(15 + k, 15 + k)] = settings.angular.sigma.powi(2);
        }
        let state = State {
            world_from_shell: world_from_palm * self.palm_from_thumb,
            velocity_m_s: velocity_m_s + rotation * rate_rad_s.cross(&arm),
            rate_rad_s: turn * rate_rad_s,
            ..State::still(world_from_palm)
        };
        Some(Motion::begin(palm.time_ns, &state, &covariance))
    }
}

fn relative(palm: &Motion, thumb: &Motion) -> Isometry3<f64> {
    palm.world_from_shell.inverse() * thumb.world_from_shell
}

#[cfg(test)]
mod tests;
