//! The demo's figures on sessions of which they are known.

use locoman_protocol::geometry;
use locoman_protocol::messages::{
    Header, Mode, OperatorCommand, Pose, RobotState, SimTruth, Timing, Tracking,
};
use locoman_sim::eval::demo::{Session, judge, report};
use nalgebra::{Isometry3, Translation3, Vector3};

const MS: u64 = 1_000_000;
const DELAY_NS: u64 = 80 * MS;
const ENGAGED_NS: u64 = 1_000 * MS;
const END_NS: u64 = 5_000 * MS;

fn pose(isometry: Isometry3<f64>) -> Option<Pose> {
    Some(geometry::pose(&isometry))
}

fn header(sequence: u64, capture_ns: u64, send_ns: u64) -> Option<Header> {
    Some(Header { source: 9, sequence, capture_ns, send_ns })
}

/// The operator's hand and torso since engagement.
fn displacement(time_ns: u64, scale: f64) -> Isometry3<f64> {
    let t = time_ns.saturating_sub(ENGAGED_NS) as f64 * 1e-9;
    let wave = |w: f64| (w * t).sin();
    Isometry3::new(
        scale * Vector3::new(0.08 * wave(2.0), 0.05 * wave(3.1), 0.06 * wave(1.3)),
        scale * Vector3::new(0.3 * wave(1.1), 0.0, 0.5 * wave(2.3)),
    )
}

fn apply(displacement: &Isometry3<f64>, anchor: &Isometry3<f64>) -> Isometry3<f64> {
    let moved = anchor.translation.vector + displacement.translation.vector;
    Isometry3::from_parts(Translation3::from(moved), displacement.rotation * anchor.rotation)
}

/// The robot's world in the simulator's.
fn sim_from_world() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.4, -1.0, 0.3), Vector3::new(0.02, -0.05, 2.0))
}

fn gripper_anchor() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.36, -0.19, -0.22), Vector3::new(0.1, 1.3, 0.0))
}

/// A session in which the right gripper follows 80 ms late and `offset` beside the command.
fn session(offset: Vector3<f64>) -> Session {
    let mut session = Session::default();
    let torso_anchor = Isometry3::identity();
    let held = |time_ns: u64| time_ns.saturating_sub(DELAY_NS).max(ENGAGED_NS);
    for (sequence, time_ns) in (0..END_NS).step_by(10 * MS as usize).enumerate() {
        let engaged = time_ns >= ENGAGED_NS;
        let torso = apply(&displacement(held(time_ns), 0.2), &torso_anchor);
        let gripper = apply(&displacement(held(time_ns), 1.0), &gripper_anchor());
        session.states.push(RobotState {
            header: header(sequence as u64, time_ns, time_ns),
            mode: Mode::RightGripper.into(),
            goal: Mode::RightGripper.into(),
            engagement: if engaged { 77 } else { 0 },
            command_source: 9,
            world_resets: 3,
            torso: pose(torso),
            torso_target: pose(torso),
            right_gripper: pose(gripper),
            right_gripper_target: pose(gripper),
            period: Some(Timing { p50_ns: 2_500_000, p99_ns: 2_600_000, worst_ns: 3_000_000, count: 400 }),
            ..RobotState::default()
        });
        let beside = Translation3::from(offset) * (sim_from_world() * gripper);
        session.truths.push(SimTruth {
            header: header(sequence as u64, time_ns, time_ns),
            torso: pose(sim_from_world() * torso),
            right_gripper: pose(beside),
            ..SimTruth::default()
        });
    }
    for (sequence, capture_ns) in (0..END_NS).step_by(33 * MS as usize).enumerate() {
        // Each observation is sent twice, as a station does that commands faster than its cameras.
        for repeat in 0..2 {
            session.commands.push(OperatorCommand {
                header: header(
                    2 * sequence as u64 + repeat,
                    capture_ns,
                    capture_ns + (20 + 16 * repeat) * MS,
                ),
                engagement: if capture_ns >= ENGAGED_NS { 77 } else { 0 },
                torso: pose(displacement(capture_ns, 0.2)),
                right_palm: pose(displacement(capture_ns, 1.0)),
                ..OperatorCommand::default()
            });
        }
        session.trackings.push(Tracking {
            header: header(sequence as u64, capture_ns, capture_ns + 15 * MS),
            detect_ns: 8 * MS,
            ..Tracking::default()
        });
    }
    session
}

#[test]
fn the_delay_of_a_robot_that_follows_late_is_found_and_taken_out() {
    let following = judge(&session(Vector3::zeros()));
    let [torso, gripper, _] = &following.commanded;
    assert!((following.delay_s - 0.080).abs() < 0.003, "{}", following.delay_s);
    assert!((following.engaged_s - 4.0).abs() < 0.02);
    assert!(gripper.position.len() > 100 && torso.position.len() == gripper.position.len());
    // A step of the delay's grid and the truth's interpolation are below 0.8 mm at 0.25 m/s.
    assert!(gripper.position.iter().chain(&torso.position).all(|error| *error < 8e-4));
    assert!(gripper.rotation.iter().chain(&torso.rotation).all(|error| *error < 4e-3));
}

#[test]
fn an_offset_of_the_true_gripper_is_an_error_at_any_delay() {
    let following = judge(&session(Vector3::new(0.0, 0.003, 0.0)));
    let errors = &following.commanded[1].position;
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    assert!((0.0025..=0.0031).contains(&mean), "{mean}");
    assert!(following.target[1].position.iter().all(|error| (error - 0.003).abs() < 1e-9));
}

#[test]
fn the_report_holds_what_the_table_asks_for() {
    let report = report(&session(Vector3::zeros()), 1);
    let value = |name: &str| report.value(name).unwrap();
    assert_eq!(value("falls"), 0.0);
    assert!(value("gripper.position.mean") < 0.5 && value("torso.rotation.mean") < 0.002);
    assert!(value("target.gripper.position.mean") < 1e-6);
    assert_eq!(value("latency.detect.p99"), 8.0);
    assert_eq!(value("latency.capture_to_sent.p50"), 20.0);
    assert!((value("tracker.rate") - 30.3).abs() < 0.1);
    assert_eq!(value("control_period.worst"), 3.0);
}

#[test]
fn a_fall_while_standing_is_counted_once_and_lying_down_is_none() {
    let mut fallen = session(Vector3::zeros());
    for truth in &mut fallen.truths[200..300] {
        truth.fallen = true;
    }
    assert_eq!(report(&fallen, 1).value("falls"), Some(1.0));
    for state in &mut fallen.states {
        state.mode = Mode::LieDown.into();
    }
    assert_eq!(report(&fallen, 1).value("falls"), Some(0.0));
}

#[test]
fn an_engagement_that_resumes_counts_from_where_it_was() {
    // The same hand, but a change of modes in the middle of the engagement: a new world, a new anchor.
    let mut session = session(Vector3::zeros());
    let change_ns = 3_000 * MS;
    let new_world_in_old = Isometry3::new(Vector3::new(0.05, 0.02, 0.01), Vector3::new(0.0, 0.0, 0.1));
    let count = session.states.len();
    for state in &mut session.states {
        let time_ns = state.header.as_ref().map_or(0, |header| header.capture_ns);
        let applied_ns = (time_ns.saturating_sub(DELAY_NS)) / (33 * MS) * 33 * MS;
        state.command_sequence = 2 * (applied_ns / (33 * MS));
        if time_ns < change_ns {
            continue;
        }
        state.world_resets = 4;
        for target in [
            &mut state.torso,
            &mut state.torso_target,
            &mut state.right_gripper,
            &mut state.right_gripper_target,
        ] {
            let in_old = geometry::isometry(target.as_ref().unwrap_or(&Pose::default()));
            let Ok(in_old) = in_old else { panic!("a pose of the test") };
            *target = pose(new_world_in_old.inverse() * in_old);
        }
    }
    assert!(count > 400);
    let following = judge(&session);
    // In the new world the displacement's axes are turned by 0.1 rad against this robot's motion; what must
    // not appear is the displacement up to the change, some 100 mm.
    let late: Vec<f64> = following.commanded[1].position.iter().copied().rev().take(5).collect();
    assert!(late.iter().all(|error| *error < 0.03), "{late:?}");
    assert!(following.target[1].position.iter().all(|error| *error < 1e-6));
}
