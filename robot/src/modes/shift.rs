//! Where the torso goes before a front foot lifts: to where the other three feet will carry the robot as it
//! will be, with the foot in the air and the arm as its mode begins.
//!
//! The centre of mass that counts is the model's, in the posture after lifting: joints of the standing legs
//! from the torso's goal and the feet as measured, the lifted one's from the place to which its foot goes.
//! The torso makes the smallest move that brings it the wanted distance inside the triangle of the feet.
//! Legs and arms stay behind when the torso moves, so that takes a few rounds.

use nalgebra::{Isometry3, Vector2, Vector3};

use super::{mode::Effector, scene::Scene, settings::PoseSettings};
use crate::{
    commander::{deepest_margin, from_above, push_inside},
    dynamics::{Dynamics, State},
    joints::{JointVector, Leg},
    kinematics::leg_towards,
    model::Model,
    wbc::ContactSet,
};

/// Each round leaves about a tenth of what lacks: legs and arms have an eighth of the mass.
const ROUNDS: usize = 4;
/// Share of the triangle's greatest margin that is asked for, where the wanted one is more.
const DEEPEST_SHARE: f64 = 0.9;
/// The torso goes no farther from the middle of the feet, seen from above, m. [E] The hips then lean by
/// 20 degrees: half of their range is left for what an operator asks.
const FARTHEST_M: f64 = 0.1;

/// The torso's goal, and what lifting does to the centre of mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    /// Pose of the torso in the world: level, facing as the world.
    pub torso: Isometry3<f64>,
    /// By how much lifting moves the centre of mass, seen from above, m.
    pub com_by_lifting: Vector2<f64>,
}

impl Shift {
    /// None: the torso stays at the world's origin.
    pub fn none() -> Self {
        Self { torso: Isometry3::identity(), com_by_lifting: Vector2::zeros() }
    }

    /// For an end effector, on a robot that stands in the middle of its feet in the world's origin.
    pub fn plan(poses: &PoseSettings, scene: &Scene<'_>, effector: Effector) -> Self {
        let leg = effector.side().leg();
        let (feet, count) = scene.standing_feet(&ContactSet::without(leg));
        let feet = &feet[..count];
        let margin_m = poses.shift_margin_m.min(DEEPEST_SHARE * deepest_margin(feet));

        let mut posture = poses.posture(&poses.stand_rad);
        let mut way = Vector2::zeros();
        let mut torso = Isometry3::translation(0.0, 0.0, poses.rise_m);
        for _ in 0..ROUNDS {
            lift(&mut posture, poses, scene, effector, &torso);
            let com = from_above(&centre_of_mass(scene.model, &torso, &posture));
            way = (way + push_inside(&com, feet, margin_m)).cap_magnitude(FARTHEST_M);
            torso.translation.vector = Vector3::new(way.x, way.y, poses.rise_m);
        }
        lift(&mut posture, poses, scene, effector, &torso);
        let lifted = centre_of_mass(scene.model, &torso, &posture);
        stand(&mut posture, poses, scene, leg, &scene.foot(leg), &torso);
        let standing = centre_of_mass(scene.model, &torso, &posture);
        Self { torso, com_by_lifting: from_above(&(lifted - standing)) }
    }

    /// Whether the centre of mass is at least so far inside the feet that stay, as it is and as it will be.
    pub fn may_lift(&self, scene: &Scene<'_>, effector: Effector, margin_m: f64) -> bool {
        let (feet, count) = scene.standing_feet(&ContactSet::without(effector.side().leg()));
        let now = from_above(&scene.com);
        [now, now + self.com_by_lifting]
            .iter()
            .all(|com| push_inside(com, &feet[..count], margin_m) == Vector2::zeros())
    }
}

/// The posture after lifting.
fn lift(
    posture: &mut JointVector,
    poses: &PoseSettings,
    scene: &Scene<'_>,
    effector: Effector,
    torso: &Isometry3<f64>,
) {
    let side = effector.side();
    let up = scene.landing(side) + poses.lift(effector) * Vector3::z();
    stand(posture, poses, scene, side.leg(), &up, torso);
    posture.fixed_rows_mut::<3>(side.first_arm_joint()).copy_from(&poses.arm(effector));
}

/// Arms folded, the legs to the feet where they are, but one to a place of its own.
fn stand(
    posture: &mut JointVector,
    poses: &PoseSettings,
    scene: &Scene<'_>,
    other: Leg,
    place: &Vector3<f64>,
    torso: &Isometry3<f64>,
) {
    for leg in Leg::ALL {
        let foot = if leg == other { *place } else { scene.foot(leg) };
        let in_torso = torso.inverse_transform_point(&foot.into()).coords;
        let joints = leg_towards(scene.model, posture, leg, &in_torso);
        posture.fixed_rows_mut::<3>(leg.first_joint()).copy_from(&joints);
    }
    for side in crate::joints::Side::ALL {
        posture.fixed_rows_mut::<3>(side.first_arm_joint()).copy_from(&poses.stow(side));
    }
}

/// In the world, of a robot at rest.
pub(super) fn centre_of_mass(model: &Model, torso: &Isometry3<f64>, posture: &JointVector) -> Vector3<f64> {
    let mut dynamics = Dynamics::new();
    dynamics.update(model, &State { world_from_torso: *torso, ..State::at_rest(*posture) });
    *dynamics.com()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{joints::Side, model::test_model};

    const EFFECTORS: [Effector; 4] = [
        Effector::Foot(Side::Right),
        Effector::Foot(Side::Left),
        Effector::Gripper(Side::Right),
        Effector::Gripper(Side::Left),
    ];

    fn with_scene(change: impl Fn(&mut JointVector), test: impl Fn(&PoseSettings, &Scene<'_>)) {
        let model = test_model();
        let poses = PoseSettings::default();
        let mut stand = poses.posture(&poses.stand_rad);
        change(&mut stand);
        let state = State::at_rest(stand);
        let mut dynamics = Dynamics::new();
        dynamics.update(&model, &state);
        let scene = Scene {
            model: &model,
            state: &state,
            desired: &stand,
            com: *dynamics.com(),
            foot_force: [30.0; 4],
            now_ns: 0,
            dt_s: 0.0025,
        };
        test(&poses, &scene);
    }

    /// How far inside the feet that stay the lifted robot's centre of mass is after the shift, m.
    fn margin(poses: &PoseSettings, scene: &Scene<'_>, effector: Effector, torso: &Isometry3<f64>) -> f64 {
        let mut posture = poses.posture(&poses.stand_rad);
        lift(&mut posture, poses, scene, effector, torso);
        let com = from_above(&centre_of_mass(scene.model, torso, &posture));
        let (feet, count) = scene.standing_feet(&ContactSet::without(effector.side().leg()));
        let inside = |margin_m| push_inside(&com, &feet[..count], margin_m) == Vector2::zeros();
        (0..200).map(|mm| f64::from(mm) * 1e-3).take_while(|margin_m| inside(*margin_m)).last().unwrap_or(0.0)
    }

    #[test]
    fn the_lifted_robots_centre_of_mass_is_as_far_inside_as_wanted_and_the_sides_are_alike() {
        with_scene(
            |_| {},
            |poses, scene| {
                for effector in EFFECTORS {
                    let shift = Shift::plan(poses, scene, effector);
                    let reached = margin(poses, scene, effector, &shift.torso);
                    println!(
                        "{effector:?}: {:.4?}, margin {reached:.3} m, without {:.3} m, lifting moves {:.4?}",
                        shift.torso.translation.vector.as_slice(),
                        margin(poses, scene, effector, &Isometry3::translation(0.0, 0.0, poses.rise_m)),
                        shift.com_by_lifting.as_slice(),
                    );
                    assert!((reached - poses.shift_margin_m).abs() < 0.002, "{reached}");
                }
                let [right, left] = [EFFECTORS[2], EFFECTORS[3]]
                    .map(|effector| Shift::plan(poses, scene, effector).torso.translation.vector);
                assert!((right - left.component_mul(&Vector3::new(1.0, -1.0, 1.0))).norm() < 0.004);
            },
        );
    }

    #[test]
    fn feet_that_stand_narrow_and_askew_still_carry_the_robot() {
        with_scene(
            |stand| {
                // Feet inwards by 0.04 m, one of them forward by 0.04 m.
                for (leg, outwards) in [(0, 1.0), (1, -1.0), (2, 1.0), (3, -1.0)] {
                    stand[3 * leg] += 0.15 * outwards;
                }
                stand[10] -= 0.15;
            },
            |poses, scene| {
                for effector in EFFECTORS {
                    let shift = Shift::plan(poses, scene, effector);
                    assert!(margin(poses, scene, effector, &shift.torso) > 0.04);
                }
            },
        );
    }
}
