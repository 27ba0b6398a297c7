//! Whether an operator's command may be looked at: the numbers in it are numbers.
//!
//! Pure, so that both sides and the tests judge alike. Workspace, step and rate limits are the robot's.

use crate::geometry::{self, PoseError};
use crate::messages::{Device, Mode, OperatorCommand, Pose, Trajectory};
use crate::topic::COMMAND_MAX_BYTES;
use prost::Message;

/// The most waypoints of a trajectory.
pub const MAX_WAYPOINTS: usize = 32;

/// Why a command is refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Rejection {
    /// Longer than a command can be.
    #[error("the command has {bytes} bytes, more than {COMMAND_MAX_BYTES}")]
    TooLong {
        /// Its length.
        bytes: usize,
    },
    /// No header, or one without a source.
    #[error("the command does not say who sent it")]
    NoSource,
    /// A pose that is not one.
    #[error("{body}: {source}")]
    Pose {
        /// Which body's.
        body: &'static str,
        /// What is wrong with it.
        source: PoseError,
    },
    /// An opening that is not a number from 0 to 1.
    #[error("{gripper} is {value}, not in 0 to 1")]
    Opening {
        /// Which gripper's.
        gripper: &'static str,
        /// As received.
        value: f64,
    },
    /// A speed that is no number.
    #[error("a speed to walk at is {value}")]
    Velocity {
        /// As received.
        value: f64,
    },
    /// A mode that this version does not know, or none although one is asked for.
    #[error("mode {0} is not known")]
    Mode(i32),
    /// A device that this version does not know.
    #[error("device {0} is not known")]
    Device(i32),
    /// A trajectory without waypoints, or with too many.
    #[error("the trajectory has {count} waypoints, not 1 to {MAX_WAYPOINTS}")]
    Waypoints {
        /// How many it has.
        count: usize,
    },
    /// A time that is no number or not after the one before.
    #[error("waypoint {number} is at {time_s} s, not after {after_s} s")]
    Time {
        /// Counted from 1.
        number: usize,
        /// As received.
        time_s: f64,
        /// That of the waypoint before; 0 for the first.
        after_s: f64,
    },
}

/// Accepts a command whose every number can be used, else says why not.
pub fn validate(command: &OperatorCommand) -> Result<(), Rejection> {
    let bytes = command.encoded_len();
    if bytes > COMMAND_MAX_BYTES {
        return Err(Rejection::TooLong { bytes });
    }
    if command.header.as_ref().is_none_or(|header| header.source == 0) {
        return Err(Rejection::NoSource);
    }
    check_poses([
        ("torso", &command.torso),
        ("right palm", &command.right_palm),
        ("left palm", &command.left_palm),
    ])?;
    check_openings([("right opening", command.right_opening), ("left opening", command.left_opening)])?;
    if let Some(walk) = &command.walk {
        let speeds = [walk.forward_m_s, walk.left_m_s, walk.turn_rad_s];
        if let Some(value) = speeds.into_iter().find(|value| !value.is_finite()) {
            return Err(Rejection::Velocity { value });
        }
    }
    let mode = Mode::try_from(command.mode).map_err(|_| Rejection::Mode(command.mode))?;
    if command.mode_request_id != 0 && mode == Mode::Unspecified {
        return Err(Rejection::Mode(command.mode));
    }
    Device::try_from(command.device).map_err(|_| Rejection::Device(command.device))?;
    command.trajectory.as_ref().map_or(Ok(()), validate_trajectory)
}

/// Accepts a trajectory whose every number can be used and whose times grow, else says why not.
pub fn validate_trajectory(trajectory: &Trajectory) -> Result<(), Rejection> {
    let count = trajectory.waypoints.len();
    if !(1..=MAX_WAYPOINTS).contains(&count) {
        return Err(Rejection::Waypoints { count });
    }
    let mut after_s = 0.0;
    for (place, waypoint) in trajectory.waypoints.iter().enumerate() {
        let time_s = waypoint.time_s;
        // A NaN is after nothing.
        if !(time_s > after_s && time_s.is_finite()) {
            return Err(Rejection::Time { number: place + 1, time_s, after_s });
        }
        after_s = time_s;
        let poses = [
            ("torso of a waypoint", &waypoint.torso),
            ("right limb of a waypoint", &waypoint.right_limb),
            ("left limb of a waypoint", &waypoint.left_limb),
        ];
        check_poses(poses)?;
        check_openings([
            ("right opening of a waypoint", waypoint.right_opening),
            ("left opening of a waypoint", waypoint.left_opening),
        ])?;
    }
    Ok(())
}

fn check_poses(poses: [(&'static str, &Option<Pose>); 3]) -> Result<(), Rejection> {
    for (body, pose) in poses {
        if let Some(pose) = pose {
            geometry::isometry(pose).map_err(|source| Rejection::Pose { body, source })?;
        }
    }
    Ok(())
}

fn check_openings(openings: [(&'static str, Option<f64>); 2]) -> Result<(), Rejection> {
    for (gripper, opening) in openings {
        // A NaN is in no range.
        if let Some(value) = opening.filter(|value| !(0.0..=1.0).contains(value)) {
            return Err(Rejection::Opening { gripper, value });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Header, Velocity, Waypoint};
    use nalgebra::Isometry3;
    use proptest::prelude::*;

    fn good() -> OperatorCommand {
        let still = Some(Pose::from(&Isometry3::identity()));
        OperatorCommand {
            header: Some(Header { source: 7, sequence: 1, capture_ns: 2, send_ns: 3 }),
            engagement: 1,
            device: Device::Tracker.into(),
            torso: still,
            right_palm: still,
            left_palm: None,
            right_opening: Some(0.5),
            left_opening: None,
            mode_request_id: 1,
            mode: Mode::Stance.into(),
            trajectory: Some(through([1.0, 2.5])),
            walk: Some(Velocity { forward_m_s: 0.3, left_m_s: 0.0, turn_rad_s: -0.5 }),
        }
    }

    fn through(times_s: impl IntoIterator<Item = f64>) -> Trajectory {
        let still = Some(Pose::from(&Isometry3::identity()));
        let waypoint = |time_s| Waypoint { time_s, torso: still, right_limb: still, ..Waypoint::default() };
        Trajectory { waypoints: times_s.into_iter().map(waypoint).collect() }
    }

    #[test]
    fn a_good_command_is_accepted() {
        assert_eq!(validate(&good()), Ok(()));
    }

    #[test]
    fn a_command_without_a_source_is_refused() {
        assert_eq!(validate(&OperatorCommand { header: None, ..good() }), Err(Rejection::NoSource));
        let header = Some(Header { source: 0, ..good().header.unwrap() });
        assert_eq!(validate(&OperatorCommand { header, ..good() }), Err(Rejection::NoSource));
    }

    #[test]
    fn a_pose_that_is_none_is_refused_and_named() {
        let left_palm = Some(Pose { position_m: None, ..good().torso.unwrap() });
        assert_eq!(
            validate(&OperatorCommand { left_palm, ..good() }),
            Err(Rejection::Pose { body: "left palm", source: PoseError::Missing("position") })
        );
    }

    #[test]
    fn an_opening_outside_0_to_1_is_refused() {
        for value in [-0.001, 1.001, f64::NAN, f64::INFINITY] {
            let command = OperatorCommand { right_opening: Some(value), ..good() };
            assert!(matches!(validate(&command), Err(Rejection::Opening { .. })), "{value}");
        }
    }

    #[test]
    fn modes_and_devices_of_the_future_are_refused() {
        assert_eq!(validate(&OperatorCommand { mode: 99, ..good() }), Err(Rejection::Mode(99)));
        assert_eq!(validate(&OperatorCommand { mode: 0, ..good() }), Err(Rejection::Mode(0)));
        assert!(validate(&OperatorCommand { mode: 0, mode_request_id: 0, ..good() }).is_ok());
        assert_eq!(validate(&OperatorCommand { device: -1, ..good() }), Err(Rejection::Device(-1)));
    }

    #[test]
    fn trajectories_whose_times_do_not_grow_or_whose_numbers_are_none_are_refused() {
        let judge = |trajectory| validate(&OperatorCommand { trajectory: Some(trajectory), ..good() });
        let many = |count: u32| through((1..=count).map(f64::from));
        assert_eq!(judge(many(32)), Ok(()));
        assert_eq!(judge(many(33)), Err(Rejection::Waypoints { count: 33 }));
        assert_eq!(judge(many(0)), Err(Rejection::Waypoints { count: 0 }));
        let refused = Rejection::Time { number: 2, time_s: 1.0, after_s: 1.0 };
        assert_eq!(judge(through([1.0, 1.0])), Err(refused));
        for time_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(judge(through([time_s])), Err(Rejection::Time { number: 1, .. })), "{time_s}");
        }
        let mut broken = many(2);
        broken.waypoints[1].left_limb = Some(Pose { position_m: None, ..good().torso.unwrap() });
        assert!(matches!(judge(broken), Err(Rejection::Pose { body: "left limb of a waypoint", .. })));
        let mut broken = many(2);
        broken.waypoints[0].left_opening = Some(1.5);
        assert!(matches!(judge(broken), Err(Rejection::Opening { .. })));
    }

    #[test]
    fn the_longest_trajectory_fits_into_a_command() {
        let turned = Some(Pose::from(&Isometry3::new([0.1, 0.2, 0.3].into(), [0.4, 0.5, 0.6].into())));
        let waypoint = |number: u32| Waypoint {
            time_s: f64::from(number),
            torso: turned,
            right_limb: turned,
            left_limb: turned,
            right_opening: Some(0.3),
            left_opening: Some(0.3),
        };
        let trajectory = Some(Trajectory { waypoints: (1..=32).map(waypoint).collect() });
        assert_eq!(validate(&OperatorCommand { trajectory, ..good() }), Ok(()));
    }

    proptest! {
        #[test]
        fn what_is_accepted_has_usable_numbers(
            p in prop::array::uniform3(any::<f64>()),
            w in any::<f64>(),
            opening in any::<f64>(),
        ) {
            let mut command = good();
            command.right_opening = Some(opening);
            let torso = command.torso.as_mut().unwrap();
            torso.position_m = Some(crate::messages::Vector3 { x: p[0], y: p[1], z: p[2] });
            torso.orientation.as_mut().unwrap().w = w;
            if validate(&command).is_ok() {
                prop_assert!(p.iter().all(|v| v.is_finite()));
                prop_assert!((w.abs() - 1.0).abs() <= geometry::QUATERNION_NORM_TOLERANCE);
                prop_assert!((0.0..=1.0).contains(&opening));
            }
        }
    }
}
