//! From the hierarchy's acceleration to contact forces and what they leave of it.

use nalgebra::{Matrix6, SMatrix, Vector3, Vector6};

use super::{
    ContactForceSettings, ContactPoint, ContactSet, ForceFailure, ForceSource,
    force::{ActiveSet, ForceProblem, ForceSolver, Forces, InteriorPoint, MAX_FORCES, TorqueLimits},
};
use crate::{
    dynamics::{Dynamics, Motion},
    model::{GRAVITY, Model},
};

/// Contact forces of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroundReaction {
    /// f_r of each point in the world, N.
    pub(super) force: [Vector3<f64>; ContactPoint::COUNT],
    /// δ_t, in the torso's frame.
    pub(super) slack: Vector6<f64>,
    /// A (q̈ + (δ_t, 0)) + b + g - J_cᵀ f_r: what torso and joints have to give. N, N m.
    pub(super) effort: Motion,
    pub(super) source: ForceSource,
    /// No forces keep the torques within limits: the limits were left out.
    pub(super) torques_relaxed: bool,
}

/// The quadratic program of a step, its two solvers, and the last forces that were feasible.
pub(super) struct ForceDistribution {
    settings: ContactForceSettings,
    problem: ForceProblem,
    first: ActiveSet,
    second: InteriorPoint,
    /// For measurements: the second solver in every step.
    second_only: bool,
    last: [Vector3<f64>; ContactPoint::COUNT],
}

/// B and d of δ_t = B f - d, with forces in body weights.
struct TorsoBalance {
    from_forces: SMatrix<f64, 6, MAX_FORCES>,
    wanted: Vector6<f64>,
}

impl ForceDistribution {
    pub(super) fn new(settings: ContactForceSettings) -> Self {
        Self {
            settings,
            problem: ForceProblem::new(settings.friction),
            first: ActiveSet::default(),
            second: InteriorPoint::new(settings.friction),
            second_only: false,
            last: [Vector3::zeros(); ContactPoint::COUNT],
        }
    }

    /// Leaves every step to the interior-point method, for measurements.
    pub(super) const fn use_second_only(&mut self) {
        self.second_only = true;
    }

    /// The problem of the last step.
    pub(super) const fn problem(&self) -> &ForceProblem {
        &self.problem
    }

    /// Forces for an acceleration q̈, the slack that they leave, and what they leave to the joints.
    pub(super) fn solve(
        &mut self,
        model: &Model,
        dynamics: &Dynamics,
        contacts: &ContactSet,
        acceleration: &Motion,
    ) -> Option<GroundReaction> {
        let weight = model.mass() * GRAVITY;
        let unaided = dynamics.inverse_dynamics(acceleration);
        let balance = TorsoBalance::new(dynamics, contacts, &unaided, weight)?;
        self.set_points(contacts);
        self.set_cost(&balance);
        self.set_torque_limits(model, dynamics, contacts, &balance, &unaided, weight);

        let mut forces: Forces = [0.0; MAX_FORCES];
        let (source, torques_relaxed) = self.find(contacts, weight, &mut forces);
        let slack = (balance.from_forces * SMatrix::from(forces) - balance.wanted) * weight;
        let mut force = [Vector3::zeros(); ContactPoint::COUNT];
        for (slot, point) in contacts.points().enumerate() {
            force[point.index()] = Vector3::from_column_slice(&forces[3 * slot..3 * slot + 3]) * weight;
        }
        self.last = force;
        let effort =
            unaided + dynamics.mass_matrix().fixed_columns::<6>(0) * slack - ground_load(dynamics, &force);
        Some(GroundReaction { force, slack, effort, source, torques_relaxed })
    }

    /// Solves the problem: with the torque limits, else without.
    fn find(&mut self, contacts: &ContactSet, weight: f64, forces: &mut Forces) -> (ForceSource, bool) {
        if self.problem.points == 0 {
            return (ForceSource::NoContact, false);
        }
        let mut failure = match self.try_both(forces) {
            Ok(source) => return (source, false),
            Err(failure) => failure,
        };
        // There are always forces within the pyramids: what leaves none, or none to be found, is the torques.
        if self.problem.torque.joints > 0 {
            let limits = std::mem::replace(&mut self.problem.torque.joints, 0);
            let found = self.try_both(forces);
            self.problem.torque.joints = limits;
            match found {
                Ok(source) => return (source, true),
                Err(still) => failure = still,
            }
        }
        self.recall(contacts, weight, forces);
        (ForceSource::LastFeasible(failure), false)
    }

    fn try_both(&mut self, forces: &mut Forces) -> Result<ForceSource, ForceFailure> {
        if !self.second_only {
            match self.first.solve(&self.problem, forces) {
                Ok(()) => return Ok(ForceSource::ActiveSet),
                // It has a proof: a constraint that contradicts the active ones.
                Err(ForceFailure::Infeasible) if self.problem.torque.joints > 0 => {
                    return Err(ForceFailure::Infeasible);
                }
                Err(_) => {}
            }
        }
        self.second.solve(&self.problem, forces).map(|()| ForceSource::InteriorPoint)
    }

    fn set_points(&mut self, contacts: &ContactSet) {
        let problem = &mut self.problem;
        problem.points = 0;
        for point in contacts.points() {
            let most = self.settings.max_vertical * contacts.share_of(point);
            problem.max_vertical[problem.points] = most;
            problem.min_vertical[problem.points] = self.settings.min_vertical.min(most);
            problem.points += 1;
        }
    }

    /// H = Q_1 + Bᵀ Q_2 B and h = -Bᵀ Q_2 d.
    fn set_cost(&mut self, balance: &TorsoBalance) {
        let problem = &mut self.problem;
        for column in 0..problem.unknowns() {
            let mut weighted: Vector6<f64> = balance.from_forces.column(column).into_owned();
            for (entry, weight) in weighted.iter_mut().zip(&self.settings.slack_weight) {
                *entry *= weight;
            }
            for row in 0..=column {
                let entry = balance.from_forces.column(row).dot(&weighted);
                problem.hessian[row][column] = entry;
                problem.hessian[column][row] = entry;
            }
            problem.hessian[column][column] += self.settings.force_weight;
            problem.gradient[column] = -weighted.dot(&balance.wanted);
        }
    }

    /// T = A_jt B - J_cjᵀ and τ_0 = (A q̈ + b + g)_j - A_jt d of the loaded legs' joints.
    fn set_torque_limits(
        &mut self,
        model: &Model,
        dynamics: &Dynamics,
        contacts: &ContactSet,
        balance: &TorsoBalance,
        unaided: &Motion,
        weight: f64,
    ) {
        let limits = &mut self.problem.torque;
        *limits = TorqueLimits::NONE;
        for leg in contacts.legs() {
            for joint in leg.first_joint()..leg.first_joint() + 3 {
                // A is symmetric.
                let coupling = dynamics.mass_matrix().fixed_view::<6, 1>(0, 6 + joint);
                let mut row = balance.from_forces.tr_mul(&coupling);
                for (slot, point) in contacts.points().enumerate().filter(|(_, point)| point.leg() == leg) {
                    let jacobian = &dynamics.frame(point.frame()).jacobian;
                    for axis in 0..3 {
                        row[3 * slot + axis] -= jacobian[(axis, 6 + joint)];
                    }
                }
                let start = unaided[6 + joint] / weight - coupling.dot(&balance.wanted);
                let most = model.max_torque[joint] / weight;
                limits.from_forces[limits.joints] = row.into();
                limits.lower[limits.joints] = -most - start;
                limits.upper[limits.joints] = most - start;
                limits.joints += 1;
            }
        }
    }

    /// The last feasible forces of the feet that are still in contact, within their present limits.
    fn recall(&self, contacts: &ContactSet, weight: f64, forces: &mut Forces) {
        let problem = &self.problem;
        *forces = [0.0; MAX_FORCES];
        for (slot, point) in contacts.points().enumerate() {
            let last = self.last[point.index()] / weight;
            let vertical = last.z.clamp(problem.min_vertical[slot], problem.max_vertical[slot]);
            let side = problem.friction * vertical;
            forces[3 * slot] = last.x.clamp(-side, side);
            forces[3 * slot + 1] = last.y.clamp(-side, side);
            forces[3 * slot + 2] = vertical;
        }
    }
}

impl TorsoBalance {
    /// B = A_tt⁻¹ J_ctᵀ and d = A_tt⁻¹ (A q̈ + b + g)_t / weight; nothing if A_tt has no inverse.
    fn new(dynamics: &Dynamics, contacts: &ContactSet, unaided: &Motion, weight: f64) -> Option<Self> {
        let torso: Matrix6<f64> = dynamics.mass_matrix().fixed_view::<6, 6>(0, 0).into_owned();
        let factor = torso.cholesky()?;
        let mut from_forces = SMatrix::<f64, 6, MAX_FORCES>::zeros();
        for (slot, point) in contacts.points().enumerate() {
            let jacobian = &dynamics.frame(point.frame()).jacobian;
            let wrench = jacobian.fixed_view::<3, 6>(0, 0).transpose();
            from_forces.fixed_columns_mut::<3>(3 * slot).copy_from(&factor.solve(&wrench));
        }
        let needed: Vector6<f64> = unaided.fixed_rows::<6>(0).into_owned();
        Some(Self { from_forces, wanted: factor.solve(&needed) / weight })
    }
}

/// J_cᵀ f_r: the forces that the ground's forces make on torso and joints.
fn ground_load(dynamics: &Dynamics, force: &[Vector3<f64>; ContactPoint::COUNT]) -> Motion {
    let mut load = Motion::zeros();
    for point in ContactPoint::ALL {
        let jacobian = &dynamics.frame(point.frame()).jacobian;
        load += jacobian.fixed_rows::<3>(0).tr_mul(&force[point.index()]);
    }
    load
}

impl ForceSource {
    /// Why there are no new forces, if so.
    pub(super) const fn failure(self) -> Option<ForceFailure> {
        match self {
            Self::LastFeasible(failure) => Some(failure),
            Self::NoContact | Self::ActiveSet | Self::InteriorPoint => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        dynamics::State,
        joints::{JointVector, Leg},
        wbc::WbcSettings,
    };

    #[test]
    fn when_no_solver_finds_forces_the_last_ones_serve_within_their_present_limits() {
        let model = crate::model::test_model();
        let mut position = JointVector::zeros();
        for leg in Leg::ALL {
            position.fixed_rows_mut::<3>(leg.first_joint()).copy_from_slice(&[0.0, 0.9, -1.8]);
        }
        let mut dynamics = Dynamics::new();
        dynamics.update(&model, &State::at_rest(position));
        let mut sut = ForceDistribution::new(WbcSettings::default().contact);
        let contacts = ContactSet::STANCE;
        let good = sut.solve(&model, &dynamics, &contacts, &Motion::zeros()).unwrap();
        assert_eq!(good.source, ForceSource::ActiveSet);

        sut.settings.slack_weight[2] = f64::INFINITY;
        let lifting = contacts.with_share(Leg::RearLeft, 0.1);
        let bad = sut.solve(&model, &dynamics, &lifting, &Motion::zeros()).unwrap();
        assert_eq!(bad.source, ForceSource::LastFeasible(ForceFailure::NotFinite));
        for leg in [Leg::FrontRight, Leg::FrontLeft, Leg::RearRight] {
            assert!((bad.force[leg.index()] - good.force[leg.index()]).amax() < 1e-9);
        }
        let most = 0.1 * sut.settings.max_vertical * model.mass() * GRAVITY;
        let limited = bad.force[Leg::RearLeft.index()];
        assert!((limited.z - most).abs() < 1e-9 && good.force[Leg::RearLeft.index()].z > most);
        assert!(limited.x.abs().max(limited.y.abs()) <= sut.settings.friction * most + 1e-9);
    }
}
