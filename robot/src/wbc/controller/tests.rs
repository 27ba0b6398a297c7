//! Strict priority over random states: no objective moves a stance foot or one that stands before it.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;

use super::*;
use crate::{
    collision::{CollisionModel, Ground},
    joints::{JointVector, Leg, Side},
    model::{FOOT_RADIUS_M, Frame, test_model},
    wbc::{PointReference, RotationReference, StopSettings},
};

/// m/s, m/s² and their angular kin; the issue's own number.
const LEAKAGE: f64 = 1e-8;
/// Rounding grows with the size of the accelerations.
const RELATIVE: f64 = 1e-11;

/// Settings that let everything go through the ground.
fn bottomless(settings: WbcSettings) -> WbcSettings {
    WbcSettings { stops: StopSettings { ground_clearance: -1e9, ..settings.stops }, ..settings }
}

/// Settings whose limits never act, so that the hierarchy is seen alone.
fn unlimited() -> WbcSettings {
    let mut settings = WbcSettings { max_joint_acceleration: 1e12, ..bottomless(WbcSettings::default()) };
    let objectives = &mut settings.objectives;
    for gains in [
        &mut objectives.torso_position,
        &mut objectives.torso_orientation,
        &mut objectives.foot_position,
        &mut objectives.gripper_position,
        &mut objectives.gripper_orientation,
        &mut objectives.arm_posture,
    ] {
        (gains.max_error, gains.max_acceleration) = (1e3, 1e12);
    }
    settings
}

/// Joints that may go anywhere, at any speed, through each other.
fn without_ends(model: &mut Model) {
    model.collision = CollisionModel::default();
    model.max_velocity.fill(1e9);
    model.lower.fill(-1e9);
    model.upper.fill(1e9);
}

fn numbers(count: usize) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-1.0..1.0_f64, count)
}

/// Anywhere within the joints' ranges, moving.
fn random_state(model: &Model, numbers: &[f64]) -> State {
    let share = |row: usize| 0.5 + 0.5 * numbers[row];
    State {
        world_from_torso: Isometry3::from_parts(
            Translation3::new(numbers[18], numbers[19], numbers[20]),
            UnitQuaternion::from_euler_angles(numbers[21], numbers[22], 3.0 * numbers[23]),
        ),
        torso_twist: Vector6::from_column_slice(&numbers[24..30]),
        position: JointVector::from_fn(|row, _| {
            model.lower[row] + share(row) * (model.upper[row] - model.lower[row])
        }),
        velocity: JointVector::from_fn(|row, _| 3.0 * numbers[30 + row]),
    }
}

/// Every kind of objective at once, more than there are degrees of freedom, with demands of all sizes.
fn random_objectives(demands: &[f64]) -> Vec<Objective> {
    let vector = |index: usize| Vector3::from_column_slice(&demands[3 * index..3 * index + 3]);
    let point = |first: usize| PointReference {
        position: vector(first),
        velocity: vector(first + 1),
        acceleration: vector(first + 2) * 10.0,
    };
    let rotation = |first: usize| RotationReference {
        orientation: UnitQuaternion::from_scaled_axis(vector(first)),
        angular_velocity: vector(first + 1),
        angular_acceleration: vector(first + 2) * 10.0,
    };
    vec![
        Objective::TorsoPosition(point(0)),
        Objective::TorsoOrientation(rotation(3)),
        Objective::FootPosition(Leg::FrontRight, point(6)),
        Objective::GripperPosition(Side::Right, point(9)),
        Objective::GripperOrientation(Side::Right, rotation(12)),
        // On a stance leg: in conflict with everything before it.
        Objective::GripperPosition(Side::Left, point(15)),
        Objective::GripperOrientation(Side::Left, rotation(18)),
        Objective::ArmPosture(Side::Left, point(21)),
    ]
}

/// What a solution makes of a task's rows.
fn reached(task: &Task, solution: &Motion) -> Vector3<f64> {
    Vector3::from_fn(|row, _| (0..DOF).map(|column| task.rows[row][column] * solution[column]).sum())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn stopped_joints_keep_their_ranges_and_leave_the_stance_feet_alone(
        numbers in numbers(48),
        demands in numbers(72),
    ) {
        let mut model = test_model();
        // Links of random postures overlap, and push joints beyond anything.
        model.collision = CollisionModel::default();
        let state = random_state(&model, &numbers);
        let objectives = random_objectives(&demands);
        let contacts = ContactSet::without(Leg::FrontRight);
        let mut sut = WholeBodyController::new(bottomless(WbcSettings::default()));
        sut.dynamics.update(&model, &state);
        sut.track(&model, &state, &objectives[..5], &contacts, &mut WbcStatus::default());
        let step = sut.tracked.step;
        for leg in contacts.legs() {
            let jacobian = sut.dynamics.frame(Frame::Foot(leg)).jacobian;
            prop_assert!((jacobian.fixed_rows::<3>(0) * step).amax() < LEAKAGE);
        }
        // The swinging limb has room for all its stops.
        for joint in [0, 1, 2, 12, 13, 14] {
            let wanted = state.position[joint] + step[6 + joint];
            prop_assert!(wanted > model.lower[joint] - 1e-9 && wanted < model.upper[joint] + 1e-9, "{joint}");
        }
    }

    #[test]
    fn no_objective_moves_a_stance_foot_or_a_higher_one(numbers in numbers(48), demands in numbers(72)) {
        let mut model = test_model();
        let state = random_state(&model, &numbers);
        without_ends(&mut model);
        let objectives = random_objectives(&demands);
        let contacts = ContactSet::without(Leg::FrontRight);
        let mut sut = WholeBodyController::new(unlimited());
        sut.dynamics.update(&model, &state);

        let mut before: Vec<[Vector3<f64>; 3]> = Vec::new();
        for count in 0..=objectives.len() {
            sut.track(&model, &state, &objectives[..count], &contacts, &mut WbcStatus::default());
            let Tracked { step: position, velocity, acceleration } = sut.tracked;
            let tolerance = LEAKAGE + RELATIVE * acceleration.amax();

            for leg in contacts.legs() {
                let foot = sut.dynamics.frame(Frame::Foot(leg));
                let jacobian = foot.jacobian.fixed_rows::<3>(0);
                prop_assert!((jacobian * position).amax() < LEAKAGE);
                prop_assert!((jacobian * velocity).amax() < LEAKAGE);
                let motion = jacobian * acceleration + foot.bias_acceleration.fixed_rows::<3>(0);
                prop_assert!(motion.amax() < tolerance, "{leg:?} {motion}, {}", acceleration.amax());
            }
            let all: Vec<_> = objectives[..count]
                .iter()
                .map(|objective| {
                    let gains = sut.settings.objectives.of(objective.kind());
                    let task = objective.task(&Robot { state: &state, dynamics: &sut.dynamics }, gains).unwrap();
                    [&position, &velocity, &acceleration].map(|solution| reached(&task, solution))
                })
                .collect();
            for (index, (now, then)) in all.iter().zip(&before).enumerate() {
                prop_assert!((now[0] - then[0]).amax() < LEAKAGE, "position of objective {index}");
                prop_assert!((now[1] - then[1]).amax() < LEAKAGE, "velocity of objective {index}");
                prop_assert!((now[2] - then[2]).amax() < tolerance, "acceleration of objective {index}");
            }
            before = all;
        }
    }
}

#[test]
fn objectives_that_can_be_reached_are_reached() {
    let mut model = test_model();
    without_ends(&mut model);
    let mut position = JointVector::zeros();
    for leg in Leg::ALL {
        position.fixed_rows_mut::<3>(leg.first_joint()).copy_from_slice(&[0.05, 0.9, -1.8]);
    }
    position.fixed_rows_mut::<3>(12).copy_from_slice(&[-0.4, 0.1, 0.2]);
    let state = State::at_rest(position);
    let mut sut = WholeBodyController::new(unlimited());
    sut.dynamics.update(&model, &state);
    let gripper = sut.dynamics.frame(Frame::Gripper(Side::Right)).world_from_frame;
    let nudge = Vector3::new(0.01, -0.02, 0.015);
    let point = |at: Vector3<f64>| PointReference { position: at, velocity: nudge, acceleration: nudge };
    let rotation = |at: UnitQuaternion<f64>| RotationReference {
        orientation: UnitQuaternion::from_scaled_axis(nudge) * at,
        angular_velocity: nudge,
        angular_acceleration: nudge,
    };
    let objectives = [
        Objective::TorsoPosition(point(nudge)),
        Objective::TorsoOrientation(rotation(UnitQuaternion::identity())),
        Objective::GripperPosition(Side::Right, point(gripper.translation.vector + nudge)),
        Objective::GripperOrientation(Side::Right, rotation(gripper.rotation)),
        Objective::ArmPosture(Side::Left, point(nudge)),
    ];
    let contacts = ContactSet::without(Leg::FrontRight);
    sut.track(&model, &state, &objectives, &contacts, &mut WbcStatus::default());
    let solution = sut.tracked;
    for objective in &objectives {
        let gains = sut.settings.objectives.of(objective.kind());
        let task = objective.task(&Robot { state: &state, dynamics: &sut.dynamics }, gains).unwrap();
        let position = reached(&task, &solution.step);
        let velocity = reached(&task, &solution.velocity);
        assert!((position - task.error).amax() < 1e-10, "{:?}", objective.kind());
        assert!((velocity - task.velocity).amax() < 1e-10, "{:?}", objective.kind());
        let acceleration = reached(&task, &solution.acceleration);
        assert!((acceleration - task.acceleration).amax() < 1e-8, "{:?}", objective.kind());
    }
}

#[test]
fn a_lifted_foot_stays_above_the_ground_when_its_gripper_is_called_below() {
    let model = test_model();
    let mut position = JointVector::zeros();
    for leg in Leg::ALL {
        position.fixed_rows_mut::<3>(leg.first_joint()).copy_from_slice(&[0.0, 0.9, -1.8]);
    }
    position.fixed_rows_mut::<3>(0).copy_from_slice(&[-0.1, 0.7, -1.85]);
    position.fixed_rows_mut::<3>(12).copy_from_slice(&[-0.4, 0.0, 0.0]);
    let state = State::at_rest(position);
    let contacts = ContactSet::without(Leg::FrontRight);
    let mut sut = WholeBodyController::new(WbcSettings::default());
    sut.dynamics.update(&model, &state);
    let gripper = sut.dynamics.frame(Frame::Gripper(Side::Right)).world_from_frame;
    let below = gripper.translation.vector - Vector3::new(0.0, 0.0, 0.2);
    let objectives = [
        Objective::TorsoPosition(PointReference::hold(Vector3::zeros())),
        Objective::TorsoOrientation(RotationReference::hold(UnitQuaternion::identity())),
        Objective::GripperPosition(Side::Right, PointReference::hold(below)),
        Objective::GripperOrientation(Side::Right, RotationReference::hold(gripper.rotation)),
    ];
    let mut status = WbcStatus::default();
    sut.track(&model, &state, &objectives, &contacts, &mut status);
    let step = sut.tracked.step;

    let collision = &model.collision;
    let foot = sut.dynamics.frame(Frame::Foot(Leg::RearLeft)).world_from_frame.translation.z;
    let ground = Ground::at(foot - FOOT_RADIUS_M, &state.world_from_torso);
    for end in ground.altitudes(Leg::FrontRight, collision, &sut.dynamics) {
        let lower = end.gradient(&ground, &sut.dynamics).dot(&step.fixed_rows::<18>(6));
        let reached = end.height + lower;
        assert!(reached > sut.settings.stops.ground_clearance - 1e-6, "{} at {reached}", end.link);
    }
    assert!(status.grounded);
    // The torso does not follow the gripper down.
    assert!(step.fixed_rows::<6>(0).amax() < 1e-9, "{step}");
}
