//! Whether an operator's command may be looked at: the numbers in it are numbers.
//!
//! Pure, so that both sides and the tests judge alike. Workspace, step and rate limits are the robot's.

use crate::geometry::{self, PoseError};
use crate::messages::{Device, Mode, OperatorCommand};
use crate::topic::COMMAND_MAX_BYTES;
use prost::Message;

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
    /// A mode that this version does not know, or none although one is asked for.
    #[error("mode {0} is not known")]
    Mode(i32),
    /// A device that this version does not know.
    #[error("device {0} is not known")]
    Device(i32),
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
    let poses =
        [("torso", &command.torso), ("right palm", &command.right_palm), ("left palm", &command.left_palm)];
    for (body, pose) in poses {
        if let Some(pose) = pose {
            geometry::isometry(pose).map_err(|source| Rejection::Pose { body, source })?;
        }
    }
    let openings = [("right opening", command.right_opening), ("left opening", command.left_opening)];
    for (gripper, opening) in openings {
        // A NaN is in no range.
        if let Some(value) = opening.filter(|value| !(0.0..=1.0).contains(value)) {
            return Err(Rejection::Opening { gripper, value });
        }
    }
    let mode = Mode::try_from(command.mode).map_err(|_| Rejection::Mode(command.mode))?;
    if command.mode_request_id != 0 && mode == Mode::Unspecified {
        return Err(Rejection::Mode(command.mode));
    }
    Device::try_from(command.device).map_err(|_| Rejection::Device(command.device))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Header, Pose};
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
        }
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
