//! Control steps and reaching take no memory once they run.

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

#[path = "../../tests/shared/counting_allocator.rs"]
mod counting_allocator;

use std::path::Path;

use counting_allocator::counted;
use locoman_robot::{
    collision::Ground,
    commander::{Footing, Limits, Reach, TorsoReach},
    dynamics::State,
    joints::{JointVector, Leg, Side},
    kinematics::torso_from_frame,
    model::{FOOT_RADIUS_M, Frame, Model},
    wbc::{
        ContactSet, Objective, PointReference, RotationReference, WbcOutput, WbcSettings, WholeBodyController,
    },
};
use nalgebra::{Isometry3, UnitQuaternion, Vector2, Vector3};

fn model() -> Model {
    Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/robot")).unwrap()
}

fn stand() -> JointVector {
    let mut position = JointVector::zeros();
    for leg in Leg::ALL {
        position.fixed_rows_mut::<3>(leg.first_joint()).copy_from_slice(&[0.0, 0.9, -1.8]);
    }
    position
}

#[test]
fn the_control_step_allocates_nothing() {
    let model = model();
    let mut sut = WholeBodyController::new(WbcSettings::default());
    let mut state = State::at_rest(stand());
    let mut output = WbcOutput::hold(state.position);

    let mut allocated = 0;
    for step in 0..2000_u32 {
        // Sways through all contact patterns, and far enough for the friction pyramid to act.
        let phase = f64::from(step) * 0.01;
        let sway = Vector3::new(phase.sin(), (0.7 * phase).cos(), (1.3 * phase).sin());
        state.position = stand() + JointVector::from_fn(|row, _| 0.05 * (phase + row as f64).sin());
        let objectives = [
            Objective::TorsoPosition(PointReference::hold(sway * 0.3)),
            Objective::TorsoOrientation(RotationReference::hold(UnitQuaternion::from_scaled_axis(
                sway * 0.2,
            ))),
            Objective::GripperPosition(Side::Right, PointReference::hold(sway)),
            Objective::GripperOrientation(Side::Right, RotationReference::hold(UnitQuaternion::identity())),
            Objective::ArmPosture(Side::Left, PointReference::hold(Vector3::zeros())),
        ];
        let contacts = match step % 3 {
            0 => ContactSet::STANCE,
            1 => ContactSet::without(Leg::FrontRight),
            _ => ContactSet::without(Leg::FrontLeft).with_share(Leg::RearLeft, 0.0),
        };

        allocated += counted(|| sut.step(&model, &state, &objectives, &contacts, &mut output)).1;
        assert_eq!(output.status.fault, None);
    }
    assert_eq!(allocated, 0);
}

/// The torso leans to where limits stop it, the hand turns until a detour takes it the other way round.
#[test]
fn reaching_allocates_nothing_also_at_limits_and_on_a_detour() {
    const DT_S: f64 = 0.0025;
    let (model, limits) = (model(), Limits::default());
    let mut joints = stand();
    joints.fixed_rows_mut::<3>(0).copy_from_slice(&[-0.1, 0.9, -2.2]);
    joints.fixed_rows_mut::<3>(12).copy_from_slice(&[-0.4, 0.0, 0.0]);
    let at = |frame| torso_from_frame(&model, &joints, frame);
    let feet = [Leg::FrontLeft, Leg::RearRight, Leg::RearLeft]
        .map(|leg| (leg, at(Frame::Foot(leg)).translation.vector));
    let ground_m = feet[0].1.z - FOOT_RADIUS_M;
    let footing = Footing {
        feet: &feet,
        com_from_torso: Vector2::new(-0.04, 0.04),
        margin_m: limits.support_margin_m,
        ground_m,
        range: limits.reach,
    };
    let mut torso_reach = TorsoReach::new(&Isometry3::identity(), &joints);
    let mut reach = Reach::new(Side::Right, &joints, limits.reach);
    let gripper = at(Frame::Gripper(Side::Right));

    let (mut allocated, mut detours, mut held_back) = (0, 0, 0.0_f64);
    for step in 0..6000_u32 {
        let share = (f64::from(step) / 2000.0).min(1.0);
        let lean = Isometry3::new(Vector3::new(0.1, 0.0, 0.1) * share, Vector3::new(0.0, 0.5, 0.0) * share);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 4.5 * share);
        let ((torso, detour), taken) = counted(|| {
            let torso = torso_reach.nearest(&model, &footing, &lean, DT_S);
            let ground = Ground::at(ground_m, &Isometry3::identity());
            reach.nearest(&model, &joints, &ground, &(gripper * turn), DT_S);
            (torso, reach.detour(&model))
        });
        allocated += taken;
        held_back = held_back.max((torso.translation.vector - lean.translation.vector).norm());
        detours += u32::from(detour.is_some());
        for (joint, angle) in Side::Right.limb_joints().into_iter().zip(reach.limb().iter()) {
            joints[joint] = *angle;
        }
    }
    assert!(detours > 100 && held_back > 0.01, "{detours} {held_back}");
    assert_eq!(allocated, 0);
}
