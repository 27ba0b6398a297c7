//! A foot on the ground: a soft sphere that rolls, sinks in under load, and sometimes slips.
//!
//! - Rolling: the paper's estimator holds the foot's centre fixed; a sphere of radius r that turns by δφ carries
//!   it by ρ δφ × n, n up, ρ = r less half the depth that it has sunk in (the middle of the patch).
//! - Sinking: the centre is at r - f / k above the ground under a force f.
//! - Slip: a contact point that moves, while the others stay, is left out and gets a new anchor when it rests.

use nalgebra::{UnitQuaternion, Vector3};

use super::{EstimatorSettings, low_pass};
use crate::{kinematics::FootKinematics, model::FOOT_RADIUS_M};

/// Time constant with which the velocity of a contact point is averaged, s: less noise, and a slip of twice the
/// threshold is found in as long.
const SLIDING_S: f64 = 0.02;
/// Trust in a foot that carries nothing or slips, against one that stands. Above zero, so that a robot without
/// any better foot still has an estimate.
const LEAST_TRUST: f64 = 1e-3;

/// Where a foot stood.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Anchor {
    /// The centre of the foot without load, in the world.
    centre: Vector3<f64>,
    world_from_foot: UnitQuaternion<f64>,
}

/// A foot that stands, or may soon.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct StandingFoot {
    anchor: Option<Anchor>,
    /// Vertical force, filtered, N.
    load_n: f64,
    /// Velocity of the contact point in the world, filtered: zero unless it slips.
    sliding: Vector3<f64>,
    /// How long it has been quiet after it slipped, s; nothing if it stands.
    quiet_s: Option<f64>,
}

impl StandingFoot {
    /// Takes in the force that is measured.
    pub(super) fn feel(&mut self, force_n: f64, settings: &EstimatorSettings, dt_s: f64) {
        self.load_n += low_pass(settings.force_cutoff_hz, dt_s) * (force_n - self.load_n);
    }

    /// A new contact, or none.
    pub(super) fn reset(&mut self, force_n: f64) {
        *self = Self { load_n: force_n, ..Self::default() };
    }

    /// Lifts off.
    pub(super) fn lift(&mut self) {
        self.anchor = None;
        self.sliding = Vector3::zeros();
        self.quiet_s = None;
    }

    pub(super) fn is_anchored(&self) -> bool {
        self.anchor.is_some()
    }

    pub(super) fn slips(&self) -> bool {
        self.quiet_s.is_some()
    }

    /// How much the foot counts, 0 to 1, if it may take `share` of the greatest contact force.
    pub(super) fn trust(&self, share: f64, settings: &EstimatorSettings) -> f64 {
        let loaded = (self.load_n / settings.full_trust_n).clamp(0.0, 1.0);
        let standing = if self.slips() { 0.0 } else { loaded };
        if self.is_anchored() { share * standing.max(LEAST_TRUST) } else { 0.0 }
    }

    /// How deep it has sunk in, m.
    fn depth_m(&self, settings: &EstimatorSettings) -> f64 {
        settings.foot_sink_m_n * self.load_n.max(0.0)
    }

    /// From the contact point to the centre, along which the foot rolls.
    pub(super) fn rolling_radius(&self, settings: &EstimatorSettings) -> Vector3<f64> {
        (FOOT_RADIUS_M - 0.5 * self.depth_m(settings)) * Vector3::z()
    }

    /// Sets the anchor to where the estimate sees the foot.
    pub(super) fn anchor(
        &mut self,
        seen: &Vector3<f64>,
        world_from_foot: UnitQuaternion<f64>,
        settings: &EstimatorSettings,
    ) {
        let centre = seen + self.depth_m(settings) * Vector3::z();
        self.anchor = Some(Anchor { centre, world_from_foot });
    }

    /// Where the centre of the foot is in the world, by its anchor, for an attitude of the torso.
    pub(super) fn centre(
        &self,
        world_from_torso: &UnitQuaternion<f64>,
        foot: &FootKinematics,
        settings: &EstimatorSettings,
    ) -> Option<Vector3<f64>> {
        let anchor = self.rolled(world_from_torso, foot, settings)?;
        Some(anchor.centre - self.depth_m(settings) * Vector3::z())
    }

    /// Rolls the anchor on to where the foot is now.
    pub(super) fn roll(
        &mut self,
        world_from_torso: &UnitQuaternion<f64>,
        foot: &FootKinematics,
        settings: &EstimatorSettings,
    ) {
        self.anchor = self.rolled(world_from_torso, foot, settings);
    }

    fn rolled(
        &self,
        world_from_torso: &UnitQuaternion<f64>,
        foot: &FootKinematics,
        settings: &EstimatorSettings,
    ) -> Option<Anchor> {
        let anchor = self.anchor.as_ref()?;
        let world_from_foot = world_from_torso * foot.torso_from_foot.rotation;
        let turned = (world_from_foot * anchor.world_from_foot.inverse()).scaled_axis();
        let centre = anchor.centre + turned.cross(&self.rolling_radius(settings));
        Some(Anchor { centre, world_from_foot })
    }

    /// Moves the anchor.
    pub(super) fn shift(&mut self, by: &Vector3<f64>) {
        if let Some(anchor) = &mut self.anchor {
            anchor.centre += by;
        }
    }

    /// Expresses the anchor in another world.
    pub(super) fn rebase(&mut self, new_from_old: &nalgebra::Isometry3<f64>) {
        self.sliding = new_from_old.rotation * self.sliding;
        if let Some(anchor) = &mut self.anchor {
            anchor.centre = new_from_old.transform_point(&anchor.centre.into()).coords;
            anchor.world_from_foot = new_from_old.rotation * anchor.world_from_foot;
        }
    }

    /// Takes in the velocity of the contact point; whether it is more than a foot that stands may have.
    pub(super) fn slide(&mut self, velocity: &Vector3<f64>, settings: &EstimatorSettings, dt_s: f64) -> bool {
        self.sliding += (1.0 - (-dt_s / SLIDING_S).exp()) * (velocity - self.sliding);
        self.sliding.norm() > settings.slip_m_s
    }

    /// It slips from now on.
    pub(super) fn begin_slip(&mut self) {
        self.quiet_s = Some(0.0);
    }

    /// A slipping foot that has been quiet for long enough stands again.
    pub(super) fn settle(&mut self, moves: bool, settings: &EstimatorSettings, dt_s: f64) {
        self.quiet_s = self.quiet_s.and_then(|quiet_s| {
            let quiet_s = if moves { 0.0 } else { quiet_s + dt_s };
            (quiet_s < settings.quiet_s).then_some(quiet_s)
        });
    }
}
