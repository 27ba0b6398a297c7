//! From the hierarchy's acceleration to contact forces and what they leave of it.

use nalgebra::{Matrix6, SMatrix, Vector3, Vector6};

use super::{
    ContactForceSettings, ContactSet, ForceFailure, ForceSource,
    force::{ActiveSet, ForceProblem, ForceSolver, Forces, InteriorPoint, MAX_FORCES},
};
use crate::{
    dynamics::{Dynamics, Motion},
    joints::Leg,
    model::{Frame, GRAVITY, Model},
};

/// Contact forces of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroundReaction {
    /// f_r of each leg in the world, N.
    pub(super) force: [Vector3<f64>; 4],
    /// δ_t, in the torso's frame.
    pub(super) slack: Vector6<f64>,
    pub(super) source: ForceSource,
}

/// The quadratic program of a step, its two solvers, and the last forces that were feasible.
pub(super) struct ForceDistribution {
    settings: ContactForceSettings,
    first: ActiveSet,
    second: InteriorPoint,
    last: [Vector3<f64>; 4],
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
            first: ActiveSet::default(),
            second: InteriorPoint::new(settings.friction),
            last: [Vector3::zeros(); 4],
        }
    }

    /// Forces for an acceleration q̈, and the slack that they leave.
    pub(super) fn solve(
        &mut self,
        model: &Model,
        dynamics: &Dynamics,
        contacts: &ContactSet,
        acceleration: &Motion,
    ) -> Option<GroundReaction> {
        let weight = model.mass() * GRAVITY;
        let balance = TorsoBalance::new(dynamics, contacts, acceleration, weight)?;
        let problem = self.problem(contacts, &balance);
        let mut forces: Forces = [0.0; MAX_FORCES];
        let source = if problem.feet == 0 {
            ForceSource::NoContact
        } else if self.first.solve(&problem, &mut forces).is_ok() {
            ForceSource::ActiveSet
        } else {
            match self.second.solve(&problem, &mut forces) {
                Ok(()) => ForceSource::InteriorPoint,
                Err(failure) => {
                    self.recall(contacts, &problem, weight, &mut forces);
                    ForceSource::LastFeasible(failure)
                }
            }
        };
        let slack = (balance.from_forces * SMatrix::from(forces) - balance.wanted) * weight;
        let mut force = [Vector3::zeros(); 4];
        for (slot, leg) in contacts.legs().enumerate() {
            force[leg.index()] = Vector3::from_column_slice(&forces[3 * slot..3 * slot + 3]) * weight;
        }
        self.last = force;
        Some(GroundReaction { force, slack, source })
    }

    /// H = Q_1 + Bᵀ Q_2 B and h = -Bᵀ Q_2 d.
    fn problem(&self, contacts: &ContactSet, balance: &TorsoBalance) -> ForceProblem {
        let mut weighted = balance.from_forces;
        for (row, weight) in self.settings.slack_weight.iter().enumerate() {
            weighted.row_mut(row).scale_mut(*weight);
        }
        let mut problem = ForceProblem {
            feet: 0,
            hessian: [[0.0; MAX_FORCES]; MAX_FORCES],
            gradient: [0.0; MAX_FORCES],
            friction: self.settings.friction,
            min_vertical: [0.0; 4],
            max_vertical: [0.0; 4],
        };
        for leg in contacts.legs() {
            let most = self.settings.max_vertical * contacts.share(leg);
            problem.max_vertical[problem.feet] = most;
            problem.min_vertical[problem.feet] = self.settings.min_vertical.min(most);
            problem.feet += 1;
        }
        for row in 0..problem.unknowns() {
            for column in 0..problem.unknowns() {
                problem.hessian[row][column] = balance.from_forces.column(row).dot(&weighted.column(column));
            }
            problem.hessian[row][row] += self.settings.force_weight;
            problem.gradient[row] = -weighted.column(row).dot(&balance.wanted);
        }
        problem
    }

    /// The last feasible forces of the feet that are still in contact, within their present limits.
    fn recall(&self, contacts: &ContactSet, problem: &ForceProblem, weight: f64, forces: &mut Forces) {
        *forces = [0.0; MAX_FORCES];
        for (slot, leg) in contacts.legs().enumerate() {
            let last = self.last[leg.index()] / weight;
            let vertical = last.z.clamp(problem.min_vertical[slot], problem.max_vertical[slot]);
            let side = problem.friction * vertical;
            forces[3 * slot] = last.x.clamp(-side, side);
            forces[3 * slot + 1] = last.y.clamp(-side, side);
            forces[3 * slot + 2] = vertical;
        }
    }
}

impl TorsoBalance {
    /// B = A_tt⁻¹ J_ctᵀ and d = A_tt⁻¹ (A_t q̈ + b_t + g_t) / weight; nothing if A_tt has no inverse.
    fn new(dynamics: &Dynamics, contacts: &ContactSet, acceleration: &Motion, weight: f64) -> Option<Self> {
        let mass_matrix = dynamics.mass_matrix();
        let torso: Matrix6<f64> = mass_matrix.fixed_view::<6, 6>(0, 0).into_owned();
        let factor = torso.cholesky()?;
        let mut from_forces = SMatrix::<f64, 6, MAX_FORCES>::zeros();
        for (slot, leg) in contacts.legs().enumerate() {
            let jacobian = &dynamics.frame(Frame::Foot(leg)).jacobian;
            let wrench = jacobian.fixed_view::<3, 6>(0, 0).transpose();
            from_forces.fixed_columns_mut::<3>(3 * slot).copy_from(&factor.solve(&wrench));
        }
        let needed: Vector6<f64> =
            mass_matrix.fixed_rows::<6>(0) * acceleration + dynamics.bias().fixed_rows::<6>(0);
        Some(Self { from_forces, wanted: factor.solve(&needed) / weight })
    }
}

/// J_cᵀ f_r: the forces that the ground's forces make on torso and joints.
pub(super) fn ground_load(dynamics: &Dynamics, force: &[Vector3<f64>; 4]) -> Motion {
    let mut load = Motion::zeros();
    for leg in Leg::ALL {
        let jacobian = &dynamics.frame(Frame::Foot(leg)).jacobian;
        load += jacobian.fixed_rows::<3>(0).tr_mul(&force[leg.index()]);
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
