//! What a browser may ask.

use locoman_protocol::messages::{Mode, stop::Level};
use serde::Deserialize;

use crate::stick::Hand;

/// One message of a browser, e.g. `{"mode": "stance"}`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Request {
    /// Dead-man, keys and gamepad.
    Hand(Hand),
    /// A mode.
    Mode(ModeName),
    /// A stop.
    Stop(StopName),
    /// Switches the autopilot.
    Auto(bool),
}

/// Modes that a person may ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum ModeName {
    Stance,
    RightGripper,
    LeftGripper,
    RightFoot,
    LeftFoot,
    Locomotion,
    RightLocoManipulation,
    LeftLocoManipulation,
    LocoManipulation,
    Bimanual,
    LieDown,
}

impl From<ModeName> for Mode {
    fn from(name: ModeName) -> Self {
        match name {
            ModeName::Stance => Self::Stance,
            ModeName::RightGripper => Self::RightGripper,
            ModeName::LeftGripper => Self::LeftGripper,
            ModeName::RightFoot => Self::RightFoot,
            ModeName::LeftFoot => Self::LeftFoot,
            ModeName::Locomotion => Self::Locomotion,
            ModeName::RightLocoManipulation => Self::RightLocoManipulation,
            ModeName::LeftLocoManipulation => Self::LeftLocoManipulation,
            ModeName::LocoManipulation => Self::LocoManipulation,
            ModeName::Bimanual => Self::Bimanual,
            ModeName::LieDown => Self::LieDown,
        }
    }
}

/// How to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum StopName {
    Settle,
    Damp,
}

impl From<StopName> for Level {
    fn from(name: StopName) -> Self {
        match name {
            StopName::Settle => Self::Settle,
            StopName::Damp => Self::Damp,
        }
    }
}

/// The name of a protobuf enum's value as the page has it: `MODE_RIGHT_GRIPPER` is `right_gripper`.
pub(super) fn page_name(proto: &str, prefix: &str) -> String {
    proto.strip_prefix(prefix).unwrap_or(proto).to_ascii_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stick::{Drive, Target};
    use proptest::prelude::*;

    #[test]
    fn the_pages_messages_are_understood() {
        let request = |text: &str| serde_json::from_str::<Request>(text).unwrap();
        assert_eq!(request(r#"{"mode":"right_gripper"}"#), Request::Mode(ModeName::RightGripper));
        assert_eq!(request(r#"{"stop":"settle"}"#), Request::Stop(StopName::Settle));
        assert_eq!(request(r#"{"auto":false}"#), Request::Auto(false));
        let hand = r#"{"hand":{"held":true,"drive":"tracker","target":"effector","linear":[1,0,-0.5],
            "angular":[0,0,0],"opening":0.25}}"#;
        let expected = Hand {
            held: true,
            drive: Drive::Tracker,
            target: Target::Effector,
            linear: [1.0, 0.0, -0.5],
            angular: [0.0; 3],
            opening: 0.25,
        };
        assert_eq!(request(hand), Request::Hand(expected));
    }

    #[test]
    fn names_for_the_page() {
        assert_eq!(page_name(Mode::RightGripper.as_str_name(), "MODE_"), "right_gripper");
    }

    proptest! {
        #[test]
        fn any_text_is_a_request_or_an_error(text in ".{0,200}") {
            let _ = serde_json::from_str::<Request>(&text);
        }
    }
}
