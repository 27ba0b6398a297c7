//! Laws of the whole-body controller, over random states.

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::Path;

use locoman_robot::{
    dynamics::{Motion, State},
    joints::{JointVector, Leg, Side},
    model::{Frame, Model},
    wbc::{
        ContactSet, ForceSource, Objective, PointReference, RotationReference, WbcFault, WbcOutput,
        WbcSettings, WholeBodyController,
    },
};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;

fn model() -> Model {
    Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/robot")).unwrap()
}

fn stand() -> JointVector {
    let mut position = JointVector::zeros();
    for leg in Leg::ALL {
        position.fixed_rows_mut::<3>(leg.first_joint()).copy_from_slice(&[0.0, 0.9, -1.8]);
    }
    for (side, sign) in [(Side::Right, -1.0), (Side::Left, 1.0)] {
        let stow = [-std::f64::consts::PI, sign * 0.05, 0.0];
        position.fixed_rows_mut::<3>(side.first_arm_joint()).copy_from_slice(&stow);
    }
    position
}

/// Near standing, right arm deployed; legs, arm and torso moved and moving at random.
fn state() -> impl Strategy<Value = State> {
    let numbers = |range: f64, count| prop::collection::vec(-range..range, count);
    (numbers(0.25, 18), numbers(1.0, 18), numbers(0.3, 6), numbers(0.3, 6)).prop_map(
        |(joints, speeds, twist, pose)| {
            let mut position = stand();
            position.fixed_rows_mut::<3>(Side::Right.first_arm_joint()).copy_from_slice(&[-0.4, 0.2, 0.3]);
            State {
                world_from_torso: Isometry3::from_parts(
                    Translation3::new(pose[0], pose[1], pose[2]),
                    UnitQuaternion::from_euler_angles(pose[3], pose[4], pose[5]),
                ),
                torso_twist: Vector6::from_vec(twist),
                position: position + JointVector::from_vec(joints),
                velocity: JointVector::from_vec(speeds),
            }
        },
    )
}

/// Small demands of every kind, in the order of a mode.
fn references() -> impl Strategy<Value = Vec<Vector3<f64>>> {
    prop::collection::vec((-0.03..0.03_f64, -0.03..0.03_f64, -0.03..0.03_f64), 15)
        .prop_map(|triples| triples.into_iter().map(|(x, y, z)| Vector3::new(x, y, z)).collect())
}

/// Settings whose limits never act, so that the laws of the hierarchy are seen alone.
fn unlimited() -> WbcSettings {
    let mut settings = WbcSettings { max_joint_acceleration: 1e9, ..WbcSettings::default() };
    let objectives = &mut settings.objectives;
    for gains in [
        &mut objectives.torso_position,
        &mut objectives.torso_orientation,
        &mut objectives.foot_position,
        &mut objectives.gripper_position,
        &mut objectives.gripper_orientation,
        &mut objectives.arm_posture,
    ] {
        gains.max_error = 10.0;
        gains.max_acceleration = 1e9;
    }
    settings
}

struct Bench {
    model: Model,
    sut: WholeBodyController,
    output: WbcOutput,
}

impl Bench {
    fn new(settings: WbcSettings) -> Self {
        Self { model: model(), sut: WholeBodyController::new(settings), output: WbcOutput::hold(stand()) }
    }

    fn step(&mut self, state: &State, objectives: &[Objective], contacts: &ContactSet) -> WbcOutput {
        self.sut.step(&self.model, state, objectives, contacts, &mut self.output);
        self.output
    }
}

fn point(at: Vector3<f64>, demand: &[Vector3<f64>]) -> PointReference {
    PointReference { position: at + demand[0], velocity: demand[1], acceleration: demand[2] * 30.0 }
}

fn turned(at: UnitQuaternion<f64>, demand: &[Vector3<f64>]) -> RotationReference {
    RotationReference {
        orientation: UnitQuaternion::from_scaled_axis(demand[0]) * at,
        angular_velocity: demand[1],
        angular_acceleration: demand[2] * 30.0,
    }
}

/// Three-legged single-gripper manipulation, right side.
fn single_gripper(bench: &mut Bench, state: &State, demands: &[Vector3<f64>]) -> Vec<Objective> {
    bench.step(state, &[], &ContactSet::STANCE);
    let dynamics = bench.sut.dynamics();
    let torso = dynamics.frame(Frame::Torso).world_from_frame;
    let gripper = dynamics.frame(Frame::Gripper(Side::Right)).world_from_frame;
    let left = state.position.fixed_rows::<3>(Side::Left.first_arm_joint()).into_owned();
    vec![
        Objective::TorsoPosition(point(torso.translation.vector, &demands[0..3])),
        Objective::TorsoOrientation(turned(torso.rotation, &demands[3..6])),
        Objective::GripperPosition(Side::Right, point(gripper.translation.vector, &demands[6..9])),
        Objective::GripperOrientation(Side::Right, turned(gripper.rotation, &demands[9..12])),
        Objective::ArmPosture(Side::Left, point(left, &demands[12..15])),
    ]
}

/// The acceleration of torso and joints that the output's torques and forces make.
fn forward_dynamics(bench: &Bench) -> Motion {
    let dynamics = bench.sut.dynamics();
    let mut force = -dynamics.bias();
    for leg in Leg::ALL {
        let jacobian = dynamics.frame(Frame::Foot(leg)).jacobian;
        force += jacobian.fixed_rows::<3>(0).tr_mul(&bench.output.foot_force[leg.index()]);
    }
    for joint in 0..18 {
        force[6 + joint] += bench.output.torque[joint];
    }
    dynamics.mass_matrix().cholesky().unwrap().solve(&force)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn torques_and_forces_satisfy_the_equations_of_motion(state in state(), demands in references()) {
        let mut bench = Bench::new(unlimited());
        let objectives = single_gripper(&mut bench, &state, &demands);
        let contacts = ContactSet::without(Leg::FrontRight);
        let output = bench.step(&state, &objectives, &contacts);
        prop_assume!(output.status.limited == 0);
        prop_assert_eq!(output.status.forces, ForceSource::ActiveSet);

        // What the stance feet do, apart from what the forces cannot give.
        let mut acceleration = forward_dynamics(&bench);
        for axis in 0..6 {
            acceleration[axis] -= output.torso_slack[axis];
        }
        for leg in contacts.legs() {
            let foot = bench.sut.dynamics().frame(Frame::Foot(leg));
            let motion = foot.jacobian * acceleration + foot.bias_acceleration;
            prop_assert!(motion.fixed_rows::<3>(0).amax() < 1e-6, "{leg:?} accelerates by {motion}");
        }
    }

    #[test]
    fn forces_lie_in_the_friction_pyramid(state in state(), demands in references()) {
        let mut bench = Bench::new(WbcSettings::default());
        let objectives = single_gripper(&mut bench, &state, &demands);
        let contacts = ContactSet::without(Leg::FrontRight).with_share(Leg::RearLeft, 0.3);
        let output = bench.step(&state, &objectives, &contacts);
        let settings = WbcSettings::default().contact;
        let weight = bench.model.mass() * 9.81;
        for leg in Leg::ALL {
            let force = output.foot_force[leg.index()];
            let most = settings.max_vertical * weight * contacts.share(leg);
            prop_assert!(force.z <= most + 1e-4 && force.z >= 0.0);
            prop_assert!(force.x.abs().max(force.y.abs()) <= settings.friction * force.z + 1e-4);
        }
    }

    #[test]
    fn torques_positions_and_velocities_stay_within_limits(state in state(), demands in references()) {
        let mut bench = Bench::new(WbcSettings::default());
        let demands: Vec<_> = demands.iter().map(|demand| demand * 30.0).collect();
        let objectives = single_gripper(&mut bench, &state, &demands);
        let output = bench.step(&state, &objectives, &ContactSet::without(Leg::FrontRight));
        let model = &bench.model;
        for joint in 0..18 {
            prop_assert!(output.torque[joint].abs() <= model.max_torque[joint]);
            prop_assert!(output.velocity[joint].abs() <= model.max_velocity[joint]);
            prop_assert!((model.lower[joint]..=model.upper[joint]).contains(&output.position[joint]));
        }
    }
}

#[test]
fn standing_still_takes_the_weight_and_asks_for_no_motion() {
    let mut bench = Bench::new(WbcSettings::default());
    let state = State::at_rest(stand());
    let objectives = [
        Objective::TorsoPosition(PointReference::hold(Vector3::zeros())),
        Objective::TorsoOrientation(RotationReference::hold(UnitQuaternion::identity())),
        Objective::ArmPosture(Side::Right, PointReference::hold(stand().fixed_rows::<3>(12).into_owned())),
        Objective::ArmPosture(Side::Left, PointReference::hold(stand().fixed_rows::<3>(15).into_owned())),
    ];
    let output = bench.step(&state, &objectives, &ContactSet::STANCE);
    let total: Vector3<f64> = output.foot_force.iter().sum();
    // The slack costs little enough that a few millinewtons are saved.
    assert!((total.z - bench.model.mass() * 9.81).abs() < 0.5, "{total}");
    assert!((output.position - stand()).amax() < 1e-12);
    assert!(output.velocity.amax() < 1e-12);
    // facts: hip 1.8 to 1.9, thigh 0.35 to 0.41, calf 5.1 to 5.3 N m by the authors' program.
    for leg in Leg::ALL {
        assert!((4.5..6.0).contains(&output.torque[leg.first_joint() + 2]), "{}", output.torque);
    }
    assert_eq!(output.status.fault, None);
}

#[test]
fn a_state_that_is_not_finite_repeats_the_last_command() {
    let mut bench = Bench::new(WbcSettings::default());
    let mut state = State::at_rest(stand());
    let good = bench.step(&state, &[], &ContactSet::STANCE);
    state.velocity[3] = f64::NAN;
    let bad = bench.step(&state, &[], &ContactSet::STANCE);
    assert_eq!(bad.status.fault, Some(WbcFault::State));
    assert_eq!((bad.position, bad.velocity, bad.torque), (good.position, good.velocity, good.torque));
}

#[test]
fn an_objective_that_is_not_finite_is_left_out() {
    let mut bench = Bench::new(WbcSettings::default());
    let state = State::at_rest(stand());
    let objectives = [
        Objective::TorsoPosition(PointReference::hold(Vector3::new(f64::NAN, 0.0, 0.0))),
        Objective::TorsoOrientation(RotationReference::hold(UnitQuaternion::identity())),
    ];
    let output = bench.step(&state, &objectives, &ContactSet::STANCE);
    assert_eq!(output.status.fault, Some(WbcFault::Reference));
    assert!(output.is_finite());
}

#[test]
fn without_contact_there_are_no_forces() {
    let mut bench = Bench::new(WbcSettings::default());
    let mut contacts = ContactSet::STANCE;
    for leg in Leg::ALL {
        contacts = contacts.with_share(leg, 0.0);
    }
    let output = bench.step(&State::at_rest(stand()), &[], &contacts);
    assert_eq!(output.status.forces, ForceSource::NoContact);
    assert!(output.foot_force.iter().all(|force| force.norm() == 0.0));
    assert!(output.is_finite());
}
