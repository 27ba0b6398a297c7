//! What the standing feet say together: of the torso's attitude, and of each other.

use nalgebra::{Matrix3, Vector3};

use crate::joints::Leg;

/// Added to the feet's second moments, m², so that feet on one line say nothing about turning around it.
const LEAST_MOMENT: f64 = 1e-6;

/// What one foot that stands says.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sighting {
    pub(super) leg: Leg,
    /// 0 to 1.
    pub(super) weight: f64,
    /// From the torso's origin to the foot's centre, in the world's axes.
    pub(super) lever: Vector3<f64>,
    /// The foot's centre by its anchor, in the world.
    pub(super) centre: Vector3<f64>,
}

impl Sighting {
    /// The torso's position.
    pub(super) fn position(&self) -> Vector3<f64> {
        self.centre - self.lever
    }
}

/// One place for each foot; empty for those that do not stand.
pub(super) type Sightings = [Option<Sighting>; 4];

/// Weighted means of levers and centres.
struct Means {
    lever: Vector3<f64>,
    centre: Vector3<f64>,
}

impl Means {
    fn of(sightings: &Sightings) -> Option<Self> {
        let (mut weight, mut lever, mut centre) = (0.0, Vector3::zeros(), Vector3::zeros());
        for sighting in sightings.iter().flatten() {
            weight += sighting.weight;
            lever += sighting.weight * sighting.lever;
            centre += sighting.weight * sighting.centre;
        }
        (weight > 0.0).then(|| Self { lever: lever / weight, centre: centre / weight })
    }

    /// A lever from the mean, and how far the anchor is from where that lever ends.
    fn residual(&self, sighting: &Sighting) -> (Vector3<f64>, Vector3<f64>) {
        let lever = sighting.lever - self.lever;
        (lever, sighting.centre - self.centre - lever)
    }
}

/// The small rotation that best turns the levers to the anchors: δθ = M⁻¹ Σ w a × e, M = Σ w (|a|² I - a aᵀ),
/// a and e as [`Means::residual`]: the Procrustes problem of the paper, linear about the attitude that the
/// gyroscope predicts. Turns about a line through all feet are left at zero.
pub(super) fn turn_error(sightings: &Sightings) -> Vector3<f64> {
    let Some(means) = Means::of(sightings) else { return Vector3::zeros() };
    let mut moments = Matrix3::from_diagonal_element(LEAST_MOMENT);
    let mut moment = Vector3::zeros();
    for sighting in sightings.iter().flatten() {
        let (lever, error) = means.residual(sighting);
        moment += sighting.weight * lever.cross(&error);
        moments += sighting.weight
            * (Matrix3::from_diagonal_element(lever.norm_squared()) - lever * lever.transpose());
    }
    moments.cholesky().map_or_else(Vector3::zeros, |factor| factor.solve(&moment))
}

/// For each foot, how far its anchor is from where the foot is seen, without the errors' mean and their turn
/// about the vertical: those are the torso's.
pub(super) fn for_each_apart(sightings: &Sightings, mut take: impl FnMut(Leg, Vector3<f64>)) {
    let Some(means) = Means::of(sightings) else { return };
    let (mut turn, mut moment) = (0.0, LEAST_MOMENT);
    for sighting in sightings.iter().flatten() {
        let (lever, error) = means.residual(sighting);
        turn += sighting.weight * (lever.x * error.y - lever.y * error.x);
        moment += sighting.weight * (lever.x * lever.x + lever.y * lever.y);
    }
    let turn = turn / moment * Vector3::z();
    for sighting in sightings.iter().flatten() {
        let (lever, error) = means.residual(sighting);
        take(sighting.leg, error - turn.cross(&lever));
    }
}
