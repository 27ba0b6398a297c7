//! Shells: rigid bodies covered with tags, as `configs/shells/*.toml` describe them.
//!
//! Tag frame: origin at the tag's centre, x right, y up, z out of the printed face towards the viewer.

pub mod design;

use std::collections::HashMap;
use std::path::Path;

use nalgebra::{Isometry3, Point3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use crate::config::{ConfigError, Fault, PoseEntry, Source, did_you_mean};

/// The names that the rest of the system knows.
pub const KNOWN_SHELLS: [&str; 5] = ["torso", "right_palm", "left_palm", "right_thumb", "left_thumb"];

/// One printed tag on a shell.
#[derive(Debug, Clone, PartialEq)]
pub struct ShellTag {
    /// Number within the family.
    pub id: u32,
    /// Side in metres of the black square, corner to corner as the detector reports corners.
    pub size_m: f64,
    /// Pose of the tag on the shell.
    pub shell_from_tag: Isometry3<f64>,
}

impl ShellTag {
    /// The corners in the shell frame, in the detector's order: bottom left, bottom right, top right,
    /// top left of the printed tag.
    pub fn corners(&self) -> [Point3<f64>; 4] {
        let h = self.size_m / 2.0;
        [(-h, -h), (h, -h), (h, h), (-h, h)].map(|(x, y)| self.shell_from_tag * Point3::new(x, y, 0.0))
    }

    /// The tag's centre in the shell frame.
    pub fn center(&self) -> Point3<f64> {
        self.shell_from_tag.translation.vector.into()
    }

    /// The unit normal of the printed face, outwards, in the shell frame.
    pub fn normal(&self) -> Vector3<f64> {
        self.shell_from_tag.rotation * Vector3::z()
    }
}

/// A rigid shell.
#[derive(Debug, Clone, PartialEq)]
pub struct Shell {
    /// `torso`, `right_palm`, `left_palm`, `right_thumb` or `left_thumb`.
    pub name: String,
    /// Its tags.
    pub tags: Vec<ShellTag>,
}

impl Shell {
    /// Radius in metres of the smallest sphere round the shell's origin that holds all tag corners.
    pub fn radius_m(&self) -> f64 {
        let corners = self.tags.iter().flat_map(ShellTag::corners);
        corners.map(|corner| corner.coords.norm()).fold(0.0, f64::max)
    }
}

/// All that the operator wears.
#[derive(Debug, Clone, PartialEq)]
pub struct ShellSet {
    /// Tag family of every tag, e.g. `tag36h11`.
    pub family: String,
    /// The shells.
    pub shells: Vec<Shell>,
}

impl ShellSet {
    /// Reads and checks a shells file.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        Self::from_source(&Source::read(path)?)
    }

    /// The index of a shell by its name.
    pub fn shell_index(&self, name: &str) -> Option<usize> {
        self.shells.iter().position(|shell| shell.name == name)
    }

    /// The palm that a thumb is on, by their names; `None` for every other shell.
    pub fn palm_of(&self, shell: usize) -> Option<usize> {
        let side = self.shells.get(shell)?.name.strip_suffix("thumb")?;
        self.shells.iter().position(|other| other.name.strip_suffix("palm") == Some(side))
    }

    fn from_source(source: &Source) -> Result<Self, ConfigError> {
        /// Number of codes in tag36h11.
        const CODES: u32 = 587;
        let file: ShellsFile = source.parse()?;
        if file.family.get_ref() != "tag36h11" {
            let problem = format!("tag family `{}` is not supported", file.family.get_ref());
            let fault = Fault::new(problem, "print the shells with family = \"tag36h11\"");
            return Err(source.error(file.family.span().start, fault));
        }
        let mut owner_of_tag: HashMap<u32, String> = HashMap::new();
        let mut shells: Vec<Shell> = Vec::new();
        for entry in file.shell {
            let offset = entry.span().start;
            let entry = entry.into_inner();
            check_name(&entry.name, &shells).map_err(|fault| source.error(offset, fault))?;
            let mut tags = Vec::with_capacity(entry.tag.len());
            for tag in entry.tag {
                let offset = tag.span().start;
                let tag = tag.into_inner().check().map_err(|fault| source.error(offset, fault))?;
                let id = tag.id;
                if id >= CODES {
                    let problem = format!("tag id {id} does not exist in tag36h11");
                    let fault = Fault::new(problem, format!("use an id below {CODES}"));
                    return Err(source.error(offset, fault));
                }
                if let Some(owner) = owner_of_tag.insert(id, entry.name.clone()) {
                    let problem = format!("tag id {id} is used twice (first on `{owner}`)");
                    let fault = Fault::new(problem, "give each tag of all shells its own id");
                    return Err(source.error(offset, fault));
                }
                tags.push(tag);
            }
            if tags.is_empty() {
                let problem = format!("shell `{}` has no tag", entry.name);
                let fault = Fault::new(problem, "add a [[shell.tag]] table for each tag");
                return Err(source.error(offset, fault));
            }
            shells.push(Shell { name: entry.name, tags });
        }
        if shells.is_empty() {
            let fault = Fault::new("no shell", "add a [[shell]] table for each shell");
            return Err(source.error(0, fault));
        }
        Ok(Self { family: file.family.into_inner(), shells })
    }
}

/// Any name may be used, but one that looks like a slip in a known name is refused.
fn check_name(name: &str, before: &[Shell]) -> Result<(), Fault> {
    if before.iter().any(|shell| shell.name == name) {
        let problem = format!("shell `{name}` is described twice");
        return Err(Fault::new(problem, "merge the two, or rename one"));
    }
    if KNOWN_SHELLS.contains(&name) {
        return Ok(());
    }
    match did_you_mean(name, &KNOWN_SHELLS) {
        Some(guess) => {
            let problem = format!("unknown shell `{name}`");
            Err(Fault::new(problem, format!("did you mean `{guess}`?")))
        }
        None if name.is_empty() => Err(Fault::new("a shell has no name", "write name = \"torso\"")),
        None => Ok(()),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ShellsFile {
    family: Spanned<String>,
    #[serde(default)]
    shell: Vec<Spanned<ShellEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ShellEntry {
    name: String,
    #[serde(default)]
    tag: Vec<Spanned<TagEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TagEntry {
    id: u32,
    size: f64,
    shell_from_tag: PoseEntry,
}

impl TagEntry {
    fn check(self) -> Result<ShellTag, Fault> {
        let Self { id, size, .. } = self;
        if !size.is_finite() || size <= 0.0 {
            let problem = format!("tag {id} has a size of {size} m");
            return Err(Fault::new(problem, "measure the side of the black square, in metres"));
        }
        let shell_from_tag = self.shell_from_tag.to_isometry("shell_from_tag")?;
        Ok(ShellTag { id, size_m: size, shell_from_tag })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"
family = "tag36h11"
[[shell]]
name = "torso"
[[shell.tag]]
id = 3
size = 0.055
shell_from_tag = { xyz = [0.0, 0.0, 0.1], quat = [1, 0, 0, 0] }
[[shell.tag]]
id = 4
size = 0.055
shell_from_tag = { xyz = [0.0, 0.1, 0.1], quat = [1, 0, 0, 0] }
"#;

    fn load(text: &str) -> Result<ShellSet, ConfigError> {
        ShellSet::from_source(&Source { path: "shells.toml".into(), text: text.to_owned() })
    }

    fn complaint(text: &str) -> String {
        load(text).expect_err("the file is wrong").to_string()
    }

    #[test]
    fn a_good_file_is_read_whole() {
        let sut = load(GOOD).expect("valid");
        assert_eq!(sut.shell_index("torso"), Some(0));
        let tag = &sut.shells[0].tags[1];
        assert_eq!((tag.id, tag.size_m), (4, 0.055));
        assert_eq!(tag.normal(), Vector3::z());
        assert_eq!(tag.corners()[0], Point3::new(-0.0275, 0.1 - 0.0275, 0.1));
    }

    #[test]
    fn mistakes_are_named_with_line_and_remedy() {
        let cases = [
            ("id = 4", "id = 3", "shells.toml:9: tag id 3 is used twice"),
            ("id = 4", "id = 587", "shells.toml:9: tag id 587 does not exist"),
            ("size = 0.055", "size = -1", "shells.toml:5: tag 3 has a size of -1"),
            ("size = 0.055", "szie = 1", "shells.toml:7: unknown field `szie`"),
            ("\"torso\"", "\"tosro\"", "did you mean `torso`?"),
            ("tag36h11", "tag16h5", "shells.toml:2: tag family"),
        ];
        for (good, bad, expected) in cases {
            let message = complaint(&GOOD.replace(good, bad));
            assert!(message.contains(expected) && message.contains("hint: "), "{message}");
        }
        assert!(complaint("family = \"tag36h11\"").contains("no shell"));
    }

    #[test]
    fn a_body_of_another_name_may_be_tracked_too() {
        assert!(load(&GOOD.replace("\"torso\"", "\"block\"")).is_ok());
    }
}
