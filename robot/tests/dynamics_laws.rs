//! Laws that kinematics and dynamics obey in every state, checked by finite differences.

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::Path;

use locoman_robot::{
    dynamics::{DOF, Dynamics, Motion, State},
    joints::JointVector,
    model::{Frame, Model},
};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;

/// s: central differences are good to about its square, and to rounding over it.
const STEP: f64 = 1e-5;
/// Of quantities of about one, by the above.
const TOLERANCE: f64 = 1e-6;

fn model() -> Model {
    Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/robot")).unwrap()
}

fn state() -> impl Strategy<Value = State> {
    prop::collection::vec(-1.0..1.0_f64, 48).prop_map(|numbers| State {
        world_from_torso: Isometry3::from_parts(
            Translation3::new(numbers[0], numbers[1], numbers[2]),
            UnitQuaternion::from_euler_angles(numbers[3], numbers[4], 3.0 * numbers[5]),
        ),
        torso_twist: Vector6::from_column_slice(&numbers[6..12]),
        position: JointVector::from_column_slice(&numbers[12..30]) * 2.0,
        velocity: JointVector::from_column_slice(&numbers[30..48]) * 2.0,
    })
}

/// The state after `time` seconds of moving with its velocity held along the torso's axes.
fn moved(state: &State, time: f64) -> State {
    let rotation = state.world_from_torso.rotation;
    let turn = Vector3::from(state.torso_twist.fixed_rows::<3>(3)) * time;
    // Along the middle of the turn: exact to second order, which is all that differences see.
    let middle = rotation * UnitQuaternion::from_scaled_axis(turn * 0.5);
    let step = middle * Vector3::from(state.torso_twist.fixed_rows::<3>(0)) * time;
    State {
        world_from_torso: Isometry3::from_parts(
            Translation3::from(state.world_from_torso.translation.vector + step),
            rotation * UnitQuaternion::from_scaled_axis(turn),
        ),
        position: state.position + state.velocity * time,
        ..*state
    }
}

fn at(model: &Model, state: &State) -> Dynamics {
    let mut dynamics = Dynamics::new();
    dynamics.update(model, state);
    dynamics
}

fn kinetic(dynamics: &Dynamics, motion: &Motion) -> f64 {
    0.5 * motion.dot(&(dynamics.mass_matrix() * motion))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_mass_matrix_is_symmetric_and_positive_definite(state in state()) {
        let dynamics = at(&model(), &state);
        let mass_matrix = dynamics.mass_matrix();
        prop_assert_eq!(*mass_matrix, mass_matrix.transpose());
        prop_assert!(mass_matrix.cholesky().is_some());
    }

    #[test]
    fn a_frames_velocity_is_the_rate_of_its_pose(state in state()) {
        let model = model();
        let (before, now, after) =
            (at(&model, &moved(&state, -STEP)), at(&model, &state), at(&model, &moved(&state, STEP)));
        for frame in Frame::ALL {
            let motion = now.frame(frame);
            let (first, last) = (before.frame(frame).world_from_frame, after.frame(frame).world_from_frame);
            let linear = (last.translation.vector - first.translation.vector) / (2.0 * STEP);
            let angular = (last.rotation * first.rotation.inverse()).scaled_axis() / (2.0 * STEP);
            let velocity = motion.jacobian * state.motion();
            prop_assert!((velocity - motion.velocity).amax() < 1e-12);
            prop_assert!((linear - velocity.fixed_rows::<3>(0)).amax() < TOLERANCE, "{frame:?}");
            prop_assert!((angular - velocity.fixed_rows::<3>(3)).amax() < TOLERANCE, "{frame:?}");
        }
    }

    #[test]
    fn the_bias_acceleration_is_the_rate_of_the_jacobian_times_v(state in state()) {
        let model = model();
        let (before, now, after) =
            (at(&model, &moved(&state, -STEP)), at(&model, &state), at(&model, &moved(&state, STEP)));
        for frame in Frame::ALL {
            let rate = (after.frame(frame).jacobian - before.frame(frame).jacobian) / (2.0 * STEP);
            let bias = now.frame(frame).bias_acceleration;
            prop_assert!((rate * state.motion() - bias).amax() < 10.0 * TOLERANCE, "{frame:?}");
            if let Some(joint) = frame.joint() {
                let torso = &state.world_from_torso;
                let point = torso.inv_mul(&now.frame(frame).world_from_frame).translation.vector;
                let at_point = now.bias_acceleration_at(joint, &point);
                prop_assert!((torso.rotation * at_point - bias.fixed_rows::<3>(0)).amax() < 1e-9);
            }
        }
    }

    /// d(½ vᵀAv)/dt = vᵀ(τ - g) for every τ: the Coriolis forces do no work.
    #[test]
    fn energy_changes_only_by_work(state in state()) {
        let model = model();
        let motion = state.motion();
        let (before, now, after) =
            (at(&model, &moved(&state, -STEP)), at(&model, &state), at(&model, &moved(&state, STEP)));
        let rate_at_constant_motion = (kinetic(&after, &motion) - kinetic(&before, &motion)) / (2.0 * STEP);
        let coriolis = now.bias() - now.gravity();
        prop_assert!((rate_at_constant_motion - motion.dot(&coriolis)).abs() < 100.0 * TOLERANCE);

        let potential = |dynamics: &Dynamics| model.mass() * 9.81 * dynamics.com().z;
        let lift = (potential(&after) - potential(&before)) / (2.0 * STEP);
        prop_assert!((lift - motion.dot(now.gravity())).abs() < 10.0 * TOLERANCE * model.mass());
    }

    #[test]
    fn a_used_workspace_gives_the_same_as_a_new_one(first in state(), second in state()) {
        let model = model();
        let mut used = at(&model, &first);
        used.update(&model, &second);
        let new = at(&model, &second);
        prop_assert_eq!(used.mass_matrix(), new.mass_matrix());
        prop_assert_eq!(used.bias(), new.bias());
        for frame in Frame::ALL {
            prop_assert_eq!(used.frame(frame), new.frame(frame));
        }
    }
}

#[test]
fn gravity_pulls_on_the_torso_with_the_whole_weight() {
    let model = model();
    let dynamics = at(&model, &State::at_rest(JointVector::zeros()));
    let mut expected = Vector3::zeros();
    expected.z = model.mass() * 9.81;
    assert!((dynamics.gravity().fixed_rows::<3>(0) - expected).amax() < 1e-9);
    assert_eq!(DOF, 24);
}
