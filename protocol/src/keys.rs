//! The one place where key expressions are made: `locoman/1/<robot>/<suffix>`.
//!
//! The number is the protocol's major version: a breaking change takes a new key space, so that old and new
//! sides do not misread but miss each other.

use crate::topic::Topic;

/// What all keys of this protocol begin with.
pub const PREFIX: &str = "locoman/1";

/// Longest robot or sender name.
pub const MAX_NAME_CHARS: usize = 64;

/// A name that cannot stand in a key.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// Empty, too long, or with characters that mean something in key expressions.
    #[error("`{name}` cannot be the name of a {what}: use 1 to {MAX_NAME_CHARS} letters, digits, `-` or `_`")]
    Name {
        /// What the name was for.
        what: &'static str,
        /// The name as given.
        name: String,
    },
    /// A topic of which each sender has its own key was used without the sender's name.
    #[error("messages on `{suffix}/*` need the sender's name: use `sender_named`")]
    Unnamed {
        /// The topic.
        suffix: &'static str,
    },
    /// A name was given to a topic which has one key.
    #[error("`{suffix}` has one key for all senders: use `sender`")]
    Named {
        /// The topic.
        suffix: &'static str,
    },
}

/// A robot's name, checked once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RobotName(String);

impl RobotName {
    /// Accepts 1 to [`MAX_NAME_CHARS`] ASCII letters, digits, `-`, `_`.
    pub fn new(name: &str) -> Result<Self, KeyError> {
        check_name("robot", name)?;
        Ok(Self(name.to_owned()))
    }

    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// The key that messages of a topic are put on.
pub fn publish(robot: &RobotName, topic: &Topic) -> Result<String, KeyError> {
    if topic.named {
        return Err(KeyError::Unnamed { suffix: topic.suffix });
    }
    Ok(base(robot, topic))
}

/// The key that one named sender of a topic puts on, as `detections/<camera>`.
pub fn publish_named(robot: &RobotName, topic: &Topic, name: &str) -> Result<String, KeyError> {
    if !topic.named {
        return Err(KeyError::Named { suffix: topic.suffix });
    }
    check_name("sender", name)?;
    Ok(format!("{}/{name}", base(robot, topic)))
}

/// The key expression that matches every sender of a topic.
pub fn subscribe(robot: &RobotName, topic: &Topic) -> String {
    let base = base(robot, topic);
    if topic.named { format!("{base}/*") } else { base }
}

fn base(robot: &RobotName, topic: &Topic) -> String {
    format!("{PREFIX}/{}/{}", robot.0, topic.suffix)
}

fn check_name(what: &'static str, name: &str) -> Result<(), KeyError> {
    let valid = (1..=MAX_NAME_CHARS).contains(&name.len())
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_'));
    if valid { Ok(()) } else { Err(KeyError::Name { what, name: name.to_owned() }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Detections, OperatorCommand, RobotState};
    use crate::topic::Wire;
    use proptest::prelude::*;
    use zenoh::key_expr::KeyExpr;

    fn robot() -> RobotName {
        RobotName::new("go1").unwrap()
    }

    #[test]
    fn a_key_names_the_version_the_robot_and_the_topic() {
        assert_eq!(publish(&robot(), &OperatorCommand::TOPIC).unwrap(), "locoman/1/go1/command");
        assert_eq!(subscribe(&robot(), &RobotState::TOPIC), "locoman/1/go1/state");
    }

    #[test]
    fn named_senders_have_keys_of_their_own_and_one_subscription_sees_them_all() {
        let key = publish_named(&robot(), &Detections::TOPIC, "zed0_left").unwrap();
        assert_eq!(key, "locoman/1/go1/detections/zed0_left");
        let all = KeyExpr::try_from(subscribe(&robot(), &Detections::TOPIC)).unwrap();
        assert!(all.includes(&KeyExpr::try_from(key).unwrap()));
        assert!(publish(&robot(), &Detections::TOPIC).is_err());
        assert!(publish_named(&robot(), &RobotState::TOPIC, "x").is_err());
    }

    #[test]
    fn names_that_would_change_the_meaning_of_a_key_are_refused() {
        for name in ["", "a/b", "*", "**", "$*", "go?", "#1", "@adv", "a b", "é", &"x".repeat(65)] {
            let error = RobotName::new(name).unwrap_err().to_string();
            assert!(error.contains("letters, digits"), "{error}");
        }
    }

    proptest! {
        #[test]
        fn every_accepted_name_makes_a_canonical_key(name in ".{0,70}") {
            if let Ok(robot) = RobotName::new(&name) {
                let key = publish(&robot, &OperatorCommand::TOPIC).unwrap();
                prop_assert!(KeyExpr::try_from(key).is_ok());
            }
        }
    }
}
