//! Trajectory files: poses to go through and when, as TOML for people.
//!
//! ```
//! # use locoman_protocol::trajectory::TrajectoryFile;
//! let text = r#"
//!     mode = "right_gripper"        # in which the robot plays it
//!     [[pose]]
//!     time_s = 2.0                  # since engagement
//!     limb = { xyz = [0.05, 0.0, 0.02], rotvec = [0.0, 0.1, 0.0] }
//!     torso = { xyz = [0.01, 0.0, 0.0] }
//!     opening = 0.5
//! "#;
//! let file = TrajectoryFile::parse(text).unwrap();
//! assert_eq!(file.duration_s(), 2.0);
//! ```

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;
use toml::Spanned;

use crate::geometry::{QUATERNION_NORM_TOLERANCE, pose};
use crate::messages::{Mode, Trajectory, Waypoint};
use crate::validate::MAX_WAYPOINTS;

/// Modes in which a trajectory can be played, by their names in files, and the side of their limb.
const MODES: [(&str, Mode, Option<usize>); 5] = [
    ("stance", Mode::Stance, None),
    ("right_gripper", Mode::RightGripper, Some(0)),
    ("left_gripper", Mode::LeftGripper, Some(1)),
    ("right_foot", Mode::RightFoot, Some(0)),
    ("left_foot", Mode::LeftFoot, Some(1)),
];

/// Why a file is no trajectory.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryError {
    /// The file cannot be read.
    #[error("{path}: {source}; the examples are in configs/trajectories")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Something in it is wrong.
    #[error("{path}: {problem}")]
    Content {
        /// The file.
        path: PathBuf,
        /// What, and in which line.
        problem: Problem,
    },
}

/// What is wrong with the text of a file.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// Not valid TOML, an unknown key or a wrong type; the message shows the line.
    #[error(transparent)]
    Parse(#[from] toml::de::Error),
    /// A value that cannot be used.
    #[error("line {line}: {what}")]
    Value {
        /// Counted from 1.
        line: usize,
        /// The value and what it should be.
        what: String,
    },
    /// No poses, or too many for a command.
    #[error("there are {0} entries [[pose]]; write 1 to {MAX_WAYPOINTS}")]
    Count(usize),
}

/// A trajectory and the mode in which to play it.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryFile {
    /// The mode.
    pub mode: Mode,
    /// The motion, as commands carry it.
    pub trajectory: Trajectory,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    mode: Spanned<String>,
    #[serde(default)]
    pose: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    time_s: Spanned<f64>,
    torso: Option<Spanned<Displacement>>,
    limb: Option<Spanned<Displacement>>,
    opening: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Displacement {
    #[serde(default)]
    xyz: [f64; 3],
    rotvec: Option<[f64; 3]>,
    quat: Option<[f64; 4]>,
}

impl TrajectoryFile {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, TrajectoryError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| TrajectoryError::Read { path: path.to_owned(), source })?;
        Self::parse(&text).map_err(|problem| TrajectoryError::Content { path: path.to_owned(), problem })
    }

    /// Reads the text of a file.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        let file: File = toml::from_str(text)?;
        let wrong = |at: std::ops::Range<usize>, what: String| Problem::Value {
            line: 1 + text[..at.start].matches('\n').count(),
            what,
        };
        let name = file.mode.get_ref();
        let Some((_, mode, side)) = MODES.iter().find(|(known, ..)| known == name) else {
            let known: Vec<_> = MODES.iter().map(|(name, ..)| *name).collect();
            return Err(wrong(
                file.mode.span(),
                format!("mode = {name:?}; write one of {}", known.join(", ")),
            ));
        };
        if !(1..=MAX_WAYPOINTS).contains(&file.pose.len()) {
            return Err(Problem::Count(file.pose.len()));
        }
        let mut after_s = 0.0;
        let mut waypoints = Vec::with_capacity(file.pose.len());
        for entry in &file.pose {
            let time_s = *entry.time_s.get_ref();
            if !(time_s > after_s && time_s.is_finite()) {
                let what = format!("time_s = {time_s}; write a time after {after_s} s");
                return Err(wrong(entry.time_s.span(), what));
            }
            after_s = time_s;
            let mut waypoint = Waypoint { time_s, ..Waypoint::default() };
            let displaced = |displacement: &Option<Spanned<Displacement>>| match displacement {
                None => Ok(None),
                Some(given) => match given.get_ref().isometry() {
                    Ok(isometry) => Ok(Some(pose(&isometry))),
                    Err(what) => Err(wrong(given.span(), what)),
                },
            };
            waypoint.torso = displaced(&entry.torso)?;
            let limb = displaced(&entry.limb)?;
            let opening = entry.opening.as_ref().map(|opening| *opening.get_ref());
            if let (None, Some(at)) =
                (side, entry.limb.as_ref().map(Spanned::span).or(entry.opening.as_ref().map(Spanned::span)))
            {
                return Err(wrong(
                    at,
                    format!("mode {name} moves the torso only; leave limb and opening out"),
                ));
            }
            if let Some(given) = entry.opening.as_ref().filter(|given| !(0.0..=1.0).contains(given.get_ref()))
            {
                let what = format!("opening = {}; write 0 (closed) to 1 (open)", given.get_ref());
                return Err(wrong(given.span(), what));
            }
            match side {
                Some(0) => (waypoint.right_limb, waypoint.right_opening) = (limb, opening),
                Some(_) => (waypoint.left_limb, waypoint.left_opening) = (limb, opening),
                None => {}
            }
            waypoints.push(waypoint);
        }
        Ok(Self { mode: *mode, trajectory: Trajectory { waypoints } })
    }

    /// When the last pose is reached, s.
    pub fn duration_s(&self) -> f64 {
        self.trajectory.waypoints.last().map_or(0.0, |waypoint| waypoint.time_s)
    }
}

impl Displacement {
    fn isometry(&self) -> Result<Isometry3<f64>, String> {
        let numbers = || {
            let rotation = self.rotvec.iter().flatten().chain(self.quat.iter().flatten());
            self.xyz.iter().chain(rotation)
        };
        if let Some(value) = numbers().find(|value| !value.is_finite()) {
            return Err(format!("{value} is no finite number"));
        }
        let rotation = match (self.rotvec, self.quat) {
            (Some(_), Some(_)) => return Err("rotvec and quat say the same; write one of them".into()),
            (Some(rotvec), None) => UnitQuaternion::from_scaled_axis(Vector3::from(rotvec)),
            (None, Some([w, x, y, z])) => {
                let quaternion = Quaternion::new(w, x, y, z);
                let norm = quaternion.norm();
                if (norm - 1.0).abs() > QUATERNION_NORM_TOLERANCE {
                    return Err(format!("quat = [w, x, y, z] has norm {norm:.4}; write one of norm 1"));
                }
                UnitQuaternion::new_normalize(quaternion)
            }
            (None, None) => UnitQuaternion::identity(),
        };
        Ok(Isometry3::from_parts(Vector3::from(self.xyz).into(), rotation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::isometry;
    use crate::validate::validate_trajectory;

    const GOOD: &str = "mode = \"left_gripper\"\n\
        [[pose]]\n\
        time_s = 1.5\n\
        limb = { xyz = [0.1, 0.0, -0.05], rotvec = [0.0, 0.3, 0.0] }\n\
        [[pose]]\n\
        time_s = 4\n\
        torso = { xyz = [0.01, 0.0, 0.0], quat = [1.0, 0.0, 0.0, 0.0] }\n\
        opening = 0.5\n";

    #[test]
    fn a_file_says_what_each_body_does() {
        let file = TrajectoryFile::parse(GOOD).unwrap();
        assert_eq!((file.mode, file.duration_s()), (Mode::LeftGripper, 4.0));
        assert_eq!(validate_trajectory(&file.trajectory), Ok(()));
        let [first, second] = &file.trajectory.waypoints[..] else { panic!("two waypoints") };
        let limb = isometry(&first.left_limb.unwrap()).unwrap();
        assert!((limb.rotation.scaled_axis() - Vector3::new(0.0, 0.3, 0.0)).norm() < 1e-12);
        assert_eq!((first.torso, first.right_limb, second.left_limb), (None, None, None));
        assert_eq!((second.left_opening, second.right_opening), (Some(0.5), None));
    }

    #[test]
    fn what_cannot_be_used_is_refused_with_its_line_and_a_remedy() {
        let cases = [
            (
                "mode = \"left_gripper\"",
                "mode = \"gripper\"",
                "line 1: mode = \"gripper\"; write one of stance,",
            ),
            ("time_s = 4", "time_s = 1.5", "line 6: time_s = 1.5; write a time after 1.5 s"),
            ("time_s = 1.5", "time_s = nan", "line 3: time_s = NaN; write a time after 0 s"),
            ("0.0, -0.05]", "0.0, inf]", "line 4: inf is no finite number"),
            (
                "quat = [1.0",
                "quat = [0.5",
                "line 7: quat = [w, x, y, z] has norm 0.5000; write one of norm 1",
            ),
            ("opening = 0.5", "opening = 2.0", "line 8: opening = 2; write 0 (closed) to 1 (open)"),
            ("left_gripper", "stance", "line 4: mode stance moves the torso only"),
            ("opening", "opneing", "unknown field `opneing`"),
        ];
        for (from, to, expected) in cases {
            assert!(GOOD.contains(from));
            let said = TrajectoryFile::parse(&GOOD.replace(from, to)).unwrap_err().to_string();
            assert!(said.contains(expected), "{said:?} lacks {expected:?}");
        }
        let said = TrajectoryFile::parse("mode = \"stance\"").unwrap_err().to_string();
        assert_eq!(said, "there are 0 entries [[pose]]; write 1 to 32");
    }
}
