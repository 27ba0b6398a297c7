//! The lens models that can be fitted.

use locoman_vision::camera::Distortion;

use crate::bundle::lens::INTRINSICS;
use crate::bundle::{FIXED, FREE, Loose};

/// A lens model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Model {
    /// k1, k2, p1, p2.
    Radtan4,
    /// And k3.
    Radtan5,
    /// And the rational k4, k5, k6: for wide lenses.
    Radtan8,
    /// Kannala-Brandt with four coefficients, as OpenCV's fisheye: for lenses beyond 100 degrees.
    Fisheye,
}

impl Model {
    /// A lens without distortion.
    pub fn straight(self) -> Distortion {
        match self {
            Self::Fisheye => Distortion::Fisheye([0.0; 4]),
            _ => Distortion::RadTan([0.0; 8]),
        }
    }

    /// Coefficients beside focal lengths and centre.
    pub fn coefficients(self) -> usize {
        match self {
            Self::Radtan4 | Self::Fisheye => 4,
            Self::Radtan5 => 5,
            Self::Radtan8 => 8,
        }
    }

    /// What is adjusted.
    pub fn loose(self) -> [Loose; INTRINSICS] {
        std::array::from_fn(|k| if k < 4 + self.coefficients() { FREE } else { FIXED })
    }
}
