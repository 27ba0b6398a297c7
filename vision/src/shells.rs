//! Shells: rigid bodies covered with tags, as `configs/shells/*.toml` describe them.
//!
//! Tag frame: origin at the tag's centre, x right, y up, z out of the printed face towards the viewer.

use nalgebra::{Isometry3, Point3};

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
}

/// A rigid shell.
#[derive(Debug, Clone, PartialEq)]
pub struct Shell {
    /// `torso`, `right_palm`, `left_palm`, `right_thumb` or `left_thumb`.
    pub name: String,
    /// Its tags.
    pub tags: Vec<ShellTag>,
}

/// All that the operator wears.
#[derive(Debug, Clone, PartialEq)]
pub struct ShellSet {
    /// Tag family of every tag, e.g. `tag36h11`.
    pub family: String,
    /// The shells.
    pub shells: Vec<Shell>,
}
