//! The rubber of the feet: contacts that are springs and dampers of given stiffness.

use mujoco_rs::prelude::MjModel;

use super::profile::FootCompliance;
use super::world::address;

/// Makes the feet's contacts springs and dampers.
///
/// A contact at rest obeys `k r = R f` with the regularisation `R = A (1 - d) / d`: `d` is the impedance
/// (`solimp`), `A` the inverse mass that MuJoCo assumes for the contact (`body_invweight0`). `solref` given as
/// `(-s, -c)` means `k = s d / d²` and, with speed `v`, `b = c / d`. So a foot sinks by `f / K` when
/// `s = K A (1 - d)`, and likewise `c = C A (1 - d)`.
pub fn soften(model: &mut MjModel, feet: &[usize; 4], rubber: &FootCompliance) {
    /// Impedance. The contact has an inertia of `d / (1 - d) / A` of its own: small with a small one.
    const IMPEDANCE: f64 = 0.2;
    for &foot in feet {
        let body = address(model.geom_bodyid()[foot]);
        let unit = model.body_invweight0()[body][0] * (1.0 - IMPEDANCE);
        model.geom_solref_mut()[foot] = [-unit * rubber.stiffness_n_m, -unit * rubber.damping_n_s_m];
        model.geom_solimp_mut()[foot] = [IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0];
    }
}
