//! Modes at states that change from step to step.

use std::path::Path;

use locoman_robot::{
    dynamics::State,
    joints::{JointVector, Leg, Side},
    model::Model,
    wbc::{ContactSet, Objective, PointReference, RotationReference},
};
use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};

/// A mode with its objectives.
pub struct Scene {
    pub name: &'static str,
    pub contacts: ContactSet,
    pub objectives: Vec<Objective>,
    /// Medians of others' steps of this kind.
    pub peers: &'static str,
}

pub fn model() -> Model {
    Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/robot")).expect("configs/robot")
}

/// Standing, swaying with the step.
pub fn state(step: u32) -> State {
    let phase = f64::from(step % 10_000) * 0.01;
    let mut position = JointVector::zeros();
    for leg in Leg::ALL {
        position.fixed_rows_mut::<3>(leg.first_joint()).copy_from_slice(&[0.0, 0.9, -1.8]);
    }
    for side in Side::ALL {
        position.fixed_rows_mut::<3>(side.first_arm_joint()).copy_from_slice(&[-0.4, 0.1, 0.2]);
    }
    State {
        world_from_torso: Isometry3::rotation(Vector3::new(0.05, 0.1, 0.0) * phase.sin()),
        torso_twist: Vector6::repeat(0.05 * phase.cos()),
        position: position + JointVector::from_fn(|row, _| 0.05 * (phase + row as f64).sin()),
        velocity: JointVector::from_fn(|row, _| 0.2 * (phase + row as f64).cos()),
    }
}

pub fn scenes() -> [Scene; 3] {
    let still = PointReference::hold(Vector3::zeros());
    let level = RotationReference::hold(UnitQuaternion::identity());
    let torso = [Objective::TorsoPosition(still), Objective::TorsoOrientation(level)];
    let gripper = PointReference::hold(Vector3::new(0.35, -0.18, -0.2));
    let arms = [Objective::ArmPosture(Side::Right, still), Objective::ArmPosture(Side::Left, still)];
    let single = [
        Objective::GripperPosition(Side::Right, gripper),
        Objective::GripperOrientation(Side::Right, level),
        Objective::ArmPosture(Side::Left, still),
    ];
    [
        Scene {
            name: "stance",
            contacts: ContactSet::STANCE,
            objectives: [&torso[..], &arms].concat(),
            peers: "LocoMan (Python) 1577",
        },
        Scene {
            name: "single gripper",
            contacts: ContactSet::without(Leg::FrontRight),
            objectives: [&torso[..], &single].concat(),
            peers: "LocoMan (Python) 2282, PlaCo 13 + 39",
        },
        Scene {
            name: "trot",
            contacts: ContactSet::without(Leg::FrontRight).with_share(Leg::RearLeft, 0.0),
            objectives: [&torso[..], &arms].concat(),
            peers: "LocoMan (Python) 2121",
        },
    ]
}
