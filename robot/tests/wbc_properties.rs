//! Laws of the whole-body controller, over random states.

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

mod situations;

use locoman_robot::{
    dynamics::{Dynamics, Motion, State},
    joints::{JOINTS, JointVector, Leg, Side},
    model::{Frame, Model},
    wbc::{
        ContactSet, ForceFailure, ForceSource, Objective, PointReference, RotationReference, Tracked,
        WbcFault, WbcOutput, WbcSettings, WholeBodyController,
    },
};
use nalgebra::{UnitQuaternion, Vector3};
use situations::{Case, Random, model};

/// Random states of each mode.
const STATES: u64 = 100_000;
/// m/s, m/s² and their angular kin.
const NOTHING: f64 = 1e-8;

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

/// The acceleration of torso and joints that the output's torques and forces make.
fn forward_dynamics(bench: &Bench) -> Motion {
    let dynamics = bench.sut.dynamics();
    let mut force = -dynamics.bias();
    for leg in Leg::ALL {
        let jacobian = dynamics.frame(Frame::Foot(leg)).jacobian;
        force += jacobian.fixed_rows::<3>(0).tr_mul(&bench.output.contact_force[leg.index()]);
    }
    for joint in 0..JOINTS {
        force[6 + joint] += bench.output.torque[joint];
    }
    dynamics.mass_matrix().cholesky().unwrap().solve(&force)
}

/// Nothing moves a stance foot.
fn stance_feet_rest(bench: &Bench, contacts: &ContactSet, tracked: &Tracked) {
    for leg in contacts.legs() {
        let foot = bench.sut.dynamics().frame(Frame::Foot(leg));
        let jacobian = foot.jacobian.fixed_rows::<3>(0);
        assert!((jacobian * tracked.step).amax() < NOTHING, "{leg:?} is moved");
        assert!((jacobian * tracked.velocity).amax() < NOTHING, "{leg:?} has a velocity");
        let acceleration = jacobian * tracked.acceleration + foot.bias_acceleration.fixed_rows::<3>(0);
        assert!(acceleration.amax() < NOTHING, "{leg:?} is accelerated by {}", acceleration.amax());
    }
}

/// What a motion does to what an objective controls.
fn effect(dynamics: &Dynamics, objective: &Objective, motion: &Motion) -> Vector3<f64> {
    let (frame, first) = match objective {
        Objective::TorsoPosition(_) => (Frame::Torso, 0),
        Objective::TorsoOrientation(_) => (Frame::Torso, 3),
        Objective::FootPosition(leg, _) => (Frame::Foot(*leg), 0),
        Objective::GripperPosition(side, _) => (Frame::Gripper(*side), 0),
        Objective::GripperOrientation(side, _) => (Frame::Gripper(*side), 3),
        Objective::LegPosture(leg, _) => {
            return motion.fixed_rows::<3>(6 + leg.first_joint()).into_owned();
        }
        Objective::ArmPosture(side, _) => {
            return motion.fixed_rows::<3>(6 + side.first_arm_joint()).into_owned();
        }
    };
    (dynamics.frame(frame).jacobian * motion).fixed_rows::<3>(first).into_owned()
}

/// What is tracked with all objectives is, for the first of them, what is tracked with these alone.
fn lower_objectives_disturb_nothing(bench: &Bench, higher: &[Objective], [all, alone]: [&Tracked; 2]) {
    for objective in higher {
        let kind = objective.kind();
        let apart = |all: &Motion, alone: &Motion| {
            let dynamics = bench.sut.dynamics();
            (effect(dynamics, objective, all) - effect(dynamics, objective, alone)).amax()
        };
        assert!(apart(&all.step, &alone.step) < NOTHING, "step of {kind:?}");
        assert!(apart(&all.velocity, &alone.velocity) < NOTHING, "velocity of {kind:?}");
        assert!(apart(&all.acceleration, &alone.acceleration) < NOTHING, "acceleration of {kind:?}");
    }
}

fn forces_lie_in_the_pyramid(bench: &Bench, contacts: &ContactSet) {
    /// N
    const INSIDE: f64 = 1e-4;
    let settings = bench.sut.settings().contact;
    let weight = bench.model.mass() * 9.81;
    for leg in Leg::ALL {
        let force = bench.output.contact_force[leg.index()];
        let most = settings.max_vertical * weight * contacts.share(leg);
        assert!(force.z <= most + INSIDE && force.z >= (settings.min_vertical * weight).min(most) - INSIDE);
        assert!(force.x.abs().max(force.y.abs()) <= settings.friction * force.z + INSIDE);
    }
}

fn everything_is_within_limits(bench: &Bench) {
    let (model, output) = (&bench.model, &bench.output);
    for joint in 0..JOINTS {
        assert!(output.torque[joint].abs() <= model.max_torque[joint]);
        assert!(output.velocity[joint].abs() <= model.max_velocity[joint]);
        assert!((model.lower[joint]..=model.upper[joint]).contains(&output.position[joint]));
    }
}

/// Torques and forces make the acceleration that was asked for, but for what the forces cannot give.
fn equations_of_motion_hold(bench: &Bench, tracked: &Tracked) {
    let mut acceleration = forward_dynamics(bench);
    for axis in 0..6 {
        acceleration[axis] -= bench.output.torso_slack[axis];
    }
    let apart = (acceleration - tracked.acceleration).amax();
    assert!(apart < 1e-7 * (1.0 + tracked.acceleration.amax()), "{apart}");
}

/// How often what was checked.
#[derive(Debug, Default)]
struct Checked {
    priorities: u64,
    motions: u64,
    limited: u64,
    /// Hips, thighs and calves of standing legs that stop.
    standing: [u64; 3],
    /// States with any of them.
    stopped_torsos: u64,
}

/// Joints of standing legs that stop, a bit for each. One that is only at its greatest torque does not.
fn standing_joints_that_stop(bench: &Bench, contacts: &ContactSet) -> u32 {
    let joints = contacts.legs().flat_map(|leg| leg.first_joint()..leg.first_joint() + 3);
    let (torque, most) = (bench.output.torque, bench.model.max_torque);
    let stops = |joint: &usize| {
        bench.output.status.limited >> joint & 1 == 1 && torque[*joint].abs() < 0.999 * most[*joint]
    };
    joints.filter(stops).fold(0, |bits, joint| bits | 1 << joint)
}

fn unlimited(output: &WbcOutput) -> bool {
    let status = &output.status;
    status.limited == 0 && !status.grounded && status.kept_apart.is_none() && status.acceleration_scale == 1.0
}

fn laws_hold_in(case: &Case, seed: u64) {
    let mut random = Random(seed);
    let mut bench = Bench::new(WbcSettings::default());
    let mut dynamics = Dynamics::new();
    let mut checked = Checked::default();
    for _ in 0..STATES {
        let state = situations::state(&mut random, &bench.model, &case.stance);
        dynamics.update(&bench.model, &state);
        let objectives = situations::objectives(&mut random, &case.objectives, &state, &dynamics);
        let contacts = situations::contacts(&mut random, &case.stance);
        let higher = (random.share() * objectives.len() as f64) as usize;
        let alone = bench.step(&state, &objectives[..higher], &contacts);
        let tracked_alone = bench.sut.tracked();
        let all = bench.step(&state, &objectives, &contacts);
        let tracked = bench.sut.tracked();

        assert_eq!(all.status.fault, None);
        stance_feet_rest(&bench, &contacts, &tracked);
        forces_lie_in_the_pyramid(&bench, &contacts);
        everything_is_within_limits(&bench);
        // A stopped joint goes before all objectives, and what scales accelerations down scales all of them.
        if unlimited(&all) && unlimited(&alone) {
            lower_objectives_disturb_nothing(&bench, &objectives[..higher], [&tracked, &tracked_alone]);
            checked.priorities += 1;
        }
        if all.status.limited == 0 {
            equations_of_motion_hold(&bench, &tracked);
            checked.motions += 1;
        }
        checked.limited += u64::from(all.status.limited != 0);
        let stopped = standing_joints_that_stop(&bench, &contacts);
        checked.stopped_torsos += u64::from(stopped != 0);
        for joint in 0..12 {
            checked.standing[joint % 3] += u64::from(stopped >> joint & 1);
        }
    }
    println!("{}: {checked:?}", case.name);
    assert!(checked.priorities > STATES / 20 && checked.motions > STATES / 10, "{checked:?}");
    assert!(checked.standing.iter().all(|joints| *joints > STATES / 100), "{checked:?}");
}

/// A test for each mode, so that they run side by side.
macro_rules! laws_hold {
    ($($name:ident: $index:literal;)*) => {
        $(#[test]
        fn $name() {
            laws_hold_in(&situations::cases()[$index], $index);
        })*

        #[test]
        fn every_mode_is_tested() {
            assert_eq!([$($index),*].len(), situations::cases().len());
        }
    };
}

laws_hold! {
    laws_hold_in_stance: 0;
    laws_hold_on_the_right_foot: 1;
    laws_hold_on_the_left_foot: 2;
    laws_hold_on_the_right_gripper: 3;
    laws_hold_on_the_left_gripper: 4;
    laws_hold_in_one_half_of_a_trot: 5;
    laws_hold_in_the_other_half_of_a_trot: 6;
    laws_hold_walking_on_one_pair_of_feet: 7;
    laws_hold_walking_on_the_other_pair_of_feet: 8;
    laws_hold_walking_with_the_right_gripper: 9;
    laws_hold_walking_with_the_left_gripper: 10;
    laws_hold_walking_with_both_grippers: 11;
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
    let total: Vector3<f64> = output.contact_force.iter().sum();
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
    assert!(output.contact_force.iter().all(|force| force.norm() == 0.0));
    assert!(output.is_finite());
}

#[test]
fn three_steps_in_a_row_without_forces_are_a_fault_and_the_command_stays_safe() {
    let mut settings = WbcSettings::default();
    settings.contact.slack_weight[0] = f64::INFINITY;
    let mut bench = Bench::new(settings);
    let state = State::at_rest(stand());
    for step in 1..=4 {
        let output = bench.step(&state, &[], &ContactSet::STANCE);
        assert_eq!(output.status.forces, ForceSource::LastFeasible(ForceFailure::NotFinite));
        assert_eq!(output.status.force_failures, step);
        let fault = (step >= 3).then_some(WbcFault::Forces(ForceFailure::NotFinite));
        assert_eq!(output.status.fault, fault);
        assert!(output.is_finite());
        everything_is_within_limits(&bench);
    }
}

/// A target with its point moved by so much.
fn moved(objective: &Objective, by: Vector3<f64>) -> Objective {
    let mut moved = *objective;
    match &mut moved {
        Objective::TorsoPosition(reference)
        | Objective::FootPosition(_, reference)
        | Objective::GripperPosition(_, reference)
        | Objective::LegPosture(_, reference)
        | Objective::ArmPosture(_, reference) => reference.position += by,
        Objective::TorsoOrientation(reference) | Objective::GripperOrientation(_, reference) => {
            reference.orientation = UnitQuaternion::from_scaled_axis(10.0 * by) * reference.orientation;
        }
    }
    moved
}

/// The greatest difference of two commands: rad, rad/s, and shares of the greatest torques.
fn apart(model: &Model, one: &WbcOutput, other: &WbcOutput) -> f64 {
    let torque = (one.torque - other.torque).component_div(&model.max_torque);
    (one.position - other.position).amax().max((one.velocity - other.velocity).amax()).max(torque.amax())
}

/// A link above the ground, or away from another.
fn stops_a_limb(output: &WbcOutput) -> bool {
    output.status.grounded || output.status.kept_apart.is_some()
}

#[test]
fn the_command_is_continuous_where_a_target_is() {
    const WAYS: usize = 1000;
    /// Halvings of a way of 20 mm or 0.2 rad; what is left of it is nothing.
    const HALVINGS: usize = 30;
    let cases = situations::standing();
    let mut random = Random(11);
    let mut bench = Bench::new(WbcSettings::default());
    let mut dynamics = Dynamics::new();
    let (mut standing, mut limbs, mut begin_or_end) = (0, 0, 0);
    for way in 0..WAYS * cases.len() {
        let case = &cases[way % cases.len()];
        let state = situations::state(&mut random, &bench.model, &case.stance);
        dynamics.update(&bench.model, &state);
        let mut objectives = situations::objectives(&mut random, &case.objectives, &state, &dynamics);
        let contacts = situations::contacts(&mut random, &case.stance);
        let index = (random.share() * objectives.len() as f64) as usize;
        let (target, direction) = (objectives[index], random.vector(0.02));
        let mut at = |bench: &mut Bench, share: f64| {
            objectives[index] = moved(&target, direction * share);
            bench.step(&state, &objectives, &contacts)
        };
        // Into the half with the greater difference, again and again: a jump is left in the end.
        let (mut begin, mut end) = (0.0, 1.0);
        let mut first = at(&mut bench, begin);
        let stopped_first = standing_joints_that_stop(&bench, &contacts);
        let mut last = at(&mut bench, end);
        let stopped_last = standing_joints_that_stop(&bench, &contacts);
        standing += u64::from(stopped_first | stopped_last != 0);
        limbs += u64::from(stops_a_limb(&first) || stops_a_limb(&last));
        begin_or_end += u64::from(stopped_first != stopped_last);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (begin + end);
            let between = at(&mut bench, middle);
            if apart(&bench.model, &first, &between) > apart(&bench.model, &between, &last) {
                (end, last) = (middle, between);
            } else {
                (begin, first) = (middle, between);
            }
        }
        let jump = apart(&bench.model, &first, &last);
        assert!(jump < 1e-4, "{}: {:?} jumps by {jump}", case.name, objectives[index].kind());
    }
    let ways = WAYS * cases.len();
    println!(
        "of {ways} ways, standing joints stop on {standing} and begin or cease to on {begin_or_end}, limbs on {limbs}"
    );
    // The law is about them: from being stopped on, a joint has no velocity of its own.
    assert!(begin_or_end > WAYS as u64 / 10 && limbs > WAYS as u64, "{begin_or_end} {limbs}");
}
