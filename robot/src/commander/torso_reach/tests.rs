use proptest::prelude::*;

use super::*;
use crate::{
    commander::Limits,
    kinematics::torso_from_frame,
    model::{FOOT_RADIUS_M, Frame, test_model},
};

const DT_S: f64 = 0.0025;
const MARGIN_M: f64 = 0.02;

fn range() -> ReachRange {
    Limits::default().reach
}

fn stand() -> JointVector {
    let mut joints = JointVector::zeros();
    for leg in Leg::ALL {
        joints.fixed_rows_mut::<3>(leg.first_joint()).copy_from_slice(&[0.0, 0.9, -1.8]);
    }
    joints
}

fn footing(feet: &[(Leg, Vector3<f64>)]) -> Footing<'_> {
    Footing {
        feet,
        com_from_torso: Vector2::zeros(),
        margin_m: MARGIN_M,
        ground_m: feet[0].1.z - FOOT_RADIUS_M,
        range: range(),
    }
}

/// A robot on three or four feet.
struct Stand {
    model: Model,
    feet: Vec<(Leg, Vector3<f64>)>,
    sut: TorsoReach,
}

impl Stand {
    fn new(legs: &[Leg]) -> Self {
        let model = test_model();
        let at = |leg| torso_from_frame(&model, &stand(), Frame::Foot(leg)).translation.vector;
        let feet = legs.iter().map(|leg| (*leg, at(*leg))).collect();
        // On three feet it begins well inside their triangle.
        let torso =
            if legs.len() == 3 { Isometry3::translation(-0.04, 0.04, 0.0) } else { Isometry3::identity() };
        Self { sut: TorsoReach::new(&torso, &stand()), model, feet }
    }

    fn to(&mut self, target: &Isometry3<f64>) -> Isometry3<f64> {
        let (start, mut last) = (self.sut.torso, self.sut.torso);
        for tick in 1..=800 {
            let wanted = start.lerp_slerp(target, (f64::from(tick) / 400.0).min(1.0));
            let Self { model, feet, sut } = self;
            let now = sut.nearest(model, &footing(feet), &wanted, DT_S);
            let moved = (now.translation.vector - last.translation.vector).norm();
            let turned = now.rotation.angle_to(&last.rotation);
            assert!(moved < 1.01 * SPEED_M_S * DT_S && turned < 1.01 * SPEED_RAD_S * DT_S, "{tick}");
            last = now;
        }
        last
    }

    /// What is least left of the joints' ranges, rad, and of the centre of mass's margin and the mounts' clearance, m.
    fn least_room(&self) -> [f64; 2] {
        let (mut angle, mut way) = (f64::INFINITY, f64::INFINITY);
        let feet: Vec<_> = self.feet.iter().map(|(_, foot)| from_above(foot)).collect();
        for (corner, inwards) in edges(&feet) {
            let com = from_above(&self.sut.torso.translation.vector);
            way = way.min(inwards.dot(&(com - corner)) - MARGIN_M);
        }
        let ground = Ground::at(footing(&self.feet).ground_m, &self.sut.torso);
        let bodies = body_poses(&self.model, &self.sut.joints);
        for (leg, foot) in &self.feet {
            let reached = self.sut.torso * torso_from_frame(&self.model, &self.sut.joints, Frame::Foot(*leg));
            let off = (reached.translation.vector - foot).norm();
            assert!(off < 1e-3, "{leg:?} {off} {} {}", self.sut.joints, self.sut.torso);
            for (joint, range) in (leg.first_joint()..).zip(range().leg()) {
                let at = self.sut.joints[joint];
                angle = angle.min(at - range.min).min(range.max - at);
            }
            for end in ground.altitudes(*leg, &self.model.collision, &bodies) {
                if end.link.part == Part::Mount {
                    way = way.min(end.height - range().ground_m);
                }
            }
        }
        [angle, way]
    }
}

fn pose(to: [f64; 3], turn: [f64; 3]) -> Isometry3<f64> {
    Isometry3::new(to.into(), turn.into())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn wherever_the_torso_is_called_its_legs_can_hold_it_and_it_comes_back(
        to in prop::array::uniform3(-0.15..0.15f64), turn in prop::array::uniform3(-0.5..0.5f64), four: bool,
    ) {
        let three = [Leg::FrontLeft, Leg::RearRight, Leg::RearLeft];
        let mut stand = if four { Stand::new(&Leg::ALL) } else { Stand::new(&three) };
        let start = stand.sut.torso;
        stand.to(&pose(to, turn));
        let [angle, way] = stand.least_room();
        prop_assert!(angle > -5e-3 && way > -2e-3, "{angle} {way}");
        let back = stand.to(&start).inverse() * start;
        prop_assert!(back.translation.vector.norm() < 1e-6 && back.rotation.angle() < 1e-6, "{back}");
    }
}

#[test]
fn a_lean_that_the_legs_can_hold_is_left_alone() {
    let mut stand = Stand::new(&Leg::ALL);
    let goal = pose([0.02, -0.02, -0.05], [0.1, -0.1, 0.15]);
    let off = stand.to(&goal).inverse() * goal;
    assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-9, "{off}");
}

#[test]
fn a_torso_that_is_called_too_high_stops_with_its_knees_bent() {
    let mut stand = Stand::new(&Leg::ALL);
    let reached = stand.to(&pose([0.0, 0.0, 0.3], [0.0; 3]));
    // 2 * 0.213 cos of half of the straightest knee, from where it stands at 0.426 cos 0.9.
    let straightest = -range().calf.max / 2.0;
    let expected = 0.426 * (straightest.cos() - 0.9_f64.cos());
    assert!((reached.translation.z - expected).abs() < 3e-3, "{reached} {expected}");
}
