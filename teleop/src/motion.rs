//! What an input device asks for: displacements since engagement, ready for the command message.

use nalgebra::Isometry3;

/// A body that the operator moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Body {
    /// The operator's torso moves the robot's.
    Torso,
    /// The right palm moves the right gripper.
    RightPalm,
    /// The left palm moves the left gripper.
    LeftPalm,
}

impl Body {
    /// All, in the order of arrays of three.
    pub const ALL: [Self; 3] = [Self::Torso, Self::RightPalm, Self::LeftPalm];

    /// Name for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Torso => "torso",
            Self::RightPalm => "right palm",
            Self::LeftPalm => "left palm",
        }
    }
}

/// Displacements since engagement; `None`: not tracked, hold.
///
/// Translation in metres along the heading frame at engagement (x forward, y left, z up), rotation about
/// the axes of the same frame and applied from the left: `R_target = R * R_anchor`. At the moment of
/// engagement every displacement is the identity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion {
    /// In the order of [`Body::ALL`].
    pub bodies: [Option<Isometry3<f64>>; 3],
    /// Gripper openings right, left: 0 closed, 1 open.
    pub openings: [Option<f64>; 2],
    /// How to walk: forward and left, m/s, turning, rad/s; `None`: as the torso's displacement says.
    pub walk: Option<[f64; 3]>,
}

impl Motion {
    /// The displacement of one body.
    pub fn body(&self, body: Body) -> Option<&Isometry3<f64>> {
        self.bodies[body as usize].as_ref()
    }
}
